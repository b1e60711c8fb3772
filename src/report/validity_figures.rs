//! The figures of the study of validity.

use crate::error::Result;
use crate::io::Staging;
use crate::pipeline::{
    DEFINITIONS, FitGroup, FitPair, Mock, NOTICED_EXCESS, PREFERRED_LOG_ODDS, SeenHaloes, Share,
    ValidityPlan, ValiditySightline,
};
use crate::plot::figures::{
    CoverageView, ExcessView, FailingCurve, FittedPoints, coverage, delay_ratios, excess, failing,
    fitted_shears, varying_haloes,
};

use super::staged::stage_figure;

/// Figures by name with what they show.
const FIGURES: [(&str, &str); 6] = [
    ("fitted", "fitted γ_LOS against its definitions"),
    ("coverage", "how many fits lie within how many σ of each definition"),
    ("excess", "χ² above that of the tidal twins against Δ_tot and the residual of the nearest tidal model"),
    ("failing", "how many sightlines fail when haloes up to which Δ_h are seen"),
    ("h0", "H0 that delays give, over the true one"),
    ("varying_haloes", "the halo whose shear changes most, by whether the tidal model fails"),
];

/// Stages the figures of the base case, first start; their names and what they show.
///
/// # Errors
/// A failed write.
pub fn validity_figures(
    plan: &ValidityPlan,
    rows: &[ValiditySightline],
    staging: &Staging,
) -> Result<Vec<(&'static str, &'static str)>> {
    let groups = FitGroup::all(plan, rows);
    let start = plan.starts.first().copied();
    let base: Vec<&FitGroup> =
        groups.iter().filter(|group| group.case == 0 && Some(group.start) == start).collect();
    let of = |mock: Mock, model: usize| -> Vec<&FitGroup> {
        base.iter().filter(|group| group.mock == mock && group.model == model).copied().collect()
    };
    let (tidal, twins) = (of(Mock::Haloes, 0), of(Mock::Tidal, 0));
    let draw = |name: &str| match name {
        "fitted" => fitted_shears(&fitted(plan, &tidal)),
        "coverage" => coverage(&covered(plan, &tidal, &twins)),
        "excess" => excess(&excesses(plan, &tidal)),
        "failing" => failing(&failing_curves(plan, &tidal, &of(Mock::Haloes, 1))),
        "h0" => delay_ratios(&ratios(plan, &tidal)),
        _ => varying_haloes(haloes(plan, &tidal)),
    };
    let is_there = |(name, _): &(&str, &str)| match *name {
        "h0" => plan.has_delays,
        // A line between one limit and all haloes would say nothing.
        "failing" => plan.views.len() > 2,
        _ => true,
    };
    let shown: Vec<(&str, &str)> = FIGURES.into_iter().filter(is_there).collect();
    for (name, _) in &shown {
        stage_figure(staging, name, || Ok(Some(draw(name))))?;
    }
    Ok(shown)
}

/// Of the first view and of the one at the configured threshold: axis, ring and the nearest tidal model.
fn fitted(plan: &ValidityPlan, groups: &[&FitGroup]) -> Vec<FittedPoints> {
    let limit = plan.cases[0].config.diagnostics.delta_threshold;
    let shown = |group: &&&FitGroup| {
        let view = plan.views[group.view];
        group.view == 0 || view.below == Some(limit)
    };
    let of = |group: &&FitGroup| {
        [0, 1, 3].map(|i| {
            let point = |pair: &FitPair, c: usize| {
                let sigma = pair.fit.covariance[2 * c].sqrt();
                let fitted = pair.fit.shear[c];
                [pair.image.by_definition[i][c], fitted, fitted - sigma, fitted + sigma]
            };
            let of = |is_good: bool| {
                let pairs = group.done().filter(move |pair| pair.is_good() == is_good);
                pairs.flat_map(|pair| [0, 1].map(|c| point(pair, c))).collect()
            };
            FittedPoints {
                definition: DEFINITIONS[i].replace('_', " "),
                view: seen(plan, group),
                good: of(true),
                misfits: of(false),
            }
        })
    };
    groups.iter().filter(shown).flat_map(of).collect()
}

fn covered(plan: &ValidityPlan, groups: &[&FitGroup], twins: &[&FitGroup]) -> Vec<CoverageView> {
    let of = |(group, twin): (&&FitGroup, &&FitGroup)| {
        let sigmas =
            |group: &FitGroup, i: usize| group.done().map(|pair| pair.deviation(i).sigmas()).collect();
        let own = DEFINITIONS.iter().enumerate().map(|(i, name)| (name.replace('_', " "), sigmas(group, i)));
        // Of a twin all definitions are one.
        let null = ("tidal twins".to_owned(), sigmas(twin, 3));
        CoverageView { view: seen(plan, group), sets: own.chain([null]).collect() }
    };
    groups.iter().zip(twins).map(of).collect()
}

fn excesses(plan: &ValidityPlan, groups: &[&FitGroup]) -> Vec<ExcessView> {
    let of = |group: &&FitGroup| {
        let points =
            |of: fn(&FitPair) -> f64| group.done().map(|pair| [of(pair), pair.chi2_excess()]).collect();
        ExcessView {
            view: seen(plan, group),
            by: [
                points(|pair| pair.view.delta_tot[0]),
                points(|pair| pair.view.delta_tot[1]),
                points(|pair| pair.image.residual_arcsec[0]),
            ],
        }
    };
    groups.iter().map(of).collect()
}

fn failing_curves(plan: &ValidityPlan, tidal: &[&FitGroup], second: &[&FitGroup]) -> Vec<FailingCurve> {
    let curve = |name: String, groups: &[&FitGroup], fails: &dyn Fn(&FitPair) -> bool| FailingCurve {
        name,
        points: groups
            .iter()
            .map(|group| {
                let share = Share::of(group.done().map(fails));
                (plan.views[group.view].below, [share.part, share.error])
            })
            .collect(),
    };
    let (first, other) = (&plan.models[0], plan.models.get(1));
    let own = [
        curve(format!("{first}: p < 0.001"), tidal, &|pair| !pair.is_good()),
        curve(format!("{first}: χ² above the twin's by {NOTICED_EXCESS}"), tidal, &|pair| {
            pair.chi2_excess() > NOTICED_EXCESS
        }),
    ];
    let others = other.into_iter().flat_map(|other| {
        [
            curve(format!("{other}: p < 0.001"), second, &|pair| !pair.is_good()),
            curve(format!("{other} preferred by evidence"), second, &|pair| {
                pair.log_odds() > PREFERRED_LOG_ODDS
            }),
        ]
    });
    own.into_iter().chain(others).collect()
}

/// (view, tensors of the axis, of the ring, best fit).
fn ratios(plan: &ValidityPlan, groups: &[&FitGroup]) -> Vec<(String, [Vec<f64>; 3])> {
    let of = |group: &&FitGroup| {
        let values = |of: fn(&FitPair) -> f64| group.done().map(of).collect();
        let sets = [
            values(|pair| pair.image.h0_ratio[0]),
            values(|pair| pair.image.h0_ratio[1]),
            values(|pair| pair.fit.h0_ratio),
        ];
        (seen(plan, group), sets)
    };
    groups.iter().map(of).collect()
}

/// (z, M200c) of the halo whose shear changes most where the first model describes the image of all haloes, and where not.
fn haloes(plan: &ValidityPlan, groups: &[&FitGroup]) -> [Vec<[f64; 2]>; 2] {
    let all = groups.iter().find(|group| plan.views[group.view] == SeenHaloes::ALL);
    let of = |is_noticed: bool| {
        let pairs = all.iter().flat_map(|group| group.done());
        let pairs = pairs.filter(move |pair| (pair.chi2_excess() > NOTICED_EXCESS) == is_noticed);
        pairs.filter_map(|pair| pair.row.halo).map(|halo| [halo.z, halo.m200c_msun]).collect()
    };
    [of(false), of(true)]
}

/// Which haloes, in the markup of labels.
fn seen(plan: &ValidityPlan, group: &FitGroup) -> String {
    plan.views[group.view].words().replace("Δ_h", "Δ_{h}")
}
