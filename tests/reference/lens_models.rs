//! Lens models in lenstronomy's form against lenstronomy: β, Hessian, Fermat potential and delay of 46 models.

use std::collections::BTreeMap;

use crate::differences::Differences;
use crate::oracle_table::REQUIRED_HEADERS;
use haloray::cosmology::Background;
use haloray::io::{LensModelFile, read_lens_model};
use haloray::mapping::Order;
use serde_json::Value;

/// β in arcsec: lenstronomy's SIE has a core of 1e-10″.
const BETA_TOLERANCE_ARCSEC: f64 = 1e-9;
/// Fermat potential in arcsec²: the same core.
const FERMAT_TOLERANCE_ARCSEC2: f64 = 1e-9;
/// Delays over the largest of the model: lenstronomy's constants are 5e-10 off.
const DELAY_TOLERANCE: f64 = 1e-8;
/// f against lenstronomy's where that is analytic.
const HESSIAN_TOLERANCE: f64 = 1e-9;
/// f against Richardson differences of lenstronomy's deflection, step 2e-3″.
const DIFFERENCES_TOLERANCE: f64 = 1e-8;
/// The same for lens planes.
const PLANES_DIFFERENCES_TOLERANCE: f64 = 1e-8;
/// Our Jacobian against Richardson differences of our β, step 2e-3″.
const OWN_DIFFERENCES_TOLERANCE: f64 = 1e-9;

/// Sightlines and lenses whose Hessian lenstronomy computes analytically (its SIE takes forward differences of 1e-6).
const ANALYTIC_SIGHTS: [&str; 3] = ["no LOS", "LOS", "LOS_MINIMAL"];
const ANALYTIC_LENSES: [&str; 6] = ["EPL", "NFW", "POINT_MASS", "SHEAR", "CONVERGENCE", "FLEXION"];

/// One model of the reference with what haloray makes of it.
struct Case {
    names: Vec<String>,
    entry: Value,
    lens: LensModelFile,
    theta: Vec<[f64; 2]>,
}

impl Case {
    fn new(entry: &Value) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("model.json");
        std::fs::write(&path, entry["model"].to_string()).unwrap();
        let lens = read_lens_model(&path, &Background::paper()).unwrap();
        assert!(lens.warnings.is_empty(), "{:?}", lens.warnings);
        let names = entry["model"]["lens_model_list"].as_array().unwrap();
        let names = names.iter().map(|name| name.as_str().unwrap().to_owned()).collect();
        let theta = rows(&entry["theta"]).into_iter().map(|row| [row[0], row[1]]).collect();
        Self { names, entry: entry.clone(), lens, theta }
    }

    fn sight(&self) -> &str {
        self.names.iter().find(|name| name.starts_with("LOS")).map_or("no LOS", |name| name)
    }

    fn lenses(&self) -> impl Iterator<Item = &str> {
        self.names.iter().map(String::as_str).filter(|name| !name.starts_with("LOS"))
    }

    fn main_lenses(&self) -> String {
        let lenses = self.lenses().filter(|name| !["SHEAR", "CONVERGENCE", "FLEXION"].contains(name));
        lenses.collect::<Vec<_>>().join(" + ")
    }

    fn is_analytic_in_lenstronomy(&self) -> bool {
        ANALYTIC_SIGHTS.contains(&self.sight()) && self.lenses().all(|name| ANALYTIC_LENSES.contains(&name))
    }

    fn beta(&self, theta: &[[f64; 2]]) -> Vec<[f64; 2]> {
        self.lens.lens.mapping().map(theta, Order::Position).beta_arcsec
    }

    /// f_ij = δ_ij − ∂β_i/∂θ_j.
    fn hessian(&self) -> Vec<[f64; 4]> {
        let rays = self.lens.lens.mapping().map(&self.theta, Order::Jacobian);
        rays.jacobian.iter().map(|a| [1.0 - a[0], -a[1], -a[2], 1.0 - a[3]]).collect()
    }

    fn beta_differences(&self) -> Vec<f64> {
        self.beta(&self.theta)
            .iter()
            .zip(rows(&self.entry["beta"]))
            .map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]))
            .collect()
    }

    fn hessian_differences(&self, key: &str) -> Vec<f64> {
        let pairs = self.hessian().into_iter().zip(rows(&self.entry[key]));
        pairs.flat_map(|(a, b)| (0..4).map(move |i| a[i] - b[i]).collect::<Vec<_>>()).collect()
    }

    /// Delays over the largest of the model.
    fn delay_differences(&self) -> Vec<f64> {
        let expected = numbers(&self.entry["arrival_days"]);
        let largest = expected.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let delays = self.lens.lens.mapping().delay_days(&self.theta);
        delays.iter().zip(expected).map(|(a, b)| (a - b) / largest).collect()
    }

    fn own_differences(&self) -> Vec<f64> {
        let mut all = Vec::new();
        for (&[x, y], f) in self.theta.iter().zip(self.hessian()) {
            for (axis, direction) in [[1.0, 0.0], [0.0, 1.0]].into_iter().enumerate() {
                let central = |h: f64| {
                    let at = |h: f64| [x + h * direction[0], y + h * direction[1]];
                    let beta = self.beta(&[at(h), at(-h)]);
                    [0, 1].map(|i| (beta[0][i] - beta[1][i]) / (2.0 * h))
                };
                let [d1, d2, d4] = [2e-3, 1e-3, 5e-4].map(central);
                for i in 0..2 {
                    let (r1, r2) = ((4.0 * d2[i] - d1[i]) / 3.0, (4.0 * d4[i] - d2[i]) / 3.0);
                    let own = if i == axis { 1.0 } else { 0.0 };
                    all.push(own - f[2 * i + axis] - (16.0 * r2 - r1) / 15.0);
                }
            }
        }
        all
    }
}

fn numbers(values: &Value) -> Vec<f64> {
    values.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

fn rows(values: &Value) -> Vec<Vec<f64>> {
    values.as_array().unwrap().iter().map(numbers).collect()
}

fn cases(key: &str) -> Vec<Case> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/data/reference/lens_models.json");
    let whole: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    for header in REQUIRED_HEADERS {
        assert!(
            whole[header].as_str().is_some_and(|v| !v.trim().is_empty()),
            "{path}: {header} is not stated"
        );
    }
    whole[key].as_array().unwrap().iter().map(Case::new).collect()
}

#[test]
fn every_model_maps_rays_where_lenstronomy_does() {
    let cases = cases("models");
    assert_eq!(cases.len(), 40);
    let all = cases.iter().flat_map(Case::beta_differences);
    Differences::of("β (arcsec)", all).require_max(BETA_TOLERANCE_ARCSEC);
    let others = cases.iter().filter(|case| !case.names.contains(&"SIE".into()));
    Differences::of("β without SIE (arcsec)", others.flat_map(Case::beta_differences));
}

#[test]
fn fermat_potentials_and_delays_agree() {
    let cases = cases("models");
    let fermat = cases.iter().flat_map(|case| {
        let ours = case.lens.lens.fermat_arcsec2(&case.theta).unwrap();
        ours.into_iter().zip(numbers(&case.entry["fermat_arcsec2"])).map(|(a, b)| a - b).collect::<Vec<_>>()
    });
    Differences::of("Fermat potential (arcsec²)", fermat).require_max(FERMAT_TOLERANCE_ARCSEC2);
    Differences::of("delay over the largest", cases.iter().flat_map(Case::delay_differences))
        .require_max(DELAY_TOLERANCE);
}

#[test]
fn jacobians_are_the_derivatives_of_beta() {
    for key in ["models", "multi_plane_models"] {
        let own = cases(key).iter().flat_map(Case::own_differences).collect::<Vec<_>>();
        Differences::of(&format!("{key}: A against differences of β"), own)
            .require_max(OWN_DIFFERENCES_TOLERANCE);
    }
}

#[test]
fn hessians_agree_where_lenstronomy_is_analytic() {
    let cases = cases("models");
    let mut groups: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for case in &cases {
        let label = format!("f, {}, {}", case.sight(), case.main_lenses());
        groups.entry(label).or_default().extend(case.hessian_differences("f"));
    }
    for (label, all) in groups {
        Differences::of(&label, all);
    }
    let analytic: Vec<&Case> = cases.iter().filter(|case| case.is_analytic_in_lenstronomy()).collect();
    assert!(analytic.len() >= 9);
    let all = analytic.iter().flat_map(|case| case.hessian_differences("f"));
    Differences::of("f where lenstronomy is analytic", all).require_max(HESSIAN_TOLERANCE);
    let all = cases.iter().flat_map(|case| case.hessian_differences("f_differences"));
    Differences::of("f against differences of lenstronomy's α", all).require_max(DIFFERENCES_TOLERANCE);
}

#[test]
fn lens_planes_agree() {
    let cases = cases("multi_plane_models");
    assert_eq!(cases.len(), 6);
    Differences::of("planes: β (arcsec)", cases.iter().flat_map(Case::beta_differences))
        .require_max(BETA_TOLERANCE_ARCSEC);
    Differences::of("planes: delay over the largest", cases.iter().flat_map(Case::delay_differences))
        .require_max(DELAY_TOLERANCE);
    Differences::of("planes: f", cases.iter().flat_map(|case| case.hessian_differences("f")));
    let all = cases.iter().flat_map(|case| case.hessian_differences("f_differences"));
    Differences::of("planes: f against differences of lenstronomy's α", all)
        .require_max(PLANES_DIFFERENCES_TOLERANCE);
    assert!(cases.iter().all(|case| case.lens.lens.fermat_arcsec2(&case.theta).is_none()));
}
