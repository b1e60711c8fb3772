//! The fits of the study by case, view, image, model and start, each beside those it is compared with.

use super::plan::{FitStart, ValidityPlan};
use super::rows::{Mock, ValidityFit, ValidityImage, ValiditySightline, ValidityView};
use super::statistics::Deviation;
use crate::inference::diagnose::P_VALUE_LIMIT;

/// A fit with everything that belongs to it.
#[derive(Debug, Clone, Copy)]
pub struct FitPair<'a> {
    /// Its sightline.
    pub row: &'a ValiditySightline,
    /// Its view.
    pub view: &'a ValidityView,
    /// Its image.
    pub image: &'a ValidityImage,
    /// The fit.
    pub fit: &'a ValidityFit,
    /// That of the tidal twin by the same model from the same start; the fit itself where it is that.
    pub twin: &'a ValidityFit,
    /// That of the same image by the first model from the same start.
    pub first: &'a ValidityFit,
    /// That of the same image by the same model from the truth, where there is one.
    pub from_truth: Option<&'a ValidityFit>,
}

impl FitPair<'_> {
    /// χ² above that of the tidal twin.
    pub fn chi2_excess(&self) -> f64 {
        self.fit.chi2 - self.twin.chi2
    }

    /// ln of the evidence over that of the first model.
    pub fn log_odds(&self) -> f64 {
        self.fit.log_evidence - self.first.log_evidence
    }

    /// Whether χ² does not speak against the model.
    pub fn is_good(&self) -> bool {
        self.fit.p_value >= P_VALUE_LIMIT
    }

    /// The fitted γ_LOS beside that of a definition.
    pub fn deviation(&self, definition: usize) -> Deviation {
        let ValidityFit { shear, covariance, .. } = *self.fit;
        Deviation { defined: self.image.by_definition[definition], fitted: shear, covariance }
    }
}

/// The fits of all sightlines of one kind.
#[derive(Debug, Clone)]
pub struct FitGroup<'a> {
    /// Place of the case in the plan.
    pub case: usize,
    /// Place of the view in the plan.
    pub view: usize,
    /// What the images were seen through.
    pub mock: Mock,
    /// Place of the model in the plan.
    pub model: usize,
    /// Where the fits began.
    pub start: FitStart,
    /// In the order of the sightlines; failed ones too.
    pub fits: Vec<FitPair<'a>>,
}

impl<'a> FitGroup<'a> {
    /// All groups: by case, view, image, model and start.
    pub fn all(plan: &ValidityPlan, rows: &'a [ValiditySightline]) -> Vec<Self> {
        let mut groups = Vec::new();
        for case in 0..plan.cases.len() {
            for view in 0..plan.views.len() {
                for mock in [Mock::Haloes, Mock::Tidal] {
                    for model in 0..plan.models.len() {
                        for &start in &plan.starts {
                            let fits = rows.iter().filter(|row| row.case == case);
                            let fits = fits.filter_map(|row| pair(row, view, mock, (model, start)));
                            groups.push(Self { case, view, mock, model, start, fits: fits.collect() });
                        }
                    }
                }
            }
        }
        groups
    }

    /// The fits that came to something.
    pub fn done(&self) -> impl Iterator<Item = &FitPair<'a>> {
        self.fits.iter().filter(|pair| pair.fit.failure.is_empty())
    }
}

fn pair(
    row: &ValiditySightline,
    view: usize,
    mock: Mock,
    (model, start): (usize, FitStart),
) -> Option<FitPair<'_>> {
    let view = row.views.get(view)?;
    let image = if mock == Mock::Haloes { &view.haloes } else { &view.tidal };
    let find = |image: &'_ ValidityImage, model: usize, start: FitStart| {
        image.fits.iter().position(|fit| fit.model == model && fit.start == start)
    };
    let of = |model: usize, start: FitStart| find(image, model, start).map(|place| &image.fits[place]);
    let twin = find(&view.tidal, model, start).map(|place| &view.tidal.fits[place])?;
    let from_truth = (start != FitStart::Truth).then(|| of(model, FitStart::Truth)).flatten();
    Some(FitPair { row, view, image, fit: of(model, start)?, twin, first: of(0, start)?, from_truth })
}
