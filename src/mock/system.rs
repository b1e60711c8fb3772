//! One mock system: lens, line of sight and source, and what light passes through.

use nalgebra::Complex;

use crate::error::Result;
use crate::mapping::tidal::{LineOfSightModel, Tidal, TidalLens};
use crate::profile::mass::{MassModel, Nfw, SersicMass};

/// The stars of the lens, at the centre of the image; their light has the same shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Baryons {
    /// Mass.
    pub mass_msun: f64,
    /// Convergence at the half-mass radius.
    pub k_eff: f64,
    /// Half-mass and half-light radius.
    pub radius_arcsec: f64,
    /// Sérsic index.
    pub index: f64,
    /// (e1, e2) of the potential and of the light.
    pub ellipticity: [f64; 2],
    /// Apparent magnitude.
    pub magnitude: f64,
}

/// The dark halo of the lens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Halo {
    /// M200c.
    pub m200c_msun: f64,
    /// c200c.
    pub c200c: f64,
    /// Scale radius.
    pub r_s_arcsec: f64,
    /// Deflection at the scale radius.
    pub alpha_rs_arcsec: f64,
    /// (e1, e2) of the potential.
    pub ellipticity: [f64; 2],
    /// Centre.
    pub centre_arcsec: [f64; 2],
}

/// The source without its perturbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LensedSource {
    /// Apparent magnitude.
    pub magnitude: f64,
    /// Half-light radius.
    pub radius_arcsec: f64,
    /// Sérsic index.
    pub index: f64,
    /// (e1, e2).
    pub ellipticity: [f64; 2],
    /// Centre.
    pub centre_arcsec: [f64; 2],
}

/// A faint Sérsic profile on top of the source, which no fit knows of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Perturber {
    /// Flux relative to the source.
    pub flux: f64,
    /// Half-light radius.
    pub radius_arcsec: f64,
    /// Sérsic index.
    pub index: f64,
    /// (e1, e2).
    pub ellipticity: [f64; 2],
    /// Centre.
    pub centre_arcsec: [f64; 2],
}

/// One system.
#[derive(Debug, Clone, PartialEq)]
pub struct MockSystem {
    /// Its number in the catalogue, from 0.
    pub number: u64,
    /// Lenses drawn until one had the Einstein radius.
    pub attempts: u32,
    /// Redshift of the lens.
    pub z_lens: f64,
    /// Redshift of the source.
    pub z_source: f64,
    /// Einstein radius of the lens if it were round and centred.
    pub einstein_radius_arcsec: f64,
    /// Stars.
    pub baryons: Baryons,
    /// Halo.
    pub halo: Halo,
    /// Shear between observer and lens.
    pub gamma_od: [f64; 2],
    /// Shear between observer and source.
    pub gamma_os: [f64; 2],
    /// Shear between lens and source.
    pub gamma_ds: [f64; 2],
    /// Source.
    pub source: LensedSource,
    /// One to three.
    pub perturbers: Vec<Perturber>,
    /// Pixels a side of its image, of `pixel_scale_arcsec` at the draw.
    pub pixels: usize,
}

impl MockSystem {
    /// Stars and halo.
    ///
    /// # Errors
    /// Parameters out of their domain: none that a protocol draws.
    pub fn lenses(&self) -> Result<Vec<MassModel>> {
        let (stars, halo) = (&self.baryons, &self.halo);
        let sersic = SersicMass::new(stars.k_eff, stars.radius_arcsec, stars.index, [0.0, 0.0])?;
        let nfw = Nfw::new(halo.r_s_arcsec, halo.alpha_rs_arcsec, halo.centre_arcsec)?;
        Ok(vec![
            MassModel::Sersic(sersic.with_elliptical_potential(stars.ellipticity)?),
            MassModel::Nfw(nfw.with_elliptical_potential(halo.ellipticity)?),
        ])
    }

    /// The three shears.
    pub fn line_of_sight(&self) -> LineOfSightModel {
        let [od, os, ds] = [self.gamma_od, self.gamma_os, self.gamma_ds].map(|[g1, g2]| Tidal {
            kappa: 0.0,
            gamma: Complex::new(g1, g2),
            omega: 0.0,
        });
        LineOfSightModel::Full { od, os, ds }
    }

    /// γ_LOS and ω_LOS of A_LOS = A_odᵀA_ds⁻¹A_os.
    pub fn line_of_sight_distortion(&self) -> Tidal {
        match self.line_of_sight().minimal() {
            Some(LineOfSightModel::Minimal { los, .. }) => los,
            _ => Tidal { kappa: f64::NAN, gamma: Complex::new(f64::NAN, f64::NAN), omega: f64::NAN },
        }
    }

    /// Lens and line of sight.
    ///
    /// # Errors
    /// As [`Self::lenses`].
    pub fn mapping(&self) -> Result<TidalLens> {
        Ok(TidalLens::new(self.line_of_sight(), self.lenses()?))
    }
}
