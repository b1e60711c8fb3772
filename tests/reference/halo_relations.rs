//! σ(M), growth, mass functions and concentrations against colossus, as installed and with refined tables.

use crate::oracle_table::{Agreement, Reference};
use haloray::cosmology::{LinearTheory, StructureParameters};
use haloray::halo::MassDefinition;
use haloray::halo::concentration::ConcentrationModel;
use haloray::halo::mass_function::{MassFunction, MassFunctionModel};
use haloray::numerics::quadrature::integrate;

/// σ(M): what is left of colossus's quadrature and spline when refined.
const SIGMA_TOLERANCE: f64 = 5e-6;
/// dlnσ/dlnM: the derivative of a spline is worse than its value.
const SLOPE_TOLERANCE: f64 = 1e-4;
/// D(z): both integrate Heath's formula; the file holds ten digits.
const GROWTH_TOLERANCE: f64 = 1e-9;
/// f(σ) dlnσ⁻¹/dlnM at identical Δ_m: σ and slope errors above, amplified by c/σ² in the exponent.
const SAME_OVERDENSITY_TOLERANCE: f64 = 1e-4;
/// Median with Δ_m not rounded to an integer as colossus does, and without radiation in Ωm(z).
const MASS_FUNCTION_Q50_TOLERANCE: f64 = 1e-3;
/// 99th percentile of the same: the largest clusters at z = 2, where rounding Δ_m counts most.
const MASS_FUNCTION_Q99_TOLERANCE: f64 = 5e-3;
/// Constant δ_c: only the σ and slope errors above remain.
const FOF_TOLERANCE: f64 = 1e-4;
/// DJ19 against the published equation solved directly on the refined σ, whose slope is off by 4e-5.
const CONCENTRATION_DIRECT_TOLERANCE: f64 = 1e-4;
/// DJ19 and DK15 against colossus as installed, whose σ, P(k) and G(c, n) tables are coarse.
const CONCENTRATION_DEFAULT_TOLERANCE: f64 = 5e-3;
/// DK15 with refined tables: the slope of the smooth spectrum comes from a spline there.
const CONCENTRATION_REFINED_TOLERANCE: f64 = 1e-5;
/// A power law: rounding of the file's ten digits.
const POWER_LAW_TOLERANCE: f64 = 1e-9;

fn planck18() -> LinearTheory {
    LinearTheory::new(StructureParameters::planck18()).unwrap()
}

/// `function(mass_msun, z)` on every row of a table.
fn evaluate(reference: &Reference, function: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    let rows = reference.column("mass_msun").iter().zip(reference.column("z"));
    rows.map(|(&mass_msun, &z)| function(mass_msun, z)).collect()
}

fn tinker08(linear: &LinearTheory, definition: MassDefinition) -> Box<dyn MassFunction> {
    MassFunctionModel::Tinker08.build(definition, linear.background(), 2.0).unwrap()
}

#[test]
fn sigma_its_slope_and_growth_agree_with_refined_tables() {
    let reference = Reference::load("halo_mass_functions");
    let linear = planck18();
    let sigma = evaluate(&reference, |mass, z| linear.sigma(mass, z));
    Agreement::of("sigma, refined", &sigma, reference.column("sigma_refined")).require_max(SIGMA_TOLERANCE);
    let slope = evaluate(&reference, |mass, _| linear.dlnsigma_dlnm(mass));
    Agreement::of("dlnsigma/dlnM, refined", &slope, reference.column("dlnsigma_dlnm_refined"))
        .require_max(SLOPE_TOLERANCE);
    let growth = evaluate(&reference, |_, z| linear.growth(z));
    Agreement::of("growth, refined", &growth, reference.column("growth_refined"))
        .require_max(GROWTH_TOLERANCE);
}

#[test]
fn the_default_tables_of_colossus_are_what_limits_sigma() {
    let reference = Reference::load("halo_mass_functions");
    let linear = planck18();
    let sigma = evaluate(&reference, |mass, z| linear.sigma(mass, z));
    let ours = Agreement::of("sigma, default", &sigma, reference.column("sigma_default"));
    let theirs = Agreement::of(
        "sigma, refined against default",
        reference.column("sigma_refined"),
        reference.column("sigma_default"),
    );
    assert!((ours.max - theirs.max).abs() < SIGMA_TOLERANCE, "{ours:?} {theirs:?}");
}

#[test]
fn tinker08_agrees_for_200c() {
    let reference = Reference::load("halo_mass_functions");
    let linear = planck18();
    let relation = tinker08(&linear, MassDefinition::Critical(200.0));
    let dn_dlnm = evaluate(&reference, |mass, z| relation.dn_dlnm_per_cmpc3(&linear, mass, z));
    let refined = Agreement::of("tinker08, refined", &dn_dlnm, reference.column("tinker08_200c_refined"));
    assert!(refined.q50 < MASS_FUNCTION_Q50_TOLERANCE && refined.q99 < MASS_FUNCTION_Q99_TOLERANCE);

    // Against colossus as installed the tail is that of its own tables, and no more.
    let default = Agreement::of("tinker08, default", &dn_dlnm, reference.column("tinker08_200c_default"));
    assert!(default.q50 < MASS_FUNCTION_Q50_TOLERANCE);
    let tables = Agreement::of(
        "tinker08, refined against default",
        reference.column("tinker08_200c_refined"),
        reference.column("tinker08_200c_default"),
    );
    assert!(default.q99 < tables.q99 + MASS_FUNCTION_Q99_TOLERANCE);
}

#[test]
fn tinker08_agrees_closely_at_the_overdensity_colossus_rounds_to() {
    let reference = Reference::load("halo_mass_functions");
    let linear = planck18();
    let rows = reference.column("mass_msun").iter().zip(reference.column("z"));
    let dn_dlnm: Vec<f64> = rows
        .zip(reference.column("delta_m_rounded"))
        .map(|((&mass, &z), &delta_m)| {
            tinker08(&linear, MassDefinition::Mean(delta_m)).dn_dlnm_per_cmpc3(&linear, mass, z)
        })
        .collect();
    Agreement::of("tinker08 at rounded delta_m", &dn_dlnm, reference.column("tinker08_200c_refined"))
        .require_max(SAME_OVERDENSITY_TOLERANCE);
}

#[test]
fn friends_of_friends_mass_functions_agree() {
    let reference = Reference::load("halo_mass_functions");
    let linear = planck18();
    for (model, column) in [
        (MassFunctionModel::Sheth99, "sheth99_fof_refined"),
        (MassFunctionModel::Press74, "press74_fof_refined"),
    ] {
        let relation = model.build(MassDefinition::FriendsOfFriends, linear.background(), 2.0).unwrap();
        let dn_dlnm = evaluate(&reference, |mass, z| relation.dn_dlnm_per_cmpc3(&linear, mass, z));
        Agreement::of(column, &dn_dlnm, reference.column(column)).require_max(FOF_TOLERANCE);
    }
}

#[test]
fn the_number_density_is_that_of_the_paper_in_the_papers_units() {
    // ∫ dn/dlnM dlnM at z = 0.5, 200c, 1e8–1e15 Msun/h.
    let number = |linear: &LinearTheory| {
        let relation = tinker08(linear, MassDefinition::Critical(200.0));
        let (low, high) = ((1e8 / linear.unit_h()).ln(), (1e15 / linear.unit_h()).ln());
        integrate(low, high, 40, |ln_mass| relation.dn_dlnm_per_cmpc3(linear, ln_mass.exp(), 0.5))
    };
    let one_h = number(&planck18());
    let two_h = number(&planck18().in_hubble_units_of(67.4).unwrap());
    println!("n = {one_h:.5} per Mpc^3 with h = 0.6766, {two_h:.5} with the units' h = 0.674");
    assert!((one_h - 5.6622).abs() < 1e-3, "{one_h}");
    assert!((two_h - 5.597).abs() < 2e-3, "{two_h}");
}

#[test]
fn diemer19_agrees_with_colossus_and_with_the_published_equation() {
    let reference = Reference::load("halo_concentrations");
    let linear = planck18();
    for (model, name) in
        [(ConcentrationModel::Diemer19, "median"), (ConcentrationModel::Diemer19Mean, "mean")]
    {
        let relation = model.build(MassDefinition::Critical(200.0)).unwrap();
        let c = evaluate(&reference, |mass, z| relation.concentration(&linear, mass, z));
        for (kind, tolerance) in
            [("direct", CONCENTRATION_DIRECT_TOLERANCE), ("default", CONCENTRATION_DEFAULT_TOLERANCE)]
        {
            let column = format!("diemer19_{name}_{kind}");
            Agreement::of(&column, &c, reference.column(&column)).require_max(tolerance);
        }
    }
}

#[test]
fn diemer15_agrees_with_colossus() {
    let reference = Reference::load("halo_concentrations");
    let linear = planck18();
    let relation = ConcentrationModel::Diemer15.build(MassDefinition::Critical(200.0)).unwrap();
    let c = evaluate(&reference, |mass, z| relation.concentration(&linear, mass, z));
    for (column, tolerance) in [
        ("diemer15_refined", CONCENTRATION_REFINED_TOLERANCE),
        ("diemer15_default", CONCENTRATION_DEFAULT_TOLERANCE),
    ] {
        Agreement::of(column, &c, reference.column(column)).require_max(tolerance);
    }
}

#[test]
fn duffy08_agrees_in_all_three_definitions() {
    let reference = Reference::load("halo_concentrations");
    let linear = planck18();
    for definition in ["200c", "200m", "vir"] {
        let relation = ConcentrationModel::Duffy08.build(definition.parse().unwrap()).unwrap();
        let c = evaluate(&reference, |mass, z| relation.concentration(&linear, mass, z));
        let column = format!("duffy08_{definition}");
        Agreement::of(&column, &c, reference.column(&column)).require_max(POWER_LAW_TOLERANCE);
    }
}
