//! Delays between the images of a point source at the centre of the source, and the H0 that a model makes of them.

use nalgebra::{Matrix2, Vector2};

use crate::diagnostics::{PointImages, SkyWindow};
use crate::error::Result;
use crate::mapping::tidal::TidalLens;
use crate::mapping::{Mapping, Order};
use crate::monitor::Silent;

/// Images of a point source and when they arrive.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Delays {
    theta_arcsec: Vec<[f64; 2]>,
    /// Up to a number that all of them share.
    days: Vec<f64>,
}

impl Delays {
    /// All images behind `mapping`, whose lens is seen on the axis, but for a faint central one.
    ///
    /// # Errors
    /// A half width of the window that is not positive and finite.
    pub fn of(mapping: &TidalLens, half_width_arcsec: f64, source_arcsec: [f64; 2]) -> Result<Self> {
        /// A central image fainter than this is never seen.
        const FAINTEST: f64 = 0.01;
        let window = SkyWindow::about_axis(half_width_arcsec, vec![[0.0; 2]])?;
        let images = PointImages::of(mapping, &window, source_arcsec, &Silent)?.images;
        let seen = images.iter().filter(|image| image.magnification().abs() > FAINTEST);
        let (theta_arcsec, days) = seen.map(|image| (image.theta_arcsec, image.delay_days)).unzip();
        Ok(Self { theta_arcsec, days })
    }

    /// The same images behind another mapping of a source there, each followed by Newton's method; none where one is lost. Images
    /// that the other mapping has beside them are not looked for.
    pub fn followed(&self, mapping: &dyn Mapping, source_arcsec: [f64; 2]) -> Option<Self> {
        const STEPS: usize = 30;
        const LONGEST_ARCSEC: f64 = 0.1;
        const CONVERGED_ARCSEC: f64 = 1e-9;
        /// Images closer than this have become one.
        const APART_ARCSEC: f64 = 1e-3;
        let mut theta = self.theta_arcsec.clone();
        for _ in 0..STEPS {
            let rays = mapping.map(&theta, Order::Jacobian);
            let mut longest = 0.0_f64;
            for ((theta, beta), [xx, xy, yx, yy]) in theta.iter_mut().zip(rays.beta_arcsec).zip(rays.jacobian)
            {
                let miss = Vector2::new(beta[0] - source_arcsec[0], beta[1] - source_arcsec[1]);
                let step = Matrix2::new(xx, xy, yx, yy).try_inverse()? * miss;
                let scale = (LONGEST_ARCSEC / step.norm()).min(1.0);
                longest = longest.max(step.norm());
                *theta = [theta[0] - scale * step.x, theta[1] - scale * step.y];
            }
            if longest < CONVERGED_ARCSEC {
                let apart = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]) > APART_ARCSEC;
                let all = (0..theta.len()).all(|i| (0..i).all(|j| apart(theta[i], theta[j])));
                let days = mapping.delay_days(&theta);
                return all.then_some(Self { theta_arcsec: theta, days });
            }
        }
        None
    }

    /// H0 that `model` makes of these delays, over the true one.
    ///
    /// Delays of a model are proportional to its time-delay distance and this to 1/H0: the factor s that brings s·model nearest to
    /// the truth, Σ t·m/Σ m² about the means of both, is that of the distance. Not a number of less than two images.
    pub fn h0_ratio(&self, model: &Self) -> f64 {
        if self.days.len() != model.days.len() || self.days.len() < 2 {
            return f64::NAN;
        }
        let about_mean = |days: &[f64]| -> Vec<f64> {
            let mean = days.iter().sum::<f64>() / days.len() as f64;
            days.iter().map(|day| day - mean).collect()
        };
        let (truth, model) = (about_mean(&self.days), about_mean(&model.days));
        let product: f64 = truth.iter().zip(&model).map(|(t, m)| t * m).sum();
        model.iter().map(|m| m * m).sum::<f64>() / product
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mapping::tidal::{LineOfSightModel, Tidal};
    use crate::profile::mass::{Epl, MassModel};

    #[test]
    fn a_sheet_of_mass_changes_h0_by_its_convergence() {
        let lens = |radius: f64, kappa: f64| TidalLens {
            model: LineOfSightModel::Minimal { od: Tidal::NONE, los: Tidal { kappa, ..Tidal::NONE } },
            lenses: vec![MassModel::Epl(Epl::new(radius, 2.0, [0.1, 0.0], [0.0; 2]).unwrap())],
            time_delay_distance_mpc: Some(3000.0),
        };
        // (1 − κ)θ − α = β: images of β/(1 − κ) behind the lens of α/(1 − κ), delays smaller by 1 − κ.
        let kappa = 0.1;
        let truth = Delays::of(&lens(1.0, kappa), 3.0, [0.009, 0.0045]).unwrap();
        assert_eq!(truth.days.len(), 4);
        let model = truth.followed(&lens(1.0 / (1.0 - kappa), 0.0), [0.01, 0.005]).unwrap();
        assert!((truth.h0_ratio(&model) - 1.0 / (1.0 - kappa)).abs() < 1e-9, "{}", truth.h0_ratio(&model));
        assert!((truth.h0_ratio(&truth) - 1.0).abs() < 1e-15);
        // A nearby lens: images move, the same four are found as by a search.
        let near = lens(1.05, 0.02);
        let followed = truth.followed(&near, [0.012, 0.003]).unwrap();
        let searched = Delays::of(&near, 3.0, [0.012, 0.003]).unwrap();
        for theta in &followed.theta_arcsec {
            let gap = |other: &[f64; 2]| (theta[0] - other[0]).hypot(theta[1] - other[1]);
            assert!(searched.theta_arcsec.iter().map(gap).fold(1.0, f64::min) < 1e-9, "{theta:?}");
        }
        // Of a source far off there are two images, and four cannot be followed to them.
        assert_eq!(truth.followed(&near, [0.7, 0.0]), None);
    }
}
