//! The closing summary that a person reads.

use std::fmt::Write;

use haloray::imaging::PixelSampling;
use haloray::mapping::multiplane::{AccuracyReport, Reference};
use haloray::pipeline::{MatterBudget, Quantities, Simulation, Summary};
use haloray::report::{decimals_text, grouped, number_text, signed_text};

use crate::bars::Bars;

/// Prints counts, tensors, Δ and seconds of a run.
pub fn print(run: &Simulation, name: &str, seconds: &[(String, f64)]) {
    let summary = Summary::of(run);
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = counts(&mut text, run, &summary, name);
    let _ = tensors(&mut text, run, &summary);
    let _ = ending(&mut text, seconds);
    crate::terminal::print(&text);
}

fn counts(text: &mut String, run: &Simulation, summary: &Summary, name: &str) -> std::fmt::Result {
    writeln!(text, "haloray {} · {name} · seed {}\n", env!("CARGO_PKG_VERSION"), summary.seed)?;
    if let (Some(cylinder), Some(kept)) = (summary.expected_number_in_cylinder, summary.expected_number_kept)
    {
        writeln!(
            text,
            "haloes       {} expected in the cylinder, {} of them above the shear cut",
            grouped(cylinder),
            grouped(kept)
        )?;
    }
    if let Some(drawn) = summary.number_drawn {
        writeln!(text, "             {} drawn one by one", grouped(drawn as f64))?;
    }
    let kept = summary.number_kept as f64;
    let share = 100.0 * summary.number_beyond_tidal as f64 / kept.max(1.0);
    writeln!(
        text,
        "             {} on the line of sight, {} ({share:.1}%) of them with Δ_h ≥ {} at {}″",
        grouped(kept),
        grouped(summary.number_beyond_tidal as f64),
        run.config.diagnostics.delta_threshold,
        run.config.diagnostics.theta_e_arcsec,
    )?;
    writeln!(text, "             largest κ_h on the axis {}", unsigned(plain(summary.largest_kappa_h)))?;
    if summary.number_excluded_by_kappa > 0 {
        writeln!(text, "             {} left out by haloes.max_kappa", summary.number_excluded_by_kappa)?;
    }
    if summary.number_kept == 0 {
        writeln!(text, "warning      no halo is left: see haloes.min_point_shear and haloes.max_kappa")?;
    }
    if summary.number_above_kappa_warning > 0 {
        writeln!(
            text,
            "warning      {} with κ_h > {} on the axis; haloes.max_kappa leaves such haloes out",
            counted(summary.number_above_kappa_warning, "halo", "haloes"),
            run.config.diagnostics.kappa_warning
        )?;
    }
    if run.all.number_in_lens_plane > 0 {
        writeln!(
            text,
            "lens plane   {} at the redshift of the lens: part of the lens, and left out of od, os, ds and LOS",
            counted(run.all.number_in_lens_plane, "halo", "haloes")
        )?;
    }
    writeln!(text, "axis ray     {}", axis_ray(run))?;
    writeln!(text, "matter       {}", matter(&run.matter))?;
    if run.config.image.pixel_sampling == PixelSampling::Point {
        writeln!(
            text,
            "pixels       one point each, which misplaces flux of steep sources by more than the noise;\n             \
             image.pixel_sampling = \"adaptive\" integrates them"
        )?;
    }
    writeln!(text, "tracing      {}", accuracy(&run.accuracy))
}

/// How far haloes bend the ray that is seen on the axis.
fn axis_ray(run: &Simulation) -> String {
    let [lens, source] = run.all.axis_ray_arcsec.map(|[x, y]| x.hypot(y));
    let los = &run.config.line_of_sight;
    match (los.reference, los.is_beside_axis()) {
        (Reference::Straight, _) => {
            format!("kept straight: planes moved by {lens:.2}″ at the lens, {source:.2}″ at the source")
        }
        (Reference::Bent, beside) => format!(
            "bent by {lens:.2}″ at the lens, {source:.2}″ at the source; κ_h, Δ_h are those {}",
            if beside { "along it" } else { "at θ = 0" }
        ),
    }
}

/// Mass as the convergence that it causes on the axis.
fn matter(budget: &MatterBudget) -> String {
    let traced = budget.kappa_of_traced_haloes.map_or(String::new(), |kappa| {
        let times = kappa / budget.kappa_of_mean_density;
        format!(", as traced {kappa:.4} on average ({times:.2} of all matter)")
    });
    // Haloes of a table are not those of the mass function.
    let population = match budget.kappa_of_traced_haloes {
        Some(_) => format!("; of haloes by M200c {:.4}{traced}", budget.kappa_of_population_m200c),
        None => String::new(),
    };
    format!(
        "κ of the mean density {:.4}{population}; taken away by sheets {}",
        budget.kappa_of_mean_density,
        decimals_text(budget.kappa_of_sheets, 4)
    )
}

fn tensors(text: &mut String, run: &Simulation, summary: &Summary) -> std::fmt::Result {
    let (all, tidal) = (&summary.all_haloes, &summary.tidal_haloes);
    let without = format!("without Δ_h ≥ {}", run.config.diagnostics.delta_threshold);
    writeln!(text, "\non the axis  {:^24}{without:^24}", "all haloes")?;
    for (label, name) in
        [("γ_od", "od"), ("γ_os", "os"), ("γ_ds", "ds"), ("γ_LOS", "los"), ("γ_LOS, linear", "los_linear")]
    {
        writeln!(text, "{label:<13}{:^24}{:^24}", shear(all, name), shear(tidal, name))?;
    }
    for (label, name) in [
        ("κ_os", "kappa_os"),
        ("κ_LOS", "kappa_los"),
        ("ω_os", "omega_os"),
        ("Δ_tot", "delta_tot"),
        ("Δ_tot, disc", "delta_tot_disc"),
    ] {
        // Δ is a modulus.
        let shown = |quantities: &Quantities| match plain(quantities.get(name)) {
            value if name.starts_with("delta") => unsigned(value),
            value => value,
        };
        writeln!(text, "{label:<13}{:^24}{:^24}", shown(all), shown(tidal))?;
    }
    Ok(())
}

/// Says how accurately rays were traced.
pub fn print_accuracy(report: &AccuracyReport, bars: &Bars) {
    if !bars.is_quiet() {
        crate::terminal::print(&format!("{}\n", accuracy(report)));
    }
}

fn accuracy(report: &AccuracyReport) -> String {
    if report.rays_traced_exactly == report.rays {
        return format!("{} traced exactly", counted(report.rays, "ray", "rays"));
    }
    format!(
        "{} traced, {} of them exactly; error of β at most {}″, on {} random rays {}″",
        counted(report.rays, "ray", "rays"),
        grouped(report.rays_traced_exactly as f64),
        number_text(report.bound_arcsec, 2),
        report.rays_compared,
        number_text(report.measured_arcsec, 2)
    )
}

fn shear(quantities: &Quantities, name: &str) -> String {
    let part = |i: u8| quantities.get(&format!("gamma{i}_{name}"));
    format!("{} {}i", fixed(part(1)), fixed(part(2)))
}

fn plain(value: f64) -> String {
    match value.abs() {
        size if size.is_nan() => "undefined".into(), // Δ_tot without shear
        1e-3..1e6 => fixed(value),
        _ => signed_text(value, 3),
    }
}

/// Without the plus that only signed quantities need.
fn unsigned(text: String) -> String {
    text.trim_start_matches('+').to_owned()
}

/// With five decimals and a sign.
fn fixed(value: f64) -> String {
    let text = decimals_text(value, 5);
    if text.starts_with('−') { text } else { "+".to_owned() + &text }
}

fn ending(text: &mut String, seconds: &[(String, f64)]) -> std::fmt::Result {
    let total: f64 = seconds.iter().map(|(_, s)| s).sum();
    writeln!(text, "\nseconds      {total:.1} in all")?;
    for (stage, s) in seconds {
        writeln!(text, "             {s:6.2}  {stage}")?;
    }
    writeln!(text)
}

/// A count and what is counted: 1 halo, 34,808 haloes.
pub fn counted(number: usize, one: &str, many: &str) -> String {
    format!("{} {}", grouped(number as f64), if number == 1 { one } else { many })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_is_singular() {
        assert_eq!(counted(1, "halo", "haloes"), "1 halo");
        assert_eq!(counted(34_808, "halo", "haloes"), "34,808 haloes");
    }

    #[test]
    fn sizes_that_no_lens_has_stay_short() {
        let shown = [0.00273, 2.11e-4, 0.0, f64::NAN, f64::INFINITY, 1e94].map(plain);
        assert_eq!(shown, ["+0.00273", "+2.11×10⁻⁴", "0", "undefined", "∞", "+1.00×10⁹⁴"]);
    }
}
