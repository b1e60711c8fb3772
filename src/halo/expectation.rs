//! Expected sums over the haloes of a population, without drawing any (Campbell's theorem).
//!
//! For a Poisson process ⟨Σ_h f_h⟩ = ∫dχ∫d ln M n ∫d²r f, over the disc in which a halo of mass M is kept.

use rayon::prelude::*;

use super::nfw_parameters::NfwScaling;
use super::population::{Population, SLABS};
use super::truncation::Truncation;
use crate::constants::ARCSEC_RAD;
use crate::error::Result;
use crate::numerics::spline::UniformSpline;
use crate::profile::mass::{MassModel, Nfw, TruncatedNfw};

/// How drawn haloes are built from their masses.
pub struct HaloShapes<'a> {
    /// Median concentration of (M200c in Msun, redshift).
    pub concentration: &'a (dyn Fn(f64, f64) -> f64 + Sync),
    /// Log-normal scatter of the concentration, dex.
    pub scatter_dex: f64,
    /// Where haloes end, if they do.
    pub truncation: Option<Truncation>,
    /// Haloes of a smaller point-lens shear on the axis are left out.
    pub min_point_shear: f64,
    /// Steps in distance: 128 are good to 1e-4, 32 to 1e-3.
    pub chi_steps: usize,
}

/// Steps in ln M at whose ends the integral over the disc is done.
const MASS_STEPS: usize = 64;
/// Gauss–Hermite rule of a standard normal deviate.
const DEVIATES: [(f64, f64); 5] = [
    (0.0, 0.533_333_333_333_333_3),
    (1.355_626_179_974_266, 0.222_075_922_005_612_6),
    (-1.355_626_179_974_266, 0.222_075_922_005_612_6),
    (2.856_970_013_872_805_6, 0.011_257_411_327_720_71),
    (-2.856_970_013_872_805_6, 0.011_257_411_327_720_71),
];

/// ⟨Σ f⟩ of all haloes nearer than χ, as a spline in χ from observer to source.
///
/// `over_disc` is ∫d²θ f in arcsec² over the places θ of a halo within its second argument (arcsec) of the axis; the
/// halo comes centred on the axis.
///
/// # Errors
/// When a relation yields parameters that no profile allows.
pub fn expected_sum(
    population: &Population,
    shapes: &HaloShapes,
    over_disc: impl Fn(&MassModel, f64) -> Result<f64> + Sync,
) -> Result<UniformSpline> {
    let step = population.slab_cmpc() * SLABS as f64 / shapes.chi_steps as f64;
    // Nothing at the ends deflects.
    let inner: Result<Vec<f64>> = (1..shapes.chi_steps)
        .into_par_iter()
        .map(|i| at_distance(population, shapes, step * i as f64, &over_disc))
        .collect();
    let density = UniformSpline::new(0.0, step, &[vec![0.0], inner?, vec![0.0]].concat())?;
    let mut sums = vec![0.0];
    let mut sum = 0.0;
    for i in 0..shapes.chi_steps {
        let low = step * i as f64;
        let [a, b, c] = [0.0, 0.5, 1.0].map(|part| density.value(low + part * step));
        sum += step / 6.0 * (a + 4.0 * b + c);
        sums.push(sum);
    }
    UniformSpline::new(0.0, step, &sums)
}

/// ∫d ln M n ∫d²r f per comoving Mpc of distance.
fn at_distance(
    population: &Population,
    shapes: &HaloShapes,
    chi: f64,
    over_disc: &(impl Fn(&MassModel, f64) -> Result<f64> + Sync),
) -> Result<f64> {
    let scaling = NfwScaling::new(population.background(), population.z_source());
    let (limits, z) = (population.limits(), population.redshift(chi));
    let radius_squared_per_msun = scaling.einstein_radius_squared_per_msun(chi, z) / shapes.min_point_shear;
    let (start, end) = (limits.mass_min_msun.ln(), limits.mass_max_msun.ln());
    let step = (end - start) / MASS_STEPS as f64;
    let per_msun = |k: usize| -> Result<f64> {
        let mass = (start + step * k as f64).exp();
        let median = (shapes.concentration)(mass, z);
        let kept = (mass * radius_squared_per_msun).sqrt().min(limits.radius_cmpc);
        let theta_max = kept / chi / ARCSEC_RAD;
        let of = |c200c: f64| -> Result<f64> {
            let (r_s, alpha_rs) = scaling.angles_arcsec(mass, c200c, z, chi);
            let lens = match shapes.truncation {
                None => MassModel::Nfw(Nfw::new(r_s, alpha_rs, [0.0; 2])?),
                Some(truncation) => {
                    let r_trunc = r_s * truncation.over_r_s(c200c);
                    MassModel::TruncatedNfw(TruncatedNfw::new(r_s, alpha_rs, r_trunc, [0.0; 2])?)
                }
            };
            over_disc(&lens, theta_max)
        };
        let integral = if shapes.scatter_dex > 0.0 {
            DEVIATES.iter().try_fold(0.0, |sum, (deviate, weight)| {
                Ok::<f64, crate::Error>(sum + weight * of(median * 10f64.powf(shapes.scatter_dex * deviate))?)
            })?
        } else {
            of(median)?
        };
        Ok(integral / mass)
    };
    let per_msun: Vec<f64> = (0..=MASS_STEPS).map(per_msun).collect::<Result<_>>()?;
    let spline = UniformSpline::new(start, step, &per_msun)?;
    let slab = (chi / population.slab_cmpc()) as usize;
    let cmpc2_per_arcsec2 = (chi * ARCSEC_RAD).powi(2);
    Ok(cmpc2_per_arcsec2 * population.table(slab).mass_weighted(|ln_mass| spline.value(ln_mass)))
}
