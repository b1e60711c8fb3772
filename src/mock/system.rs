//! One mock system: everything about lens, line of sight and source, drawn from a [`Protocol`].

use nalgebra::Complex;
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::protocol::{HaloMassRule, Protocol, SourceRule};
use crate::constants::{ARCSEC_RAD, GM_SUN_OVER_C2_MPC};
use crate::cosmology::Background;
use crate::error::{Error, Result};
use crate::halo::NfwScaling;
use crate::mapping::tidal::{LineOfSightModel, Tidal, TidalLens};
use crate::numerics::random::{Stage, stream};
use crate::numerics::roots::bracketed_root;
use crate::profile::light::Sersic;
use crate::profile::mass::{MassModel, MassProfile, Nfw, SersicMass};

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

/// A faint round Sérsic profile on top of the source, which no fit knows of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Perturber {
    /// Flux relative to the source.
    pub flux: f64,
    /// Half-light radius.
    pub radius_arcsec: f64,
    /// Sérsic index.
    pub index: f64,
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

/// Lenses drawn before a protocol is said to have none of the Einstein radius it asks for.
const MOST_ATTEMPTS: u32 = 10_000;

impl MockSystem {
    /// Draws systems `0..number`; system i depends on protocol, seed and i alone.
    ///
    /// # Errors
    /// A protocol whose lenses hardly ever have the Einstein radius it asks for.
    pub fn draw_all(
        protocol: &Protocol,
        seed: u64,
        number: u64,
        pixel_scale_arcsec: f64,
    ) -> Result<Vec<Self>> {
        (0..number).into_par_iter().map(|i| Self::draw(protocol, seed, i, pixel_scale_arcsec)).collect()
    }

    /// Draws one system.
    ///
    /// # Errors
    /// As [`Self::draw_all`].
    pub fn draw(protocol: &Protocol, seed: u64, number: u64, pixel_scale_arcsec: f64) -> Result<Self> {
        let of = |block| stream(seed, number, Stage::MockSystem, block);
        let mut rng = of(0);
        let (z_lens, z_source) = (uniform(&mut rng, protocol.z_lens), uniform(&mut rng, protocol.z_source));
        let place = Place::new(z_lens, z_source);
        let mut lens_rng = of(1);
        let mut attempts = 0;
        let (baryons, halo, einstein_radius_arcsec) = loop {
            attempts += 1;
            let baryons = place.baryons(protocol, &mut lens_rng)?;
            let halo = place.halo(protocol, baryons.mass_msun, &mut lens_rng);
            let radius = einstein_radius(&baryons, &halo)?;
            if radius >= protocol.least_einstein_radius_arcsec {
                break (baryons, halo, radius);
            }
            if attempts == MOST_ATTEMPTS {
                let allowed = "one that lenses of this protocol reach";
                let least = protocol.least_einstein_radius_arcsec;
                return Err(Error::out_of_range("least Einstein radius", least, allowed));
            }
        };
        let mut rng = of(2);
        let [gamma_od, gamma_os, gamma_ds] =
            std::array::from_fn(|_| on_disk(&mut rng, protocol.largest_shear));
        let mut rng = of(3);
        let source = place.source(protocol, einstein_radius_arcsec, &mut rng)?;
        let mut rng = of(4);
        let [fewest, most] = protocol.perturbers;
        let perturbers = (0..rng.random_range(fewest..=most))
            .map(|_| perturber(protocol.perturber_flux, &source, &mut rng))
            .collect();
        let offset = source.centre_arcsec[0].hypot(source.centre_arcsec[1]);
        let width = protocol.image_width * (einstein_radius_arcsec + offset);
        Ok(Self {
            number,
            attempts,
            z_lens,
            z_source,
            einstein_radius_arcsec,
            baryons,
            halo,
            gamma_od,
            gamma_os,
            gamma_ds,
            source,
            perturbers,
            pixels: (width / pixel_scale_arcsec) as usize,
        })
    }

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
        let (model, lenses) = (self.line_of_sight(), self.lenses()?);
        Ok(TidalLens { model, lenses, time_delay_distance_mpc: f64::NAN })
    }
}

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
    pub const PERTURBER_COLUMNS: [PerturberColumn; 5] = [
        ("flux", None, |p| p.flux),
        ("r_sersic_arcsec", ARCSEC, |p| p.radius_arcsec),
        ("n_sersic", None, |p| p.index),
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

const ARCSEC: Option<&str> = Some("arcsec");

/// Distances of a lens and a source.
struct Place {
    background: Background,
    z_lens: f64,
    z_source: f64,
    /// Angular-diameter distances in Mpc.
    to_lens_mpc: f64,
    to_source_mpc: f64,
    between_mpc: f64,
}

impl Place {
    fn new(z_lens: f64, z_source: f64) -> Self {
        let background = Background::paper();
        Self {
            z_lens,
            z_source,
            to_lens_mpc: background.angular_diameter_distance_mpc(z_lens),
            to_source_mpc: background.angular_diameter_distance_mpc(z_source),
            between_mpc: background.angular_diameter_distance_between_mpc(z_lens, z_source),
            background,
        }
    }

    fn baryons(&self, protocol: &Protocol, rng: &mut impl Rng) -> Result<Baryons> {
        let mass_msun = log_normal(rng, protocol.mass_median_msun, protocol.mass_sd_ln);
        let radius_arcsec = protocol.radius_at_median_kpc * mass_msun / protocol.mass_median_msun
            * arcsec_per_kpc(self.to_lens_mpc);
        let index = log_normal(rng, protocol.index_median, protocol.index_sd_ln);
        // Convergence at the half-mass radius of a profile with total Σκ dθ² = 1 arcsec².
        let unit = Sersic::with_flux(1.0, radius_arcsec, index, [0.0; 2], [0.0; 2])?.amplitude();
        Ok(Baryons {
            mass_msun,
            k_eff: mass_msun / self.critical_density_msun_arcsec2() * unit,
            radius_arcsec,
            index,
            ellipticity: ellipticity(rng, protocol.least_axis_ratio),
            magnitude: apparent(of_stars(protocol, mass_msun), self.z_lens, self.to_lens_mpc),
        })
    }

    fn halo(&self, protocol: &Protocol, stars_msun: f64, rng: &mut impl Rng) -> Halo {
        let m200c_msun = match protocol.halo_mass {
            HaloMassRule::Times(range) => stars_msun * uniform(rng, range),
            HaloMassRule::Over(range) => stars_msun / uniform(rng, range),
        };
        let c200c = log_normal(rng, protocol.concentration_median, protocol.concentration_sd_ln);
        let (r_s_arcsec, alpha_rs_arcsec) =
            NfwScaling::new(&self.background, self.z_source).angles_arcsec(m200c_msun, c200c, self.z_lens);
        let offset = protocol.halo_offset_sd_pc * 1e-3 * arcsec_per_kpc(self.to_lens_mpc);
        let ellipticity = ellipticity(rng, protocol.least_axis_ratio);
        let centre_arcsec = [offset * normal(rng), offset * normal(rng)];
        Halo { m200c_msun, c200c, r_s_arcsec, alpha_rs_arcsec, ellipticity, centre_arcsec }
    }

    fn source(&self, protocol: &Protocol, einstein_radius: f64, rng: &mut impl Rng) -> Result<LensedSource> {
        let (radius_kpc, absolute) = match protocol.source {
            SourceRule::Radius { median_kpc, sd_ln, magnitude_at_median } => {
                let radius = log_normal(rng, median_kpc, sd_ln);
                (radius, magnitude_at_median - 5.0 * (radius / median_kpc).log10())
            }
            SourceRule::Mass => {
                let mass = log_normal(rng, protocol.mass_median_msun, protocol.mass_sd_ln);
                let radius = protocol.radius_at_median_kpc * mass / protocol.mass_median_msun;
                (radius, of_stars(protocol, mass))
            }
        };
        let radius_arcsec = radius_kpc * arcsec_per_kpc(self.to_source_mpc);
        Ok(LensedSource {
            magnitude: apparent(absolute, self.z_source, self.to_source_mpc),
            radius_arcsec,
            index: log_normal(rng, protocol.index_median, protocol.index_sd_ln),
            ellipticity: ellipticity(rng, protocol.least_axis_ratio),
            centre_arcsec: on_disk(rng, radius_arcsec.min(einstein_radius)),
        })
    }

    /// Σ_cr = c²D_s/(4πG D_d D_ds).
    fn critical_density_msun_arcsec2(&self) -> f64 {
        let per_mpc2 = self.to_source_mpc
            / (4.0 * std::f64::consts::PI * GM_SUN_OVER_C2_MPC * self.to_lens_mpc * self.between_mpc);
        per_mpc2 * (self.to_lens_mpc * ARCSEC_RAD).powi(2)
    }
}

/// θ_E of stars and halo as if both were round and centred: θ = α_stars(θ) + α_halo(θ), 0 where there is none.
///
/// The mean convergence of both falls outwards, so that there is one root at most.
fn einstein_radius(stars: &Baryons, halo: &Halo) -> Result<f64> {
    const BRACKET_ARCSEC: [f64; 2] = [1e-4, 1e3];
    const TOLERANCE: f64 = 1e-13;
    let sersic = SersicMass::new(stars.k_eff, stars.radius_arcsec, stars.index, [0.0; 2])?;
    let nfw = Nfw::new(halo.r_s_arcsec, halo.alpha_rs_arcsec, [0.0; 2])?;
    let excess = |ln_theta: f64| {
        let theta = ln_theta.exp();
        (sersic.deflection(theta, 0.0)[0] + nfw.deflection(theta, 0.0)[0]) / theta - 1.0
    };
    let [low, high] = BRACKET_ARCSEC.map(f64::ln);
    Ok(bracketed_root(excess, low, high, TOLERANCE).map_or(0.0, f64::exp))
}

fn perturber(flux: f64, source: &LensedSource, rng: &mut impl Rng) -> Perturber {
    let [x, y] = on_disk(rng, source.radius_arcsec);
    Perturber {
        flux,
        radius_arcsec: source.radius_arcsec * uniform(rng, [0.1, 1.0]),
        index: uniform(rng, [2.0, 6.0]),
        centre_arcsec: [source.centre_arcsec[0] + x, source.centre_arcsec[1] + y],
    }
}

/// M☉ − 2.5 log₁₀(M/Υ).
fn of_stars(protocol: &Protocol, mass_msun: f64) -> f64 {
    protocol.magnitude_of_sun - 2.5 * (mass_msun / protocol.mass_to_light).log10()
}

/// m = M + 5 log₁₀(D_L/Mpc) + 25, D_L = (1+z)²D_A.
fn apparent(absolute: f64, z: f64, angular_diameter_distance_mpc: f64) -> f64 {
    absolute + 5.0 * ((1.0 + z).powi(2) * angular_diameter_distance_mpc).log10() + 25.0
}

fn arcsec_per_kpc(angular_diameter_distance_mpc: f64) -> f64 {
    1e-3 / angular_diameter_distance_mpc / ARCSEC_RAD
}

fn uniform(rng: &mut impl Rng, [low, high]: [f64; 2]) -> f64 {
    low + (high - low) * rng.random::<f64>()
}

fn normal(rng: &mut impl Rng) -> f64 {
    StandardNormal.sample(rng)
}

fn log_normal(rng: &mut impl Rng, median: f64, sd_ln: f64) -> f64 {
    median * (sd_ln * normal(rng)).exp()
}

/// e = (1−q)/(1+q)·(cos 2φ, sin 2φ), q uniform up to 1.
fn ellipticity(rng: &mut impl Rng, least_axis_ratio: f64) -> [f64; 2] {
    let q = uniform(rng, [least_axis_ratio, 1.0]);
    let (sin, cos) = (2.0 * std::f64::consts::TAU * rng.random::<f64>()).sin_cos();
    let e = (1.0 - q) / (1.0 + q);
    [e * cos, e * sin]
}

/// Uniform on a disk: the square of the radius is uniform.
fn on_disk(rng: &mut impl Rng, radius: f64) -> [f64; 2] {
    let r = radius * rng.random::<f64>().sqrt();
    let (sin, cos) = (std::f64::consts::TAU * rng.random::<f64>()).sin_cos();
    [r * cos, r * sin]
}
