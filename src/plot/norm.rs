//! How a raster's values become positions on its colour map.

use super::colour::ColourMap;
use super::scale::{Direction, Scale, Span, quantile};
use super::ticks::{self, Ticks};

/// Values at the two ends of a colour map and the stretch between them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Norm {
    /// Proportional.
    Linear {
        /// Value of the first colour.
        low: f64,
        /// Value of the last colour.
        high: f64,
    },
    /// Logarithmic; values ≤ 0 take the first colour.
    Log {
        /// Value of the first colour, > 0.
        low: f64,
        /// Value of the last colour.
        high: f64,
    },
    /// Proportional about a centre that takes the middle colour.
    Symmetric {
        /// Value of the middle colour.
        centre: f64,
        /// Distance of both ends from the centre, > 0.
        half_width: f64,
    },
    /// Linear near zero, logarithmic beyond `softening`: asinh(value/softening).
    Asinh {
        /// Value of the first colour.
        low: f64,
        /// Value of the last colour.
        high: f64,
        /// Where the stretch turns from linear to logarithmic, > 0.
        softening: f64,
    },
}

/// From values to colours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColourScale {
    /// Colours.
    pub map: ColourMap,
    /// From values to positions on the map.
    pub norm: Norm,
}

impl Norm {
    /// Symmetric about `centre`, wide enough for the fraction `coverage` of the finite values: one cusp
    /// does not blank the map.
    pub fn symmetric_about(centre: f64, values: &[f64], coverage: f64) -> Self {
        let distances: Vec<f64> = values.iter().map(|value| (value - centre).abs()).collect();
        let half_width = quantile(&distances, coverage).filter(|&width| width > 0.0).unwrap_or(1.0);
        Self::Symmetric { centre, half_width }
    }

    /// Logarithmic, leaving the fraction `1 − coverage` of the positive values outside, half on each side.
    pub fn log_of(values: &[f64], coverage: f64) -> Self {
        let positive: Vec<f64> = values.iter().copied().filter(|&value| value > 0.0).collect();
        let tail = 0.5 * (1.0 - coverage);
        let limits = quantile(&positive, tail).zip(quantile(&positive, 1.0 - tail));
        let (low, high) = Scale::Log.drawable(limits);
        Self::Log { low, high }
    }

    /// Values of the first and the last colour, always drawable.
    pub fn limits(&self) -> (f64, f64) {
        match *self {
            Self::Linear { low, high } | Self::Asinh { low, high, .. } => {
                Scale::Linear.drawable(Some((low, high)))
            }
            Self::Log { low, high } => Scale::Log.drawable(Some((low, high))),
            Self::Symmetric { centre, half_width } => {
                Scale::Linear.drawable(Some((centre - half_width, centre + half_width)))
            }
        }
    }

    /// Position on the colour map, clamped to 0..=1; `None` for a value that is not finite.
    pub fn position(&self, value: f64) -> Option<f64> {
        if !value.is_finite() {
            return None;
        }
        let (low, high) = self.limits();
        let ruler = |v: f64| match *self {
            Self::Linear { .. } | Self::Symmetric { .. } => v,
            Self::Log { .. } => v.max(low).log10(),
            Self::Asinh { softening, .. } => (v / softening.abs().max(f64::MIN_POSITIVE)).asinh(),
        };
        let t = (ruler(value) - ruler(low)) / (ruler(high) - ruler(low));
        t.is_finite().then(|| t.clamp(0.0, 1.0))
    }

    /// Ticks of a colour bar that runs from `start_pt` to `end_pt`.
    pub(super) fn ticks(&self, start_pt: f64, end_pt: f64, direction: Direction, size_pt: f64) -> Ticks {
        let (low, high) = self.limits();
        let scale = if matches!(self, Self::Log { .. }) { Scale::Log } else { Scale::Linear };
        match *self {
            Self::Asinh { softening, .. } => {
                let at = |value| Some(start_pt + self.position(value)? * (end_pt - start_pt));
                ticks::asinh((low, high), softening, at, direction, size_pt)
            }
            _ => Ticks::for_span(&Span { scale, low, high, start_pt, end_pt }, direction, size_pt),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cusp_does_not_set_the_limits() {
        let mut values: Vec<f64> = (0..999).map(|i| 0.01 + 1e-5 * f64::from(i - 500)).collect();
        values.push(1e3);
        values.push(f64::NAN);
        let Norm::Symmetric { centre, half_width } = Norm::symmetric_about(0.01, &values, 0.98) else {
            panic!()
        };
        assert_eq!(centre, 0.01);
        assert!((half_width - 4.9e-3).abs() < 1e-4, "{half_width}");
    }

    #[test]
    fn every_norm_runs_from_zero_to_one_and_skips_nan() {
        let norms = [
            Norm::Linear { low: -1.0, high: 3.0 },
            Norm::Log { low: 1e-3, high: 3.0 },
            Norm::Symmetric { centre: 1.0, half_width: 2.0 },
            Norm::Asinh { low: -0.1, high: 3.0, softening: 0.05 },
        ];
        for norm in norms {
            let (low, high) = norm.limits();
            assert_eq!(norm.position(low), Some(0.0));
            assert_eq!(norm.position(high), Some(1.0));
            assert_eq!(norm.position(1e9), Some(1.0));
            assert_eq!(norm.position(-1e9), Some(0.0));
            assert_eq!(norm.position(f64::NAN), None);
            assert_eq!(norm.position(f64::INFINITY), None);
        }
        assert_eq!(norms[2].position(1.0), Some(0.5));
    }

    #[test]
    fn degenerate_norms_stay_drawable() {
        for norm in [
            Norm::log_of(&[f64::NAN, -1.0], 0.98),
            Norm::symmetric_about(0.0, &[], 0.98),
            Norm::symmetric_about(0.0, &[0.0, 0.0], 0.98),
            Norm::Asinh { low: 0.0, high: 0.0, softening: 0.0 },
        ] {
            let (low, high) = norm.limits();
            assert!(low < high, "{norm:?}");
            norm.ticks(0.0, 100.0, Direction::Horizontal, 7.0);
            norm.position(0.5);
        }
    }
}
