//! Draws mock systems from a [`Protocol`].

use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::protocol::{HaloMassRule, PerturberRule, Protocol, SourceRule};
use super::system::{Baryons, Halo, LensedSource, MockSystem, Perturber};
use crate::constants::{ARCSEC_RAD, GM_SUN_OVER_C2_MPC};
use crate::cosmology::Background;
use crate::error::{Error, Result};
use crate::halo::NfwScaling;
use crate::numerics::random::{Stage, stream};
use crate::numerics::roots::bracketed_root;
use crate::profile::light::Sersic;
use crate::profile::mass::{MassProfile, Nfw, SersicMass};
use crate::profile::registry::Parameter;

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
            .map(|_| perturber(protocol, &source, &mut rng))
            .collect::<Result<_>>()?;
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
}

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
        let index = sersic_index(protocol, rng);
        // A profile of κ = 1 at its half-mass radius has the mass of so many arcsec² of the critical density.
        let unit_arcsec2 = flux_of_unit_amplitude(radius_arcsec, index)?;
        Ok(Baryons {
            mass_msun,
            k_eff: mass_msun / self.critical_density_msun_arcsec2() / unit_arcsec2,
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
        let chi_cmpc = self.background.comoving_distance_mpc(self.z_lens);
        let (r_s_arcsec, alpha_rs_arcsec) = NfwScaling::new(&self.background, self.z_source).angles_arcsec(
            m200c_msun,
            c200c,
            self.z_lens,
            chi_cmpc,
        );
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
            index: sersic_index(protocol, rng),
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

fn perturber(protocol: &Protocol, source: &LensedSource, rng: &mut impl Rng) -> Result<Perturber> {
    let [x, y] = on_disk(rng, source.radius_arcsec);
    let radius_arcsec = source.radius_arcsec * uniform(rng, protocol.perturber_radius);
    let index = uniform(rng, [2.0, 6.0]);
    let flux = match protocol.perturber_brightness {
        PerturberRule::Flux(flux) => flux,
        PerturberRule::Amplitude(amplitude) => {
            amplitude * flux_of_unit_amplitude(radius_arcsec, index)?
                / flux_of_unit_amplitude(source.radius_arcsec, source.index)?
        }
    };
    Ok(Perturber {
        flux,
        radius_arcsec,
        index,
        ellipticity: ellipticity(rng, protocol.perturber_least_axis_ratio),
        centre_arcsec: [source.centre_arcsec[0] + x, source.centre_arcsec[1] + y],
    })
}

/// Flux of a Sérsic profile of surface brightness 1 at its half-light radius.
fn flux_of_unit_amplitude(radius_arcsec: f64, index: f64) -> Result<f64> {
    Ok(Sersic::with_flux(1.0, radius_arcsec, index, [0.0; 2], [0.0; 2])?.amplitude().recip())
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

/// Log-normal within the domain of the profile; one draw in some 100,000 lies outside and is drawn again.
fn sersic_index(protocol: &Protocol, rng: &mut impl Rng) -> f64 {
    loop {
        let index = log_normal(rng, protocol.index_median, protocol.index_sd_ln);
        if Parameter::SERSIC_INDEX.domain.contains(index) {
            return index;
        }
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_drawn_is_never_refused() {
        // So wide that a third of the indices lie outside the domain of the profile.
        let wide = Protocol { index_sd_ln: 1.5, ..Protocol::paper() };
        let systems = MockSystem::draw_all(&wide, 1, 60, 0.08).unwrap();
        let indices = systems.iter().flat_map(|system| [system.baryons.index, system.source.index]);
        assert!(indices.clone().all(|index| (0.3..=10.0).contains(&index)));
        assert!(indices.fold(0.0, f64::max) > 8.0);
    }
}
