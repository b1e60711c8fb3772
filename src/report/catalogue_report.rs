//! The results of a catalogue study: scores of every model, tables, the paper's Table 2 beside them, figures.

use std::fmt::Write;

use super::number_text::decimals_text;
use crate::error::Result;
use crate::io::{Column, Table, TrueShear};
use crate::mock::{
    ModelScore, PAPER_QUALITY_FIT, PAPER_TABLE_2, ProfiledShear, ShearRecovery, residual_in_sigma,
    uncertainty,
};
use crate::plot::Figure;
use crate::plot::figures::{
    CornerParameter, CornerPosterior, RecoveredPoint, RecoveryData, corner, recovery, recovery_histograms,
    recovery_quality,
};

/// A figure of the study.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedFigure {
    /// Name of its files.
    pub name: &'static str,
    /// What it shows, in words.
    pub shows: &'static str,
    /// The figure.
    pub figure: Figure,
}

/// All fits of a catalogue with the truths they are compared with.
#[derive(Debug, Clone, PartialEq)]
pub struct CatalogueReport {
    /// Names of the models in order.
    pub models: Vec<String>,
    /// Each fit and the truth of its image, by image and within it by model.
    pub fits: Vec<(ShearRecovery, TrueShear)>,
}

impl CatalogueReport {
    fn of_model<'a>(&'a self, model: &'a str) -> impl Iterator<Item = &'a (ShearRecovery, TrueShear)> {
        self.fits.iter().filter(move |(fit, _)| fit.model == model)
    }

    /// One score a model.
    pub fn scores(&self) -> Vec<ModelScore> {
        let of = |model: &String| {
            let fits: Vec<_> =
                self.of_model(model).map(|(fit, truth)| (fit, truth.gamma_los, truth.quality)).collect();
            ModelScore::of(model, &fits)
        };
        self.models.iter().map(of).collect()
    }

    /// One row a fit.
    ///
    /// # Errors
    /// Never.
    pub fn fit_table(&self) -> Result<Table> {
        let column = |name: &str, value: &dyn Fn(&ShearRecovery, &TrueShear) -> f64| {
            Column::f64(name, None, self.fits.iter().map(|(fit, truth)| value(fit, truth)).collect())
        };
        let text = |name: &str, value: &dyn Fn(&ShearRecovery) -> String| {
            Column::text(name, self.fits.iter().map(|(fit, _)| value(fit)).collect())
        };
        let flag = |is: bool| f64::from(u8::from(is));
        let mut columns = vec![
            text("image", &|f| f.image.clone()),
            text("model", &|f| f.model.clone()),
            column("quality", &|_, t| t.quality.unwrap_or(f64::NAN)),
            column("productive", &|f, _| flag(f.is_productive())),
            column("converged", &|f, _| flag(f.converged)),
        ];
        for a in 0..2 {
            let named = |what: &str| format!("gamma{}_los{what}", a + 1);
            columns.push(column(&named("_in"), &|_, t| t.gamma_los[a]));
            columns.push(column(&named("_out"), &|f, _| f.shear[a].median));
            columns.push(column(&named("_low"), &|f, _| f.shear[a].low));
            columns.push(column(&named("_high"), &|f, _| f.shear[a].high));
            columns.push(column(&named("_mean"), &|f, _| f.shear[a].mean));
            columns.push(column(&named("_sd"), &|f, _| f.shear[a].standard_deviation));
            columns.push(column(&named("_best_fit"), &|f, _| f.shear[a].best_fit));
            columns.push(column(&named("_fisher"), &|f, _| f.shear[a].fisher));
            if self.fits.iter().any(|(fit, _)| fit.shear[a].profile.is_some()) {
                let of = |f: &ShearRecovery, value: &dyn Fn(ProfiledShear) -> Option<f64>| {
                    f.shear[a].profile.and_then(value).unwrap_or(f64::NAN)
                };
                columns.push(column(&named("_profile_best_fit"), &|f, _| of(f, &|p| Some(p.best_fit))));
                columns.push(column(&named("_profile_low"), &|f, _| of(f, &|p| p.interval68[0])));
                columns.push(column(&named("_profile_high"), &|f, _| of(f, &|p| p.interval68[1])));
            }
            columns.push(column(&named("_bounded"), &|f, _| flag(f.shear[a].bounded)));
        }
        columns.push(column("sigma", &|f, _| uncertainty(f)));
        columns.push(column("residual_in_sigma", &|f, t| residual_in_sigma(f, t.gamma_los)));
        columns.push(column("chi2_reduced", &|f, _| f.chi2_reduced));
        columns.push(column("worst_r_hat", &|f, _| f.worst_r_hat));
        columns.push(column("worst_ess", &|f, _| f.worst_ess));
        columns.push(column("divergences", &|f, _| f.divergences as f64));
        columns.push(column("evaluations", &|f, _| f.evaluations as f64));
        columns.push(text("unbounded", &|f| f.unbounded.join(" ")));
        // A fit may leave any of them unknown.
        let names: Vec<String> = columns.iter().map(|column| column.name.clone()).collect();
        Ok(Table::new(columns)?.with_gaps_in(names.iter().map(String::as_str)))
    }

    /// The paper's Table 2 in Markdown, the paper's numbers in a second column where it has them.
    pub fn markdown(&self) -> String {
        let scores = self.scores();
        let mut text = String::from("| |");
        for score in &scores {
            let _ = write!(text, " {} | paper |", score.model);
        }
        text += "\n|---|";
        text += &"---:|---:|".repeat(scores.len());
        let paper = |score: &ModelScore| PAPER_TABLE_2.iter().find(|paper| paper.model == score.model);
        let mut line =
            |name: &str, own: &dyn Fn(&ModelScore) -> String, of_paper: &dyn Fn(&ModelScore) -> String| {
                let _ = write!(text, "\n| {name} |");
                for score in &scores {
                    let _ = write!(text, " {} | {} |", own(score), of_paper(score));
                }
            };
        let percent =
            |part: usize, all: usize| format!("{part} ({:.0}%)", 100.0 * part as f64 / all.max(1) as f64);
        let nothing = |_: &ModelScore| String::new();
        line("images", &|s| s.images.to_string(), &|s| paper(s).map_or(String::new(), |_| "64".into()));
        line("converged", &|s| percent(s.converged, s.images), &nothing);
        line("productive", &|s| percent(s.productive, s.images), &|s| {
            paper(s).map_or(String::new(), |p| percent(p.productive, 64))
        });
        line("mean σ", &|s| format!("{:.4}", s.mean_uncertainty), &|s| {
            paper(s).map_or(String::new(), |p| format!("{:.3}", p.mean_uncertainty))
        });
        line("median σ", &|s| format!("{:.4}", s.median_uncertainty), &nothing);
        line("median Fisher σ", &|s| format!("{:.4}", s.median_fisher), &nothing);
        line("χ²", &|s| format!("{:.2}", s.chi2), &|s| {
            paper(s).map_or(String::new(), |p| format!("{:.1}", p.chi2))
        });
        line("off by over 2σ", &|s| percent(s.outliers, s.productive), &|s| {
            paper(s).map_or(String::new(), |p| percent(p.outliers, p.productive))
        });
        line("coverage of 68%", &|s| format!("{:.0}%", 100.0 * s.coverage), &nothing);
        if scores.iter().any(|score| score.profile_coverage.is_some()) {
            let known = |value: Option<f64>, text: &dyn Fn(f64) -> String| value.map_or(String::new(), text);
            let percent = |value| format!("{:.0}%", 100.0 * value);
            line("coverage of 68%, profile", &|s| known(s.profile_coverage, &percent), &nothing);
            line("χ², profile", &|s| known(s.profile_chi2, &|value| format!("{value:.2}")), &nothing);
        }
        line("largest residual, σ", &|s| format!("{:.1}", s.largest_residual), &nothing);
        text + "\n"
    }

    /// The figures of section 3.
    pub fn figures(&self) -> Vec<NamedFigure> {
        let data: Vec<RecoveryData> = self.models.iter().map(|model| self.recovery_data(model)).collect();
        let named = |name, shows, figure| NamedFigure { name, shows, figure };
        let mut figures = vec![
            named("recovery", "γ_LOS found against γ_LOS put in", recovery(&data)),
            named(
                "uncertainties",
                "histograms of uncertainties and of residuals",
                recovery_histograms(&data),
            ),
        ];
        let best = self.scores().into_iter().zip(&data).next();
        if let Some((ModelScore { quality_fit: Some(own), .. }, data)) = best {
            let sign = if own.intercept < 0.0 { "−" } else { "+" };
            let (slope, intercept) = (decimals_text(own.slope, 2), decimals_text(own.intercept.abs(), 2));
            let legend = format!("log σ = {slope} log Q {sign} {intercept}");
            let paper = PAPER_QUALITY_FIT;
            let lines =
                [([own.slope, own.intercept], legend.as_str()), ([paper.slope, paper.intercept], "paper")];
            let figure = recovery_quality(data, &lines);
            figures.push(named(
                "quality",
                "uncertainty and residual against image quality, first model",
                figure,
            ));
        }
        let contours = self.median_image().map(|image| contour_figure(&self.of_image(image)));
        figures
            .extend(contours.map(|figure| named("contours", "posteriors of the image of median Q", figure)));
        figures
    }

    fn recovery_data(&self, model: &str) -> RecoveryData {
        let productive = self.of_model(model).filter(|(fit, _)| fit.is_productive());
        let points = productive.map(|(fit, truth)| RecoveredPoint {
            input: truth.gamma_los,
            output: fit.shear.map(|shear| shear.median),
            low: fit.shear.map(|shear| shear.low),
            high: fit.shear.map(|shear| shear.high),
            uncertainty: uncertainty(fit),
            residual: residual_in_sigma(fit, truth.gamma_los),
            log_quality: truth.quality.map_or(f64::NAN, f64::log10),
        });
        RecoveryData { model: model.into(), points: points.collect() }
    }

    /// The image of median quality; the first where no quality is known.
    fn median_image(&self) -> Option<&str> {
        let mut images: Vec<(&str, f64)> =
            self.fits.iter().map(|(fit, truth)| (fit.image.as_str(), truth.quality.unwrap_or(0.0))).collect();
        images.dedup();
        images.sort_by(|a, b| a.1.total_cmp(&b.1));
        images.get(images.len() / 2).map(|(image, _)| *image)
    }

    fn of_image<'a>(&'a self, image: &str) -> Vec<&'a (ShearRecovery, TrueShear)> {
        self.fits.iter().filter(|(fit, _)| fit.image == image).collect()
    }
}

/// γ_LOS of one image as each model finds it.
pub fn contour_figure(fits: &[&(ShearRecovery, TrueShear)]) -> Figure {
    let truth = fits.first().map(|(_, truth)| truth.gamma_los);
    let labels = ["γ_{1}^{LOS}", "γ_{2}^{LOS}"];
    let parameters: Vec<CornerParameter> = labels
        .iter()
        .enumerate()
        .map(|(a, label)| CornerParameter { label, unit: "", values: vec![truth.map(|truth| truth[a])] })
        .collect();
    let draws: Vec<[Vec<f64>; 2]> =
        fits.iter().map(|(fit, _)| [0, 1].map(|a| fit.draws.iter().map(|draw| draw[a]).collect())).collect();
    let posteriors: Vec<CornerPosterior> = fits
        .iter()
        .zip(&draws)
        .map(|((fit, _), draws)| CornerPosterior {
            legend: &fit.model,
            draws: draws.iter().map(Vec::as_slice).collect(),
        })
        .collect();
    corner(&parameters, &posteriors, &["truth"])
}
