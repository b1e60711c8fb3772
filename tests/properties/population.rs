//! The drawn population of the presets: published numbers, Poisson statistics, two draws of one process.

use crate::statistics::{kolmogorov_smirnov_p, poisson_dispersion_p};
use haloray::config::{Config, Preset};
use haloray::cosmology::LinearTheory;
use haloray::diagnostics::HaloTidal;
use haloray::halo::{
    DrawnHaloes, Epoch, HaloCatalogue, Population, draw_brute_force, draw_direct, passes_shear_cut,
};
use haloray::monitor::Silent;
use haloray::pipeline::populate;

/// lenstronomy's G·Msun, with which the expected numbers were integrated, over the IAU's.
const EXPECTED_NUMBERS_G_EXCESS: f64 = 2.8e-4;
/// Expected numbers: σ(M) of colossus's tables on their side.
const EXPECTED_NUMBER_TOLERANCE: f64 = 1e-3;
/// Number density of the paper's mass function per comoving Mpc³, and what σ(M) leaves open.
const NUMBER_PER_CMPC3: (f64, f64) = (5.597, 0.002);
/// Fraction of haloes beyond the tidal regime at θ_E = 1″; the mean of eight cones scatters by 0.04%.
const BEYOND_TIDAL: (f64, f64) = (0.139, 0.003);

fn config(preset: Preset) -> Config {
    preset.config().unwrap()
}

fn population(config: &Config) -> Population {
    let mut linear = LinearTheory::new(config.structure).unwrap();
    if let Some(h0) = config.haloes.h_units_h0_km_s_mpc {
        linear = linear.in_hubble_units_of(h0).unwrap();
    }
    let (settings, z_source) = (&config.haloes, config.line_of_sight.z_source);
    let relation =
        settings.mass_function.build(settings.mass_definition, linear.background(), z_source).unwrap();
    let dn_dlnm = |mass: f64, z: f64| relation.dn_dlnm_per_cmpc3(&linear, mass, z);
    Population::new(config.cosmology, z_source, settings.limits(), settings.epoch, dn_dlnm).unwrap()
}

fn catalogue(config: &Config, realisation: u64) -> HaloCatalogue {
    populate(config, None, realisation, &Silent).unwrap().catalogue
}

fn in_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(work)
}

fn radius_cmpc(haloes: &DrawnHaloes) -> Vec<f64> {
    haloes.x_cmpc.iter().zip(&haloes.y_cmpc).map(|(x, y)| x.hypot(*y)).collect()
}

#[test]
fn number_density_and_number_drawn_are_the_papers() {
    let population = population(&config(Preset::Paper));
    let density = population.table(0).number_per_cmpc3();
    println!("n = {density:.5} per Mpc^3, {:.0} haloes in the cylinder", population.expected_number_drawn());
    assert!((density - NUMBER_PER_CMPC3.0).abs() < NUMBER_PER_CMPC3.1, "{density}");
    assert!((population.expected_number_drawn() / 10_643_055.0 - 1.0).abs() < EXPECTED_NUMBER_TOLERANCE);
}

#[test]
fn expected_numbers_kept_are_those_of_the_conventions() {
    for (radius_cmpc, min_point_shear, want) in [
        (11.62, 1e-6, 34_742.0),
        (18.46, 1e-6, 39_810.0),
        (1e5, 1e-6, 60_486.0),
        (11.62, 1e-7, 232_823.0),
        (18.46, 1e-7, 276_493.0),
        (1e5, 1e-7, 604_858.0),
    ] {
        let mut config = config(Preset::Paper);
        config.haloes.radius_cmpc = radius_cmpc;
        config.haloes.min_point_shear = min_point_shear;
        let got = population(&config).expected_number_kept();
        println!(
            "R = {radius_cmpc} Mpc, shear {min_point_shear:e}: {got:.1}, {:+.1e} of {want}",
            got / want - 1.0
        );
        assert!((got / want - 1.0).abs() < EXPECTED_NUMBER_TOLERANCE);
    }
}

fn check_number_kept(seeds: u64) {
    let population = population(&config(Preset::Paper));
    let expected = population.expected_number_kept();
    let counts: Vec<f64> = (0..seeds)
        .map(|seed| draw_direct(&population, seed, 0, &Silent).unwrap().chi_cmpc.len() as f64)
        .collect();
    let mean = counts.iter().sum::<f64>() / seeds as f64;
    let variance = counts.iter().map(|n| (n - mean).powi(2)).sum::<f64>() / (seeds - 1) as f64;
    let standard_error = (expected / seeds as f64).sqrt();
    let p = poisson_dispersion_p(&counts, expected);
    println!(
        "mean {mean:.1}, expected {expected:.1} +- {standard_error:.1}; variance/mean {:.3}, p {p:.3}",
        variance / mean
    );
    assert!((mean - expected).abs() < 5.0 * standard_error);
    assert!((mean - 34_742.0).abs() < 5.0 * standard_error + EXPECTED_NUMBERS_G_EXCESS * 34_742.0);
    assert!((variance / mean - 1.0).abs() < 5.0 * (2.0 / (seeds - 1) as f64).sqrt());
    assert!(p > 1e-3);
}

#[test]
fn the_number_kept_is_poisson_in_forty_draws() {
    check_number_kept(40);
}

#[test]
#[ignore = "slow: just nightly"]
fn the_number_kept_is_poisson_in_a_thousand_draws() {
    check_number_kept(1000);
}

fn check_both_draws(seeds: u64) {
    let population = population(&config(Preset::Paper));
    for seed in 0..seeds {
        let all = draw_brute_force(&population, seed, 0, &Silent).unwrap();
        let kept = draw_direct(&population, seed, 0, &Silent).unwrap();
        let (n, m) = (all.chi_cmpc.len() as f64, kept.chi_cmpc.len() as f64);
        let expected = population.expected_number_drawn();
        assert!((all.number_drawn as f64 - expected).abs() < 4.0 * expected.sqrt());
        assert!((n - m).abs() < 4.0 * (n + m).sqrt(), "{n} {m}");
        let p = [
            kolmogorov_smirnov_p(&all.m200c_msun, &kept.m200c_msun),
            kolmogorov_smirnov_p(&all.chi_cmpc, &kept.chi_cmpc),
            kolmogorov_smirnov_p(&radius_cmpc(&all), &radius_cmpc(&kept)),
            kolmogorov_smirnov_p(&all.x_cmpc, &kept.x_cmpc),
        ];
        println!(
            "seed {seed}: {} drawn, {n} kept, {m} direct; p of mass, distance, radius, x: {p:.2?}",
            all.number_drawn
        );
        assert!(p.iter().all(|p| *p > 0.01));
    }
}

#[test]
fn both_draws_are_samples_of_one_process() {
    check_both_draws(1);
}

#[test]
#[ignore = "slow: just nightly"]
fn both_draws_are_samples_of_one_process_for_six_seeds() {
    check_both_draws(6);
}

#[test]
fn the_comparison_of_two_samples_can_fail() {
    let population = population(&config(Preset::Paper));
    let kept = draw_direct(&population, 0, 0, &Silent).unwrap();
    let heavier: Vec<f64> =
        draw_direct(&population, 1, 0, &Silent).unwrap().m200c_msun.iter().map(|m| 1.5 * m).collect();
    assert!(kolmogorov_smirnov_p(&kept.m200c_msun, &heavier) < 1e-6);
}

#[test]
fn threads_change_no_byte() {
    let population = population(&config(Preset::Paper));
    let bits = |haloes: &DrawnHaloes| -> Vec<u64> {
        let columns = [&haloes.chi_cmpc, &haloes.x_cmpc, &haloes.y_cmpc, &haloes.m200c_msun];
        columns.into_iter().flatten().map(|v| v.to_bits()).collect()
    };
    let direct = |n| bits(&in_threads(n, || draw_direct(&population, 7, 3, &Silent).unwrap()));
    let brute_force = |n| bits(&in_threads(n, || draw_brute_force(&population, 7, 3, &Silent).unwrap()));
    assert!(direct(1) == direct(2));
    assert!(brute_force(1) == brute_force(2));
    let paper = config(Preset::Paper);
    assert!(in_threads(1, || catalogue(&paper, 5)) == in_threads(2, || catalogue(&paper, 5)));
}

#[test]
fn a_seventh_of_the_haloes_is_beyond_the_tidal_regime() {
    const SEEDS: u64 = 8;
    let paper = config(Preset::Paper);
    let fractions: Vec<f64> = (0..SEEDS)
        .map(|realisation| {
            let haloes = catalogue(&paper, realisation);
            let tidal = HaloTidal::of(&haloes, 1.0).unwrap().within(0.1);
            tidal.iter().filter(|within| !**within).count() as f64 / haloes.len() as f64
        })
        .collect();
    let mean = fractions.iter().sum::<f64>() / SEEDS as f64;
    println!("beyond the tidal regime: mean {mean:.4} of {fractions:.4?}");
    assert!((mean - BEYOND_TIDAL.0).abs() < BEYOND_TIDAL.1);
}

#[test]
fn every_halo_of_both_presets_lies_where_it_may() {
    for preset in [Preset::Paper, Preset::Consistent] {
        let config = config(preset);
        let haloes = catalogue(&config, 0);
        let expected = population(&config).expected_number_kept();
        let number = haloes.len() as f64;
        println!("{preset:?}: {number} haloes, expected {expected:.0}");
        assert!((number - expected).abs() < 5.0 * expected.sqrt());
        let (masses, c) = (haloes.m200c_msun.as_ref().unwrap(), haloes.c200c.as_ref().unwrap());
        let limits = config.haloes.limits();
        assert!(masses.iter().all(|m| (limits.mass_min_msun..=limits.mass_max_msun).contains(m)));
        // Five standard deviations of the scatter beyond what the relation gives.
        let scatter = 10.0_f64.powf(5.0 * config.haloes.concentration_scatter_dex);
        assert!(c.iter().all(|c| (2.0 / scatter..20.0 * scatter).contains(c)));
        // Redshifts of the cut come from a spline good to 1e-9.
        let kept = passes_shear_cut(&haloes, limits.min_point_shear * (1.0 - 1e-8));
        assert!(kept.unwrap().iter().all(|keep| *keep));
        for i in 0..haloes.len() {
            let chi = config.cosmology.comoving_distance_mpc(haloes.z[i]);
            let angle = haloes.theta_x_arcsec[i].hypot(haloes.theta_y_arcsec[i]);
            let radius = chi * angle * haloray::constants::ARCSEC_RAD;
            assert!(radius < limits.radius_cmpc * (1.0 + 1e-12), "{radius}");
        }
    }
}

#[test]
fn relations_evolve_in_consistent_and_stand_still_in_paper() {
    /// Median concentration of the haloes of about 1e10 Msun between two redshifts.
    fn median_concentration(haloes: &HaloCatalogue, low: f64, high: f64) -> f64 {
        let (masses, c) = (haloes.m200c_msun.as_ref().unwrap(), haloes.c200c.as_ref().unwrap());
        let mut chosen: Vec<f64> = (0..haloes.len())
            .filter(|&i| (low..high).contains(&haloes.z[i]) && (0.8e10..1.25e10).contains(&masses[i]))
            .map(|i| c[i])
            .collect();
        chosen.sort_by(f64::total_cmp);
        chosen[chosen.len() / 2]
    }
    let (paper, consistent) = (config(Preset::Paper), config(Preset::Consistent));
    assert_eq!((paper.haloes.epoch, consistent.haloes.epoch), (Epoch::FrozenZ(0.5), Epoch::Evolving));
    let [frozen, evolving] = [&paper, &consistent].map(|config| {
        let haloes = catalogue(config, 1);
        [median_concentration(&haloes, 0.1, 0.3), median_concentration(&haloes, 1.2, 1.4)]
    });
    println!("c(1e10 Msun) at z 0.2 and 1.3: paper {frozen:.2?}, consistent {evolving:.2?}");
    assert!((frozen[0] / frozen[1] - 1.0).abs() < 0.02);
    // DJ19 falls from 12.5 to 6.4 between z = 0 and 1.5 (CONVENTIONS section 2).
    assert!((10.0..12.0).contains(&evolving[0]) && (6.4..8.0).contains(&evolving[1]));
    let ratio = population(&consistent).table(400).number_per_cmpc3()
        / population(&consistent).table(50).number_per_cmpc3();
    assert!((ratio - 1.0).abs() > 0.01, "the mass function evolves: {ratio}");
}

#[test]
fn without_a_cut_both_draws_keep_every_halo() {
    let mut config = config(Preset::Paper);
    (config.haloes.min_point_shear, config.haloes.radius_cmpc) = (0.0, 0.5);
    let population = population(&config);
    let direct = draw_direct(&population, 3, 0, &Silent).unwrap();
    assert_eq!(direct.chi_cmpc, draw_brute_force(&population, 3, 0, &Silent).unwrap().chi_cmpc);
    let (number, expected) = (direct.chi_cmpc.len() as f64, population.expected_number_drawn());
    assert_eq!(population.expected_number_kept(), expected);
    assert!((number - expected).abs() < 5.0 * expected.sqrt(), "{number} {expected}");
}
