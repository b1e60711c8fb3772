//! The columns of an ensemble: names and units as in `summary.json` of a run, each with what it is in words.

use nalgebra::Complex;

use super::plan::{Level, Plan};
use crate::config::Config;
use crate::diagnostics::TidalMaps;
use crate::io::{SightlineColumn, SightlineTable, StackSpec, TIDAL_GROUP};
use crate::pipeline::{FittedShear, HaloCounts, LosShears, Quantities, SightScalars};

/// A column without its values.
#[derive(Debug, Clone, PartialEq)]
pub struct EnsembleColumn {
    /// Name.
    pub name: String,
    /// Unit; empty for pure numbers.
    pub unit: &'static str,
    /// What it is, in words.
    pub description: String,
}

/// Everything that is known of a sightline seen through all haloes, by name.
pub(super) fn numbers_of(
    counts: &HaloCounts,
    scalars: &SightScalars,
    others: Option<&LosShears>,
    fit: Option<&FittedShear>,
) -> Quantities {
    let lists = [
        counts.quantities(),
        scalars.quantities(others),
        scalars.quantities_beside(),
        fit.map_or(Quantities(Vec::new()), FittedShear::quantities),
    ];
    Quantities(lists.into_iter().flat_map(|list| list.0).collect())
}

/// γ_LOS averaged over the discs of a plan, by the names of their radii.
pub(super) fn disc_shears(radii_arcsec: &[f64], shears: &[Complex<f64>]) -> Quantities {
    let each = radii_arcsec.iter().zip(shears).flat_map(|(radius, shear)| {
        [("gamma1", shear.re), ("gamma2", shear.im)]
            .map(|(component, value)| (format!("{component}_{IN_DISC}{radius}"), "", value))
    });
    Quantities(each.collect())
}

/// What stands between a component and the radius of a disc.
const IN_DISC: &str = "los_disc_";
/// The first component up to the radius of a disc.
pub(super) const GAMMA1_IN_DISC: &str = "gamma1_los_disc_";

/// Radii of the discs over which a table has γ_LOS, arcsec.
pub fn disc_radii(table: &SightlineTable) -> Vec<f64> {
    let radius = |column: &SightlineColumn| column.name.strip_prefix(GAMMA1_IN_DISC)?.parse().ok();
    table.all_haloes.iter().filter_map(radius).collect()
}

fn described(quantities: &Quantities) -> Vec<EnsembleColumn> {
    let column = |(name, unit, _): &(String, &'static str, f64)| EnsembleColumn {
        name: name.clone(),
        unit,
        description: description(name),
    };
    quantities.0.iter().map(column).collect()
}

/// Columns of the main group, through all haloes.
pub fn scalar_columns(plan: &Plan) -> Vec<EnsembleColumn> {
    let nothing = (plan.level == Level::Fits).then(FittedShear::nothing);
    let others = plan.level.has_images().then(LosShears::nothing);
    let numbers =
        numbers_of(&HaloCounts::default(), &SightScalars::nothing(), others.as_ref(), nothing.as_ref());
    let mut own = vec![("failed".to_string(), "", 0.0)];
    if !plan.lenses.is_empty() {
        own.extend(["lens", "z_lens", "z_source"].map(|name| (name.to_string(), "", 0.0)));
        own.push(("einstein_radius_arcsec".into(), "arcsec", 0.0));
    }
    own.extend(numbers.0);
    let nothing = vec![Complex::default(); plan.smoothing_arcsec.len()];
    own.extend(disc_shears(&plan.smoothing_arcsec, &nothing).0);
    described(&Quantities(own))
}

/// Columns of the group of the haloes in the tidal regime; none where no images are made.
pub fn tidal_columns(plan: &Plan) -> Vec<EnsembleColumn> {
    if !plan.level.has_images() {
        return Vec::new();
    }
    described(&SightScalars::nothing().quantities(Some(&LosShears::nothing())))
}

/// The maps and images of a level.
pub fn stacks_of(config: &Config, level: Level) -> Vec<StackSpec> {
    let (maps, pixels) = (config.maps, config.image.pixels);
    match level {
        Level::Scalars => Vec::new(),
        Level::Maps => {
            let of = |(name, unit, description): (&str, &'static str, &str)| StackSpec {
                group: "maps",
                name: name.into(),
                unit,
                description: format!("{description}, observer to source, main lens excluded"),
                shape: [maps.points; 2],
                step_arcsec: maps.step_arcsec(),
            };
            TidalMaps::NAMES.map(of).into()
        }
        Level::Images | Level::Fits => {
            let views = [("all_haloes", "all haloes"), (TIDAL_GROUP, "the haloes in the tidal regime")];
            let kinds = [("", "with noise"), ("_noise_free", "before noise")];
            let of = |(view, seen): (&str, &str), (suffix, noise): (&str, &str)| StackSpec {
                group: "images",
                name: format!("{view}{suffix}"),
                unit: "electron/s",
                description: format!("image through {seen}, {noise}"),
                shape: [pixels; 2],
                step_arcsec: config.instrument.pixel_scale_arcsec,
            };
            views.iter().flat_map(|&view| kinds.map(|kind| of(view, kind))).collect()
        }
    }
}

/// What a column of that name holds.
fn description(name: &str) -> String {
    let plain = match name {
        "failed" => "1 where the sightline could not be computed; its reason is in /failures",
        "lens" => "row of the lens in /lenses, from 0",
        "z_lens" => "redshift of the lens",
        "z_source" => "redshift of the source",
        "einstein_radius_arcsec" => "Einstein radius of the lens",
        "number_of_haloes" => "haloes on the line of sight",
        "number_in_lens_plane" => {
            "of these, haloes at the redshift of the lens, which are in none of the tensors"
        }
        "number_excluded_by_kappa" => "haloes left out because of haloes.max_kappa",
        "number_beyond_tidal" => "haloes with Δ_h of at least diagnostics.delta_threshold",
        "largest_kappa_h" => "largest convergence of a single halo on the axis",
        "number_above_kappa_warning" => "haloes with κ_h above diagnostics.kappa_warning",
        "kappa_of_sheets" => "convergence that the sheets take away, reduced to the source",
        "delta_tot" => "Δ of the total shear at two points a scale diagnostics.theta_e_arcsec off the axis",
        "delta_tot_ring" => "Δ of the total shear along the ring of that scale",
        "delta_tot_disc" => "Δ of the total shear averaged over the disc of that scale",
        "residual_best_tidal_arcsec" => "weighted rms that the nearest minimal tidal model leaves of β",
        "residual_best_flexion_arcsec" => "weighted rms that the nearest minimal flexion model leaves of β",
        "gamma1_los_fit" => "posterior mean of the fitted γ_LOS, first component",
        "gamma2_los_fit" => "posterior mean of the fitted γ_LOS, second component",
        "covariance_11" | "covariance_12" | "covariance_22" => "posterior covariance of the fitted γ_LOS",
        "chi2_reduced" => "χ² per degree of freedom of the fit",
        "converged" => "1 where the posterior converged",
        "missed_by" => "by how much a climb from the truth ends higher in ln p; 0 where it does not",
        _ => "",
    };
    if !plain.is_empty() {
        return plain.into();
    }
    let of = |prefix: &str| name.strip_prefix(prefix).map(|rest| rest.trim_end_matches("_per_arcsec"));
    const QUANTITIES: [(&str, &str); 8] = [
        ("kappa_", "convergence"),
        ("gamma1_", "shear, first component,"),
        ("gamma2_", "shear, second component,"),
        ("omega_", "rotation"),
        ("F1_", "F-type flexion, first component,"),
        ("F2_", "F-type flexion, second component,"),
        ("G1_", "G-type flexion, first component,"),
        ("G2_", "G-type flexion, second component,"),
    ];
    const PLACES: [(&str, &str); 23] = [
        ("od", "from observer to lens on the axis"),
        ("os", "from observer to source on the axis"),
        ("ds", "from lens to source on the axis ray"),
        ("los", "of A_LOS = A_odᵀ A_ds⁻¹ A_os on the axis"),
        ("los_linear", "of the line of sight to first order, od + os − ds"),
        ("od_ring", "from observer to lens, averaged along the beam of the Einstein ring"),
        ("os_beam", "from observer to source, averaged along the beam of the Einstein ring"),
        ("ds_beam", "from lens to source, averaged along the beam of the Einstein ring"),
        ("los_ring", "of A_LOS of the averages along the beam of the Einstein ring"),
        ("od_light", "from observer to lens, averaged over the image's light"),
        ("los_light", "of A_LOS of the averages over the image's light"),
        ("od_best_tidal", "od of the minimal tidal model nearest to the traced rays"),
        ("los_best_tidal", "of A_LOS of the minimal tidal model nearest to the traced rays"),
        ("od_best_flexion", "od of the minimal flexion model nearest to the traced rays"),
        ("los_best_flexion", "of A_LOS of the minimal flexion model nearest to the traced rays"),
        ("os_ring", "from observer to source, averaged over the ring of diagnostics.theta_e_arcsec"),
        ("os_disc", "from observer to source, averaged over the disc of diagnostics.theta_e_arcsec"),
        ("1ds", "from lens to source, of the deflection squared"),
        ("2ds", "from lens to source, of position times deflection"),
        ("lens_centre", ""),
        ("source_centre", ""),
        ("axis_ray_at_lens", ""),
        ("axis_ray_at_source", ""),
    ];
    let place = |rest: &str| PLACES.iter().find(|(name, _)| *name == rest).map_or("", |(_, place)| place);
    for (prefix, quantity) in QUANTITIES {
        if let Some(rest) = of(prefix).map(place).filter(|place| !place.is_empty()) {
            return format!("{quantity} {rest}");
        }
        if let Some(radius) = of(prefix).and_then(|rest| rest.strip_prefix(IN_DISC)) {
            let disc = format!("averaged over a disc of {radius} arcsec about the axis ray");
            return format!("{quantity} of the line of sight to first order, od + os − ds, {disc}");
        }
    }
    for (prefix, what) in [
        ("lens_centre_", "centre of the lens, where the haloes make it appear on the axis"),
        ("source_centre_", "centre of the source, where the haloes alone make it appear on the axis"),
        ("axis_ray_at_lens_", "where the axis ray meets the lens plane"),
        ("axis_ray_at_source_", "where the axis ray meets the source plane"),
    ] {
        if let Some(rest) = name.strip_prefix(prefix) {
            return format!("{what}, {}", if rest.starts_with('x') { "to the right" } else { "upwards" });
        }
    }
    String::new()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Preset;
    use crate::io::TabledLens;

    #[test]
    fn every_column_of_every_level_is_described_once() {
        let config = Preset::Paper.config().unwrap();
        let lens = TabledLens { name: "a".into(), z_lens: 0.5, z_source: 1.5, einstein_radius_arcsec: None };
        let mut counts = Vec::new();
        for (level, _) in Level::NAMES {
            let plan = Plan {
                config: config.clone(),
                lenses: vec![lens.clone()],
                level,
                model: "tidal-minimal".into(),
                smoothing_arcsec: vec![10.0, 7.5],
                first: 0,
                number: 1,
            };
            let (all, tidal) = (scalar_columns(&plan), tidal_columns(&plan));
            for column in all.iter().chain(&tidal) {
                assert!(!column.description.is_empty(), "{}", column.name);
                assert_eq!(column.name.ends_with("_arcsec"), !column.unit.is_empty(), "{}", column.name);
            }
            let mut names: Vec<&str> = all.iter().map(|column| column.name.as_str()).collect();
            names.sort_unstable();
            assert!(names.windows(2).all(|pair| pair[0] != pair[1]), "{names:?}");
            counts.push([all.len(), tidal.len(), stacks_of(&config, level).len()]);
        }
        assert_eq!(counts[0][1..], [0, 0]);
        assert!(counts[0] < counts[1] && counts[1] < counts[2] && counts[2] < counts[3], "{counts:?}");
    }
}
