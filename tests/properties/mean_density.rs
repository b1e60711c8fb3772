//! Sheets of the mean density leave no convergence on average; the variance of the shear is Campbell's.

use haloray::config::{Config, HaloProfile, Preset, SheetModel};
use haloray::diagnostics::{Distortion, EffectiveLineOfSight};
use haloray::halo::mean_density_sheets;
use haloray::mapping::multiplane::{LineOfSight, Reference, Sheets};
use haloray::monitor::Silent;
use haloray::pipeline::{Selection, Sightlines, end, expectation, mean_convergence, populate};
use haloray::profile::mass::{MassModel, MassProfile};
use rayon::prelude::*;

/// The paper's population about a straight axis ray, sheets of the mean density.
fn config(min_point_shear: f64, change: impl Fn(&mut Config)) -> Config {
    let mut config = Preset::Paper.config().unwrap();
    config.haloes.min_point_shear = min_point_shear;
    config.line_of_sight.reference = Reference::Straight;
    config.line_of_sight.sheets = SheetModel::MeanDensity;
    change(&mut config);
    config
}

/// Mean and its standard error.
fn mean(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

/// κ_os of traced axis rays averages to 0.
fn assert_balanced(name: &str, config: &Config, selection: Selection, sightlines: u64, largest_error: f64) {
    let first = populate(config, None, 0, &Silent).unwrap();
    let mean_kappa = mean_convergence(config, &first.linear, &first.population, selection).unwrap();
    let kappa = |realisation| {
        let haloes = populate(config, None, realisation, &Silent).unwrap();
        let catalogue = match selection {
            Selection::All => haloes.catalogue.clone(),
            Selection::TidalRegime => haloes.in_tidal_regime(config).unwrap(),
        };
        let sheets = Sheets::Expected(mean_density_sheets(&mean_kappa, &catalogue));
        let sight = LineOfSight::along(Reference::Straight, &catalogue, &sheets).unwrap();
        Distortion::on_axis(&sight.observer_to_source()).tidal.kappa
    };
    let values: Vec<f64> = (0..sightlines).map(kappa).collect();
    let (mean, error) = mean(&values);
    let sheets = end(&mean_kappa);
    println!("{name}: κ_os {mean:+.5} ± {error:.5} of {sightlines} sightlines, sheets {sheets:.4}");
    assert!(mean.abs() < 3.0 * error && error < largest_error, "{name}");
}

fn truncated(config: &mut Config) {
    config.haloes.profile = HaloProfile::TruncatedNfw;
    config.haloes.total_mass_over_m200c = Some(1.0);
    config.haloes.concentration_scatter_dex = 0.16;
}

#[test]
fn sheets_of_the_mean_density_leave_no_convergence_on_average() {
    assert_balanced("kept NFW haloes", &config(1e-4, |_| ()), Selection::All, 20, 0.02);
    assert_balanced("tidal regime, truncated", &config(1e-4, truncated), Selection::TidalRegime, 10, 0.02);
}

#[test]
#[ignore = "slow: just nightly"]
fn sheets_balance_every_kind_of_haloes() {
    let all = Selection::All;
    let mut consistent = Preset::Consistent.config().unwrap();
    consistent.line_of_sight.sheets = SheetModel::MeanDensity;
    for (name, config, selection) in [
        ("kept NFW haloes", config(1e-6, |_| ()), all),
        ("larger cylinder", config(1e-6, |c| c.haloes.radius_cmpc = 18.46), all),
        ("looser cut", config(3e-7, |_| ()), all),
        ("truncated haloes", config(1e-6, truncated), all),
        ("tidal regime", config(1e-6, |_| ()), Selection::TidalRegime),
        ("tidal regime, truncated", config(1e-6, truncated), Selection::TidalRegime),
        ("without κ_h > 0.01", config(1e-6, |c| c.haloes.max_kappa = Some(0.01)), all),
        ("preset consistent", consistent, all),
    ] {
        assert_balanced(name, &config, selection, 240, 0.003);
    }
}

/// ⟨|γ|²⟩ of independent haloes: ∫ over the disc of γ_h², by Gauss–Legendre in ln θ.
fn shear_squared(lens: &MassModel, theta_max: f64) -> haloray::Result<f64> {
    let low = (1e-4f64).min(0.1 * theta_max).ln();
    Ok(haloray::numerics::quadrature::integrate(low, theta_max.ln(), 2, |ln| {
        let theta = ln.exp();
        let [xx, _, yy] = lens.hessian(theta, 0.0);
        2.0 * std::f64::consts::PI * theta * theta * (0.5 * (xx - yy)).powi(2)
    }))
}

/// Σ|γ_h|² and |γ_os|² over sightlines against Campbell's theorem: means and standard errors over the expectation.
fn shear_variance(config: &Config, sightlines: u64) -> [(f64, f64); 2] {
    let of = |realisation| {
        let haloes = populate(config, None, realisation, &Silent).unwrap();
        let effects = haloes.effects(config).unwrap();
        let sight = LineOfSight::along(Reference::Straight, &haloes.catalogue, &Sheets::OnAxis).unwrap();
        let os = Distortion::on_axis(&sight.observer_to_source()).tidal.gamma;
        let single: f64 = effects.decisive(config).gamma.iter().map(|gamma| gamma.norm_sqr()).sum();
        (single, os.norm_sqr())
    };
    let (single, os): (Vec<f64>, Vec<f64>) = (0..sightlines).map(of).unzip();
    let haloes = populate(config, None, 0, &Silent).unwrap();
    let expected = end(&expectation(config, &haloes.linear, &haloes.population, shear_squared).unwrap());
    println!("⟨|γ|²⟩ expected {expected:.4e}: rms {:.4}", expected.sqrt());
    [single, os].map(|values| {
        let (mean, error) = mean(&values);
        println!("{:.4} ± {:.4} of it in {sightlines} sightlines", mean / expected, error / expected);
        (mean / expected, error / expected)
    })
}

#[test]
fn the_shear_has_the_variance_of_independent_haloes() {
    for (ratio, error) in shear_variance(&config(1e-4, |_| ()), 24) {
        assert!((ratio - 1.0).abs() < 3.0 * error && error < 1.0, "{ratio} ± {error}");
    }
}

#[test]
#[ignore = "slow: just nightly"]
fn the_shear_has_the_variance_of_independent_haloes_within_two_per_cent() {
    for (ratio, error) in shear_variance(&config(1e-6, |_| ()), 2000) {
        assert!((ratio - 1.0).abs() < 0.02_f64.max(3.0 * error), "{ratio} ± {error}");
    }
}

/// ⟨|γ_LOS|²⟩ over sightlines against Campbell's theorem: mean and standard error over the expectation.
///
/// To first order a halo at χ adds w(χ)·γ_h to γ_LOS = γ_od + γ_os − γ_ds, with the kernels χ(χ_d − χ)/χ_d of od,
/// χ(χ_s − χ)/χ_s of os and (χ − χ_d)(χ_s − χ)/(χ_s − χ_d) of ds over that of os.
fn los_shear_variance(config: &Config, sightlines: u64) -> (f64, f64) {
    let all = Sightlines::of(config).unwrap();
    let z_lens = config.line_of_sight.z_lens;
    let square = |number: u64| {
        let haloes = all.draw(number, &Silent).unwrap();
        let sight = all.line_of_sight(&haloes.catalogue, Selection::All).unwrap();
        EffectiveLineOfSight::of(&sight, z_lens).unwrap().los.gamma.norm_sqr()
    };
    let squares: Vec<f64> = (0..sightlines).into_par_iter().map(square).collect();
    let single = expectation(config, all.linear(), all.population(), shear_squared).unwrap();
    let [chi_d, chi_s] =
        [z_lens, config.line_of_sight.z_source].map(|z| config.cosmology.comoving_distance_mpc(z));
    let os = |chi: f64| chi * (chi_s - chi) / chi_s;
    let los = |chi: f64| {
        if chi < chi_d {
            chi * (chi_d - chi) / chi_d + os(chi)
        } else {
            os(chi) - (chi - chi_d) * (chi_s - chi) / (chi_s - chi_d)
        }
    };
    const STEPS: usize = 4000;
    let at = |i: usize| chi_s * i as f64 / STEPS as f64;
    let step = |i: usize| {
        let middle = 0.5 * (at(i) + at(i + 1));
        (los(middle) / os(middle)).powi(2) * (single.value(at(i + 1)) - single.value(at(i)))
    };
    let expected: f64 = (0..STEPS).map(step).sum();
    let (mean, error) = mean(&squares);
    println!(
        "⟨|γ_LOS|²⟩ expected {expected:.4e}, rms {:.4}; {:.4} ± {:.4} of it in {sightlines} sightlines",
        expected.sqrt(),
        mean / expected,
        error / expected
    );
    (mean / expected, error / expected)
}

#[test]
fn the_shear_of_the_line_of_sight_has_the_variance_of_independent_haloes() {
    let (ratio, error) = los_shear_variance(&config(1e-4, |_| ()), 48);
    assert!((ratio - 1.0).abs() < 3.0 * error && error < 1.0, "{ratio} ± {error}");
}

#[test]
#[ignore = "slow: just nightly"]
fn the_shear_of_ten_thousand_lines_of_sight_has_the_variance_of_independent_haloes() {
    let (ratio, error) = los_shear_variance(&config(1e-6, |_| ()), 10_000);
    assert!((ratio - 1.0).abs() < 0.02_f64.max(3.0 * error), "{ratio} ± {error}");
}
