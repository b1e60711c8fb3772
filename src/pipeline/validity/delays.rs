//! Delays between the images of a point source at the centre of the source, and the H0 that a model makes of them.

use crate::diagnostics::{PointImages, SkyWindow};
use crate::error::Result;
use crate::mapping::Mapping;

/// Delays of the images after the first one, days, in order of arrival.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Delays(Vec<f64>);

impl Delays {
    /// Of a point source behind `mapping`, whose lens is seen at `lens_centre_arcsec`.
    ///
    /// # Errors
    /// A half width of the window that is not positive and finite.
    pub fn of(
        mapping: &dyn Mapping,
        half_width_arcsec: f64,
        lens_centre_arcsec: [f64; 2],
        source_arcsec: [f64; 2],
    ) -> Result<Self> {
        /// A central image fainter than this is never seen.
        const FAINTEST: f64 = 0.01;
        let window = SkyWindow::about_axis(half_width_arcsec, vec![lens_centre_arcsec])?;
        let images = PointImages::of(mapping, &window, source_arcsec).images;
        let seen: Vec<f64> = images
            .iter()
            .filter(|image| image.magnification().abs() > FAINTEST)
            .map(|image| image.delay_days)
            .collect();
        let first = seen.iter().copied().fold(f64::INFINITY, f64::min);
        Ok(Self(seen.into_iter().map(|delay| delay - first).collect()))
    }

    /// H0 that `model` makes of these delays, over the true one.
    ///
    /// Delays of a model are proportional to its time-delay distance and this to 1/H0: the factor s that brings s·model nearest to
    /// the truth, Σ t·m/Σ m², is that of the distance. Not a number where the model has another number of images.
    pub fn h0_ratio(&self, model: &Self) -> f64 {
        if self.0.len() != model.0.len() || self.0.len() < 2 {
            return f64::NAN;
        }
        let product: f64 = self.0.iter().zip(&model.0).map(|(t, m)| t * m).sum();
        let square: f64 = model.0.iter().map(|m| m * m).sum();
        square / product
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mapping::tidal::{LineOfSightModel, Tidal, TidalLens};
    use crate::profile::mass::{Epl, MassModel};

    #[test]
    fn a_sheet_of_mass_changes_h0_by_its_convergence() {
        let lens = |radius: f64, kappa: f64| TidalLens {
            model: LineOfSightModel::Minimal { od: Tidal::NONE, los: Tidal { kappa, ..Tidal::NONE } },
            lenses: vec![MassModel::Epl(Epl::new(radius, 2.0, [0.1, 0.0], [0.0; 2]).unwrap())],
            time_delay_distance_mpc: Some(3000.0),
        };
        let delays = |lens: &TidalLens, source| Delays::of(lens, 3.0, [0.0; 2], source).unwrap();
        // (1 − κ)θ − α = β: images of β/(1 − κ) behind the lens of α/(1 − κ), delays smaller by 1 − κ.
        let kappa = 0.1;
        let truth = delays(&lens(1.0, kappa), [0.09, 0.045]);
        let model = delays(&lens(1.0 / (1.0 - kappa), 0.0), [0.1, 0.05]);
        assert_eq!(truth.0.len(), 4);
        assert!((truth.h0_ratio(&model) - 1.0 / (1.0 - kappa)).abs() < 1e-9, "{}", truth.h0_ratio(&model));
        assert!((truth.h0_ratio(&truth) - 1.0).abs() < 1e-15);
        let two = delays(&lens(1.0, kappa), [0.6, 0.0]);
        assert!(two.0.len() == 2 && truth.h0_ratio(&two).is_nan());
    }
}
