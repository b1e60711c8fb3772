//! The table and the result of the study of validity.

use super::number_text::{decimals_text, number_text};
use super::staged::markdown_table;
use crate::error::Result;
use crate::io::{Column, Table};
use crate::pipeline::{
    DEFINITIONS, FitGroup, FitPair, GroupSummary, Mock, Share, ValidityPlan, ValiditySightline,
    ValiditySummary, VaryingHalo,
};

/// One row a fit: by case, view, image, model and start, in each the sightlines in their order.
///
/// # Errors
/// None that can be.
pub fn validity_table(plan: &ValidityPlan, rows: &[ValiditySightline]) -> Result<Table> {
    let groups = FitGroup::all(plan, rows);
    let fits: Vec<(&FitGroup, &FitPair)> =
        groups.iter().flat_map(|group| group.fits.iter().map(move |pair| (group, pair))).collect();
    let text = |name: &str, of: &dyn Fn(&FitGroup, &FitPair) -> String| {
        Column::text(name, fits.iter().map(|(group, pair)| of(group, pair)).collect())
    };
    let number = |name: &str, unit: Option<&str>, of: &dyn Fn(&FitPair) -> f64| {
        Column::f64(name, unit, fits.iter().map(|(_, pair)| of(pair)).collect())
    };
    let halo = |name: &str, unit: Option<&str>, of: &dyn Fn(&VaryingHalo) -> f64| {
        number(name, unit, &|pair| pair.row.halo.as_ref().map_or(f64::NAN, of))
    };
    let arcsec = Some("arcsec");
    let mut columns = vec![
        number("sightline", None, &|pair| pair.row.sightline as f64),
        text("case", &|group, _| plan.cases[group.case].name.clone()),
        text("haloes", &|group, _| plan.views[group.view].to_string()),
        text("mock", &|group, _| group.mock.name().into()),
        text("model", &|group, _| plan.models[group.model].clone()),
        text("start", &|group, _| group.start.to_string()),
        number("number_of_haloes", None, &|pair| pair.view.number_of_haloes as f64),
        number("delta_tot", None, &|pair| pair.view.delta_tot[0]),
        number("delta_tot_ring", None, &|pair| pair.view.delta_tot[1]),
    ];
    for (i, definition) in DEFINITIONS.iter().enumerate() {
        for (c, component) in ["gamma1", "gamma2"].iter().enumerate() {
            let name = format!("{component}_los_{definition}");
            columns.push(number(&name, None, &|pair| pair.image.by_definition[i][c]));
        }
    }
    columns.extend([
        number("residual_best_tidal_arcsec", arcsec, &|pair| pair.image.residual_arcsec[0]),
        number("residual_best_flexion_arcsec", arcsec, &|pair| pair.image.residual_arcsec[1]),
        number("gamma1_los_fit", None, &|pair| pair.fit.shear[0]),
        number("gamma2_los_fit", None, &|pair| pair.fit.shear[1]),
        number("covariance_11", None, &|pair| pair.fit.covariance[0]),
        number("covariance_12", None, &|pair| pair.fit.covariance[1]),
        number("covariance_22", None, &|pair| pair.fit.covariance[2]),
        number("chi2", None, &|pair| pair.fit.chi2),
        number("degrees_of_freedom", None, &|pair| pair.fit.degrees_of_freedom),
        number("p_value", None, &|pair| pair.fit.p_value),
        number("chi2_excess", None, &|pair| pair.chi2_excess()),
        number("log_posterior", None, &|pair| pair.fit.log_posterior),
        number("log_evidence", None, &|pair| pair.fit.log_evidence),
        number("converged", None, &|pair| f64::from(u8::from(pair.fit.is_converged))),
        number("h0_ratio_axis", None, &|pair| pair.image.h0_ratio[0]),
        number("h0_ratio_ring", None, &|pair| pair.image.h0_ratio[1]),
        number("h0_ratio_fit", None, &|pair| pair.fit.h0_ratio),
        halo("halo_m200c_msun", Some("Msun"), &|halo| halo.m200c_msun),
        halo("halo_z", None, &|halo| halo.z),
        halo("halo_distance_arcsec", arcsec, &|halo| halo.distance_arcsec),
        halo("halo_delta", None, &|halo| halo.delta),
        halo("halo_kappa", None, &|halo| halo.kappa),
        halo("halo_shear_change", None, &|halo| halo.shear_change),
        text("failure", &|_, pair| pair.fit.failure.clone()),
    ]);
    let names: Vec<String> = columns.iter().map(|column| column.name.clone()).collect();
    // What a sightline, an image or a fit does not have is no number.
    Ok(Table::new(columns)?.with_gaps_in(names.iter().skip(1).map(String::as_str)))
}

/// What the study finds, in tables.
pub fn validity_result(plan: &ValidityPlan, summary: &ValiditySummary) -> String {
    let failed = |groups: &[GroupSummary]| groups.iter().map(|group| group.failed).sum::<usize>();
    let (fits, of_fits) =
        (summary.groups.iter().map(|group| group.fits).sum::<usize>(), failed(&summary.groups));
    let unconverged: usize = summary.groups.iter().map(|group| group.unconverged).sum();
    let start = plan.starts.first().map(ToString::to_string).unwrap_or_default();
    let mut text = format!(
        "{} sightlines, {} failed; {fits} fits, {of_fits} failed, {unconverged} not converged; estimate {}. Tables are of starts: {start}.\n",
        summary.number_of_sightlines, summary.number_failed, summary.estimate
    );
    for table in [
        shares(plan, summary),
        definitions(plan, summary, false),
        definitions(plan, summary, true),
        starts(plan, summary),
        delays(plan, summary),
        single_haloes(summary),
        cases(plan, summary),
    ] {
        text += "\n";
        text += &table;
    }
    text
}

fn percent(share: Share) -> String {
    match share.of {
        0 => "–".into(),
        _ => format!("{:.1} ± {:.1}%", 100.0 * share.part, 100.0 * share.error),
    }
}

fn with_error([value, error]: [f64; 2], decimals: usize) -> String {
    match (value.is_finite(), error.is_finite()) {
        (true, true) => format!("{} ± {error:.decimals$}", decimals_text(value, decimals)),
        (true, false) => decimals_text(value, decimals),
        _ => "–".into(),
    }
}

fn interval([low, middle, high]: [f64; 3], digits: usize) -> String {
    match middle.is_finite() {
        true => format!(
            "{} [{}, {}]",
            number_text(middle, digits),
            number_text(low, digits),
            number_text(high, digits)
        ),
        false => "–".into(),
    }
}

/// Groups of the base case from the first start.
fn of_base<'a>(
    plan: &'a ValidityPlan,
    summary: &'a ValiditySummary,
) -> impl Iterator<Item = (usize, Mock, &'a GroupSummary)> {
    let models = move |view: usize, mock: Mock| {
        (0..plan.models.len())
            .filter_map(move |model| Some((view, mock, summary.group(plan, (0, view, model), mock)?)))
    };
    (0..plan.views.len()).flat_map(move |view| {
        [Mock::Haloes, Mock::Tidal].into_iter().flat_map(move |mock| models(view, mock))
    })
}

fn seen(plan: &ValidityPlan, view: usize, mock: Mock) -> String {
    let words = plan.views[view].words();
    if mock == Mock::Tidal { format!("twins of {words}") } else { words }
}

fn shares(plan: &ValidityPlan, summary: &ValiditySummary) -> String {
    let head = [
        "seen",
        "model",
        "p < 0.001",
        "χ² above the twin's",
        "by more than 25",
        "preferred by evidence",
        "rank correlation with Δ_tot, ring, residual",
    ];
    let line = |(view, mock, group): (usize, Mock, &GroupSummary)| {
        let is_first = group.model == plan.models[0];
        let correlations = group.excess_correlations.map(|value| format!("{value:.2}")).join(", ");
        let of_twin = |text: String| if mock == Mock::Tidal { "–".into() } else { text };
        vec![
            seen(plan, view, mock),
            group.model.clone(),
            percent(group.misfits),
            of_twin(interval(group.chi2_excess, 3)),
            of_twin(percent(group.noticed)),
            if is_first { "–".into() } else { percent(group.preferred) },
            of_twin(correlations),
        ]
    };
    markdown_table(&head, &of_base(plan, summary).map(line).collect::<Vec<_>>())
}

fn definitions(plan: &ValidityPlan, summary: &ValiditySummary, is_of_good_fits: bool) -> String {
    let which = if is_of_good_fits { "γ_LOS of, fits with p ≥ 0.001" } else { "γ_LOS of, all fits" };
    let head = ["seen", which, "fits", "m", "c₁", "c₂", "scatter beyond errors", "within 68%", "median σ"];
    let first = of_base(plan, summary).filter(|(_, _, group)| group.model == plan.models[0]);
    let mut lines = Vec::new();
    for (view, mock, group) in first {
        // All definitions of a twin are one.
        let names: Vec<&str> = DEFINITIONS
            .iter()
            .copied()
            .filter(|name| mock == Mock::Haloes || *name == "best_tidal")
            .collect();
        for name in names {
            let Some(biases) = group.against(name, is_of_good_fits) else { continue };
            lines.push(vec![
                seen(plan, view, mock),
                name.into(),
                biases.number.to_string(),
                with_error(biases.multiplicative, 3),
                with_error(biases.additive1, 4),
                with_error(biases.additive2, 4),
                with_error(biases.scatter_beyond_errors, 4),
                percent(biases.coverage),
                number_text(biases.median_sigmas, 3),
            ]);
        }
    }
    markdown_table(&head, &lines)
}

/// How many blind starts end below the start from the truth.
fn starts(plan: &ValidityPlan, summary: &ValiditySummary) -> String {
    let head = ["seen", "model", "blind starts below the one from the truth"];
    let line = |(view, mock, group): (usize, Mock, &GroupSummary)| {
        (group.missed.of > 0)
            .then(|| vec![seen(plan, view, mock), group.model.clone(), percent(group.missed)])
    };
    let lines: Vec<Vec<String>> = of_base(plan, summary).filter_map(line).collect();
    if lines.is_empty() { String::new() } else { markdown_table(&head, &lines) }
}

fn delays(plan: &ValidityPlan, summary: &ValiditySummary) -> String {
    if !plan.has_delays {
        return String::new();
    }
    let head =
        ["seen", "H0/true, tensors of the axis", "of the ring", "best fit of", "H0/true", "images followed"];
    let line = |(view, mock, group): (usize, Mock, &GroupSummary)| {
        vec![
            seen(plan, view, mock),
            interval(group.h0_axis, 4),
            interval(group.h0_ring, 4),
            group.model.clone(),
            interval(group.h0_fit, 4),
            percent(group.followed),
        ]
    };
    markdown_table(&head, &of_base(plan, summary).map(line).collect::<Vec<_>>())
}

fn single_haloes(summary: &ValiditySummary) -> String {
    let head = [
        "case",
        "fails through all, not through the tidal ones",
        "sightlines",
        "log₁₀ M200c of the halo",
        "z",
        "distance, arcsec",
        "Δ_h",
    ];
    let lines: Vec<Vec<String>> = summary
        .single_haloes
        .iter()
        .map(|single| {
            vec![
                single.case.clone(),
                single.criterion.clone(),
                percent(single.sightlines),
                interval(single.log10_m200c_msun, 3),
                interval(single.z, 3),
                interval(single.distance_arcsec, 3),
                interval(single.delta, 3),
            ]
        })
        .collect();
    if lines.is_empty() { String::new() } else { markdown_table(&head, &lines) }
}

/// Each case beside the base, first view and model.
fn cases(plan: &ValidityPlan, summary: &ValiditySummary) -> String {
    if plan.cases.len() == 1 {
        return String::new();
    }
    let head = [
        "case",
        "p < 0.001",
        "χ² above the twin's",
        "within 68% of axis",
        "of ring",
        "of best_tidal",
        "m of ring",
        "scatter beyond errors, ring",
    ];
    let line = |case: usize| {
        let group = summary.group(plan, (case, 0, 0), Mock::Haloes)?;
        let of = |name: &str| group.against(name, false);
        let (axis, ring, best) = (of("axis")?, of("ring")?, of("best_tidal")?);
        Some(vec![
            group.case.clone(),
            percent(group.misfits),
            interval(group.chi2_excess, 3),
            percent(axis.coverage),
            percent(ring.coverage),
            percent(best.coverage),
            with_error(ring.multiplicative, 3),
            with_error(ring.scatter_beyond_errors, 4),
        ])
    };
    markdown_table(&head, &(0..plan.cases.len()).filter_map(line).collect::<Vec<_>>())
}
