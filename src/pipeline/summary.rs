//! The numbers of a run that a person wants to read, named once for terminal, JSON and HDF5.

use nalgebra::Complex;
use serde::Serialize;

use super::los_shears::{DEFINITIONS, LosShears};
use super::matter::MatterBudget;
use super::scalars::SightScalars;
use super::simulate::Simulation;
use super::view::View;
use crate::diagnostics::Tidal;
use crate::mapping::multiplane::{Accuracy, AccuracyReport};

/// Counts and on-axis quantities of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Seed.
    pub seed: u64,
    /// Expected number of haloes in the cylinder; none for an imported catalogue.
    pub expected_number_in_cylinder: Option<f64>,
    /// Haloes drawn before the cut; none when only those that pass it were drawn.
    pub number_drawn: Option<u64>,
    /// Expected number of haloes that pass the cut; none for an imported catalogue.
    pub expected_number_kept: Option<f64>,
    /// Haloes on the line of sight.
    pub number_kept: usize,
    /// Haloes left out because of `haloes.max_kappa`.
    pub number_excluded_by_kappa: usize,
    /// Haloes with Δ_h of at least the threshold.
    pub number_beyond_tidal: usize,
    /// Largest convergence of a single halo on the axis.
    pub largest_kappa_h: f64,
    /// Haloes with κ_h above `diagnostics.kappa_warning`.
    pub number_above_kappa_warning: usize,
    /// Mass in haloes and sheets, as convergence on the axis.
    pub matter: MatterBudget,
    /// How accurately rays of images and maps were traced.
    pub tracing: Tracing,
    /// Seen through all haloes.
    pub all_haloes: Quantities,
    /// Seen through the haloes in the tidal regime.
    pub tidal_haloes: Quantities,
}

/// The accuracy asked for, the bound of the tiles, and the errors measured against the exact recursion.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Tracing {
    /// Largest error of β allowed, or "exact".
    pub accuracy_arcsec: Accuracy,
    /// What was reached.
    #[serde(flatten)]
    pub report: AccuracyReport,
}

/// Named numbers of one view with their units.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantities(pub Vec<(String, &'static str, f64)>);

impl Serialize for Quantities {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, _, value)| (name, value)))
    }
}

impl Quantities {
    /// The value of a name, for printing.
    pub fn get(&self, name: &str) -> f64 {
        self.0.iter().find(|(n, _, _)| n == name).map_or(f64::NAN, |(_, _, value)| *value)
    }
}

impl Summary {
    /// Reads the numbers off a run.
    pub fn of(run: &Simulation) -> Self {
        let drawn = !run.config.haloes.is_imported();
        let kappa = &run.single_haloes.decisive(&run.config).kappa;
        let warning = run.config.diagnostics.kappa_warning;
        Self {
            seed: run.config.seed,
            expected_number_in_cylinder: drawn.then(|| run.haloes.population.expected_number_drawn()),
            number_drawn: run.haloes.number_drawn,
            expected_number_kept: drawn.then(|| run.haloes.population.expected_number_kept()),
            number_kept: run.all.number_of_haloes,
            number_excluded_by_kappa: run.haloes.number_excluded,
            number_beyond_tidal: run.all.number_of_haloes - run.tidal.number_of_haloes,
            largest_kappa_h: kappa.iter().copied().fold(0.0, f64::max),
            number_above_kappa_warning: kappa.iter().filter(|k| **k > warning).count(),
            matter: run.matter,
            tracing: Tracing {
                accuracy_arcsec: run.config.line_of_sight.accuracy_arcsec,
                report: run.accuracy,
            },
            all_haloes: run.all.quantities(),
            tidal_haloes: run.tidal.quantities(),
        }
    }
}

impl View {
    /// Tensors, flexions, Δ and positions by name.
    pub fn quantities(&self) -> Quantities {
        self.scalars().quantities(Some(&self.los_shears))
    }
}

impl SightScalars {
    /// Tensors, flexions, Δ and positions by name, with γ_LOS by the definitions that need an image where there is one.
    pub fn quantities(&self, of_image: Option<&LosShears>) -> Quantities {
        let mut list = vec![
            ("number_of_haloes".to_string(), "", self.number_of_haloes as f64),
            ("number_in_lens_plane".to_string(), "", self.number_in_lens_plane as f64),
        ];
        let e = &self.effective;
        for (name, d) in [("od", &e.od), ("os", &e.os), ("ds", &e.ds)] {
            push_tidal(&mut list, name, &d.tidal);
            push_flexion(&mut list, name, d.f_per_arcsec, d.g_per_arcsec);
        }
        push_tidal(&mut list, "los", &e.los);
        push_tidal(&mut list, "los_linear", &e.los_linear);
        let without_image = LosShears { ring: self.ring, ..LosShears::NONE };
        let of_image = of_image.unwrap_or(&without_image);
        for (name, tensors) in DEFINITIONS.iter().zip(of_image.all(e)).skip(1) {
            if let Some((od, los)) = tensors {
                push_tidal(&mut list, &format!("od_{name}"), &od);
                push_tidal(&mut list, &format!("los_{name}"), &los);
            }
        }
        for (name, model) in [("best_tidal", &of_image.best_tidal), ("best_flexion", &of_image.best_flexion)]
        {
            let left =
                model.map(|model| (format!("residual_{name}_arcsec"), "arcsec", model.residual_arcsec));
            list.extend(left);
        }
        list.push(("delta_tot".into(), "", self.variation.delta));
        for (name, averaged) in [("ring", &self.averages.ring), ("disc", &self.averages.disc)] {
            list.push((format!("gamma1_os_{name}"), "", averaged.gamma.re));
            list.push((format!("gamma2_os_{name}"), "", averaged.gamma.im));
            push_flexion(&mut list, &format!("os_{name}"), averaged.f_per_arcsec, averaged.g_per_arcsec);
            list.push((format!("delta_tot_{name}"), "", averaged.delta));
        }
        let [ray_at_lens, ray_at_source] = self.axis_ray_arcsec;
        for (name, [x, y]) in [
            ("lens_centre", self.lens_centre_arcsec),
            ("source_centre", self.source_centre_arcsec),
            ("axis_ray_at_lens", ray_at_lens),
            ("axis_ray_at_source", ray_at_source),
        ] {
            list.push((format!("{name}_x_arcsec"), "arcsec", x));
            list.push((format!("{name}_y_arcsec"), "arcsec", y));
        }
        Quantities(list)
    }

    /// What the summary of a run leaves out: os and ds along the beam of the ring, and the flexions of the flexion model.
    pub fn quantities_beside(&self) -> Quantities {
        let mut list = Vec::new();
        if let Some(ring) = &self.ring {
            push_tidal(&mut list, "os_beam", &ring.os);
            push_tidal(&mut list, "ds_beam", &ring.ds);
        }
        for (name, flexion) in [("1ds", &self.effective.flexion_1ds), ("2ds", &self.effective.flexion_2ds)] {
            push_flexion(&mut list, name, flexion.f, flexion.g);
        }
        Quantities(list)
    }
}

fn push_tidal(list: &mut Vec<(String, &'static str, f64)>, name: &str, tidal: &Tidal) {
    for (quantity, value) in [
        ("kappa", tidal.kappa),
        ("gamma1", tidal.gamma.re),
        ("gamma2", tidal.gamma.im),
        ("omega", tidal.omega),
    ] {
        list.push((format!("{quantity}_{name}"), "", value));
    }
}

fn push_flexion(list: &mut Vec<(String, &'static str, f64)>, name: &str, f: Complex<f64>, g: Complex<f64>) {
    for (quantity, value) in [("F1", f.re), ("F2", f.im), ("G1", g.re), ("G2", g.im)] {
        list.push((format!("{quantity}_{name}_per_arcsec"), "arcsec^-1", value));
    }
}
