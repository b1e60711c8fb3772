//! From the values of a raster to colours.

use super::colour::{Colour, ColourMap};
use super::scale::{Direction, Scale, Span, quantile};
use super::ticks::{self, Ticks};

/// A colour map, the values at its two ends, and the stretch between them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColourScale {
    pub map: ColourMap,
    pub low: f64,
    pub high: f64,
    pub stretch: Stretch,
}

/// How values are spread over a colour map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stretch {
    Linear,
    /// Values ≤ 0 take the first colour.
    Log,
    /// Linear near zero, logarithmic beyond `softening`: asinh(value/softening).
    Asinh {
        softening: f64,
    },
}

impl ColourScale {
    /// Signed values about `centre`, which takes the middle colour; the ends lie `half_width` from it.
    pub fn symmetric(centre: f64, half_width: f64) -> Self {
        let (low, high) = (centre - half_width, centre + half_width);
        Self { map: ColourMap::Diverging, low, high, stretch: Stretch::Linear }
    }

    /// Symmetric about `centre`, wide enough for the fraction `coverage` of the finite values: one cusp does not blank the
    /// map.
    pub fn symmetric_about(centre: f64, values: &[f64], coverage: f64) -> Self {
        let distances: Vec<f64> = values.iter().map(|value| (value - centre).abs()).collect();
        Self::symmetric(centre, quantile(&distances, coverage).filter(|&width| width > 0.0).unwrap_or(1.0))
    }

    /// Logarithmic, leaving the fraction `1 − coverage` of the positive values outside, half on each side.
    pub fn log_of(map: ColourMap, values: &[f64], coverage: f64) -> Self {
        let positive: Vec<f64> = values.iter().copied().filter(|&value| value > 0.0).collect();
        let tail = 0.5 * (1.0 - coverage);
        let limits = quantile(&positive, tail).zip(quantile(&positive, 1.0 - tail));
        let (low, high) = Scale::Log.drawable(limits);
        Self { map, low, high, stretch: Stretch::Log }
    }

    fn scale(&self) -> Scale {
        if self.stretch == Stretch::Log { Scale::Log } else { Scale::Linear }
    }

    /// Values of the first and the last colour, always drawable.
    pub fn limits(&self) -> (f64, f64) {
        self.scale().drawable(Some((self.low, self.high)))
    }

    /// Position on the colour map, clamped to 0..=1; `None` for a value that is not finite.
    pub fn position(&self, value: f64) -> Option<f64> {
        let (low, high) = self.limits();
        let ruler = |v: f64| match self.stretch {
            Stretch::Linear => v,
            Stretch::Log => v.max(low).log10(),
            Stretch::Asinh { softening } => (v / softening.abs().max(f64::MIN_POSITIVE)).asinh(),
        };
        let t = (ruler(value) - ruler(low)) / (ruler(high) - ruler(low));
        (value.is_finite() && t.is_finite()).then(|| t.clamp(0.0, 1.0))
    }

    /// The colour of a value, if it is finite.
    pub fn colour(&self, value: f64) -> Option<Colour> {
        self.position(value).map(|t| self.map.at(t))
    }

    /// Ticks of a colour bar that runs from `start_pt` to `end_pt`.
    pub fn ticks(&self, start_pt: f64, end_pt: f64, direction: Direction) -> Ticks {
        let (low, high) = self.limits();
        match self.stretch {
            Stretch::Asinh { softening } => {
                let at = |value| Some(start_pt + self.position(value)? * (end_pt - start_pt));
                ticks::asinh((low, high), softening, at, direction)
            }
            _ => Ticks::for_span(
                &Span { scale: self.scale(), low, high, start_pt, end_pt },
                direction,
                7,
                false,
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cusp_does_not_set_the_limits() {
        let mut values: Vec<f64> = (0..999).map(|i| 0.01 + 1e-5 * f64::from(i - 500)).collect();
        values.extend([1e3, f64::NAN]);
        let (low, high) = ColourScale::symmetric_about(0.01, &values, 0.98).limits();
        assert!((low + high - 0.02).abs() < 1e-12 && (high - 0.0149).abs() < 1e-4, "{low} {high}");
    }

    #[test]
    fn every_stretch_runs_from_zero_to_one_and_skips_nan() {
        let of = |low, stretch| ColourScale { map: ColourMap::Magma, low, high: 3.0, stretch };
        for scale in [
            of(-1.0, Stretch::Linear),
            of(1e-3, Stretch::Log),
            of(-0.1, Stretch::Asinh { softening: 0.05 }),
            ColourScale::symmetric(1.0, 2.0),
        ] {
            let at = [scale.low, scale.high, 1e9, -1e9, f64::NAN, f64::INFINITY].map(|v| scale.position(v));
            assert_eq!(at, [Some(0.0), Some(1.0), Some(1.0), Some(0.0), None, None]);
        }
        assert_eq!(ColourScale::symmetric(1.0, 2.0).position(1.0), Some(0.5));
    }

    #[test]
    fn degenerate_scales_stay_drawable() {
        let (map, stretch) = (ColourMap::Inferno, Stretch::Asinh { softening: 0.0 });
        for scale in [
            ColourScale::log_of(map, &[f64::NAN, -1.0], 0.98),
            ColourScale::symmetric_about(0.0, &[], 0.98),
            ColourScale::symmetric_about(0.0, &[0.0, 0.0], 0.98),
            ColourScale { map, low: 0.0, high: 0.0, stretch },
        ] {
            let (low, high) = scale.limits();
            assert!(low < high, "{scale:?}");
            scale.ticks(0.0, 100.0, Direction::Horizontal);
            scale.position(0.5);
        }
    }
}
