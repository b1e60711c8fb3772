//! The numbers of a mock system by name: for tables, and as the truth of a fit.

use super::system::{MockSystem, Perturber};

const ARCSEC: Option<&str> = Some("arcsec");

/// A named quantity of a system: column name, unit, value.
pub type MockColumn = (&'static str, Option<&'static str>, fn(&MockSystem) -> f64);

impl MockSystem {
    /// Every number but those of the perturbers, which are [`Self::PERTURBER_COLUMNS`].
    pub const COLUMNS: [MockColumn; 40] = [
        ("number", None, |s| s.number as f64),
        ("attempts", None, |s| f64::from(s.attempts)),
        ("z_lens", None, |s| s.z_lens),
        ("z_source", None, |s| s.z_source),
        ("einstein_radius_arcsec", ARCSEC, |s| s.einstein_radius_arcsec),
        ("pixels", None, |s| s.pixels as f64),
        ("baryon_mass_msun", Some("Msun"), |s| s.baryons.mass_msun),
        ("baryon_k_eff", None, |s| s.baryons.k_eff),
        ("baryon_r_sersic_arcsec", ARCSEC, |s| s.baryons.radius_arcsec),
        ("baryon_n_sersic", None, |s| s.baryons.index),
        ("baryon_e1", None, |s| s.baryons.ellipticity[0]),
        ("baryon_e2", None, |s| s.baryons.ellipticity[1]),
        ("lens_light_magnitude", Some("mag"), |s| s.baryons.magnitude),
        ("halo_m200c_msun", Some("Msun"), |s| s.halo.m200c_msun),
        ("halo_c200c", None, |s| s.halo.c200c),
        ("halo_r_s_arcsec", ARCSEC, |s| s.halo.r_s_arcsec),
        ("halo_alpha_rs_arcsec", ARCSEC, |s| s.halo.alpha_rs_arcsec),
        ("halo_e1", None, |s| s.halo.ellipticity[0]),
        ("halo_e2", None, |s| s.halo.ellipticity[1]),
        ("halo_x_arcsec", ARCSEC, |s| s.halo.centre_arcsec[0]),
        ("halo_y_arcsec", ARCSEC, |s| s.halo.centre_arcsec[1]),
        ("gamma1_od", None, |s| s.gamma_od[0]),
        ("gamma2_od", None, |s| s.gamma_od[1]),
        ("gamma1_os", None, |s| s.gamma_os[0]),
        ("gamma2_os", None, |s| s.gamma_os[1]),
        ("gamma1_ds", None, |s| s.gamma_ds[0]),
        ("gamma2_ds", None, |s| s.gamma_ds[1]),
        ("gamma1_los", None, |s| s.line_of_sight_distortion().gamma.re),
        ("gamma2_los", None, |s| s.line_of_sight_distortion().gamma.im),
        ("omega_los", None, |s| s.line_of_sight_distortion().omega),
        ("kappa_los", None, |s| s.line_of_sight_distortion().kappa),
        ("source_magnitude", Some("mag"), |s| s.source.magnitude),
        ("source_r_sersic_arcsec", ARCSEC, |s| s.source.radius_arcsec),
        ("source_n_sersic", None, |s| s.source.index),
        ("source_e1", None, |s| s.source.ellipticity[0]),
        ("source_e2", None, |s| s.source.ellipticity[1]),
        ("source_x_arcsec", ARCSEC, |s| s.source.centre_arcsec[0]),
        ("source_y_arcsec", ARCSEC, |s| s.source.centre_arcsec[1]),
        ("perturbers", None, |s| s.perturbers.len() as f64),
        ("source_offset_arcsec", ARCSEC, |s| s.source.centre_arcsec[0].hypot(s.source.centre_arcsec[1])),
    ];
}

/// A named quantity of a perturber: end of the column's name, unit, value.
pub type PerturberColumn = (&'static str, Option<&'static str>, fn(&Perturber) -> f64);

impl MockSystem {
    /// Numbers of a perturber.
    pub const PERTURBER_COLUMNS: [PerturberColumn; 7] = [
        ("flux", None, |p| p.flux),
        ("r_sersic_arcsec", ARCSEC, |p| p.radius_arcsec),
        ("n_sersic", None, |p| p.index),
        ("e1", None, |p| p.ellipticity[0]),
        ("e2", None, |p| p.ellipticity[1]),
        ("x_arcsec", ARCSEC, |p| p.centre_arcsec[0]),
        ("y_arcsec", ARCSEC, |p| p.centre_arcsec[1]),
    ];

    /// What the parameters of the model `comprehensive` would be if it described the system exactly, by their names.
    pub fn truths(&self) -> Vec<(&'static str, f64)> {
        let (stars, halo, source) = (&self.baryons, &self.halo, &self.source);
        let los = self.line_of_sight_distortion();
        vec![
            ("gamma1_od", self.gamma_od[0]),
            ("gamma2_od", self.gamma_od[1]),
            ("gamma1_los", los.gamma.re),
            ("gamma2_los", los.gamma.im),
            ("omega_los", los.omega),
            ("lens.k_eff", stars.k_eff),
            ("lens.R_sersic", stars.radius_arcsec),
            ("lens.n_sersic", stars.index),
            ("lens.e1", stars.ellipticity[0]),
            ("lens.e2", stars.ellipticity[1]),
            ("lens2.Rs", halo.r_s_arcsec),
            ("lens2.alpha_Rs", halo.alpha_rs_arcsec),
            ("lens2.e1", halo.ellipticity[0]),
            ("lens2.e2", halo.ellipticity[1]),
            ("lens2.center_x", halo.centre_arcsec[0]),
            ("lens2.center_y", halo.centre_arcsec[1]),
            ("source.R_sersic", source.radius_arcsec),
            ("source.n_sersic", source.index),
            ("source.e1", source.ellipticity[0]),
            ("source.e2", source.ellipticity[1]),
            ("source.center_x", source.centre_arcsec[0]),
            ("source.center_y", source.centre_arcsec[1]),
            ("lens_light.R_sersic", stars.radius_arcsec),
            ("lens_light.n_sersic", stars.index),
            ("lens_light.e1", stars.ellipticity[0]),
            ("lens_light.e2", stars.ellipticity[1]),
        ]
    }
}
