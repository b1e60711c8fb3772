//! What truncation and scatter of the haloes change: shear, flexion and Δ of single haloes and sightlines.

use super::matter::{Selection, end, mean_convergence};
use super::sightlines::populate;
use crate::config::{Config, HaloProfile};
use crate::error::Result;
use crate::monitor::{Monitor, Uncounted};

/// One choice, over sightlines.
#[derive(Debug, Clone, PartialEq)]
pub struct HaloChoice {
    /// What was chosen.
    pub name: String,
    /// Root mean square of |Σγ_h| over sightlines.
    pub rms_gamma: f64,
    /// Root mean square of |ΣF_h| averaged over the disc, per arcsec.
    pub rms_f_per_arcsec: f64,
    /// Haloes of Δ_h at or above the threshold, of two points, as a fraction.
    pub share_beyond_tidal: f64,
    /// The same by Δ_h averaged over the disc.
    pub share_beyond_tidal_of_disc: f64,
    /// Expected convergence of the haloes over that of all matter.
    pub matter_over_mean_density: f64,
}

/// Plain and truncated haloes, without and with scatter of their concentrations.
fn choices() -> Vec<(String, HaloProfile, [Option<f64>; 3], f64)> {
    let truncated = |r_s, r_200, mass| (HaloProfile::TruncatedNfw, [r_s, r_200, mass]);
    let profiles = [
        ("not truncated", (HaloProfile::Nfw, [None; 3])),
        ("r_t = 10 r_s", truncated(Some(10.0), None, None)),
        ("r_t = r_200c", truncated(None, Some(1.0), None)),
        ("r_t = 2 r_200c", truncated(None, Some(2.0), None)),
        ("total mass M200c", truncated(None, None, Some(1.0))),
    ];
    let scatters = [0.0, 0.16];
    let each = profiles.into_iter().flat_map(|(name, (profile, numbers))| {
        scatters.map(|dex| (format!("{name}, scatter {dex} dex"), profile, numbers, dex))
    });
    each.collect()
}

/// Every choice over the same `n` sightlines of the configuration.
///
/// # Errors
/// As [`populate`]; when cancelled.
pub fn halo_choices(config: &Config, n: u64, monitor: &dyn Monitor) -> Result<Vec<HaloChoice>> {
    let choices = choices();
    let task = monitor.task("choices of haloes", Some(n * choices.len() as u64));
    let row = |(name, profile, [r_s, r_200c, mass], dex): (String, HaloProfile, [Option<f64>; 3], f64)| {
        let mut config = config.clone();
        let own = &mut config.haloes;
        (own.profile, own.concentration_scatter_dex) = (profile, dex);
        (own.truncation_over_r_s, own.truncation_over_r_200c, own.total_mass_over_m200c) =
            (r_s, r_200c, mass);
        let (mut gamma, mut f, mut beyond, mut beyond_of_disc, mut haloes_seen) = (0.0, 0.0, 0, 0, 0);
        let mut matter = f64::NAN;
        let limit = config.diagnostics.delta_threshold;
        for sightline in 0..n {
            let haloes = populate(&config, None, sightline, &Uncounted(monitor))?;
            let effects = haloes.effects(&config)?;
            let single = effects.decisive(&config);
            let sum_f: nalgebra::Complex<f64> = single.averages.iter().map(|a| a.disc.f_per_arcsec).sum();
            gamma += single.gamma.iter().sum::<nalgebra::Complex<f64>>().norm_sqr();
            f += sum_f.norm_sqr();
            beyond += single.delta.iter().filter(|delta| **delta >= limit).count();
            beyond_of_disc += single.averages.iter().filter(|a| a.disc.delta >= limit).count();
            haloes_seen += single.delta.len();
            if sightline == 0 {
                let (linear, population) = (&haloes.linear, &haloes.population);
                let traced = end(&mean_convergence(&config, linear, population, Selection::All)?);
                matter = traced / crate::halo::smooth_convergences(population)[0];
            }
            task.advance(1);
        }
        let share = |count: usize| count as f64 / haloes_seen.max(1) as f64;
        Ok(HaloChoice {
            name,
            rms_gamma: (gamma / n as f64).sqrt(),
            rms_f_per_arcsec: (f / n as f64).sqrt(),
            share_beyond_tidal: share(beyond),
            share_beyond_tidal_of_disc: share(beyond_of_disc),
            matter_over_mean_density: matter,
        })
    };
    choices.into_iter().map(row).collect()
}
