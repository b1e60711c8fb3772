//! Linear and logarithmic scales, and limits that can always be drawn.

/// How values are spread along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// Equal steps for equal differences.
    Linear,
    /// Equal steps for equal ratios; values ≤ 0 have no place and are not drawn.
    Log,
}

impl Scale {
    /// The value on the axis' own ruler; `None` if it has no place there.
    pub fn forward(self, value: f64) -> Option<f64> {
        let ruler = match self {
            Self::Linear => value,
            Self::Log => value.log10(),
        };
        ruler.is_finite().then_some(ruler)
    }

    fn backward(self, ruler: f64) -> f64 {
        match self {
            Self::Linear => ruler,
            Self::Log => 10f64.powf(ruler),
        }
    }

    /// Smallest and largest value that have a place on this scale.
    pub fn range(self, values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
        values.into_iter().filter(|&value| self.forward(value).is_some()).fold(None, |range, value| {
            let (low, high) = range.unwrap_or((value, value));
            Some((value.min(low), value.max(high)))
        })
    }

    /// Limits widened on both sides by a fraction of their distance on the ruler.
    pub fn padded(self, (low, high): (f64, f64), fraction: f64) -> (f64, f64) {
        match (self.forward(low), self.forward(high)) {
            (Some(a), Some(b)) => {
                let pad = fraction * (b - a);
                (self.backward(a - pad), self.backward(b + pad))
            }
            _ => (low, high),
        }
    }

    /// The nearest limits that can be drawn: ordered, apart, and positive on a logarithmic scale.
    pub fn drawable(self, limits: Option<(f64, f64)>) -> (f64, f64) {
        const NARROWEST: f64 = 1e-9;
        let empty = match self {
            Self::Linear => (0.0, 1.0),
            Self::Log => (1.0, 10.0),
        };
        let Some((low, high)) = limits else { return empty };
        let (Some(a), Some(b)) = (self.forward(low), self.forward(high)) else { return empty };
        let (a, b) = (a.min(b), a.max(b));
        if b - a > NARROWEST * a.abs().max(b.abs()) && b - a < f64::MAX {
            return (low.min(high), low.max(high));
        }
        let half = match self {
            Self::Linear if a != 0.0 => 0.5 * a.abs().min(f64::MAX / 4.0),
            _ => 0.5,
        };
        let widened = (self.backward(a - half), self.backward(a + half));
        let finite = widened.0.is_finite() && widened.1.is_finite();
        if widened.0 < widened.1 && finite { widened } else { empty }
    }
}

/// Whether an axis lies or stands, and so whether its labels stand side by side or above each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    Horizontal,
    Vertical,
}

/// An axis laid on the page: which value lies at which point.
#[derive(Debug, Clone, Copy)]
pub struct Span {
    pub scale: Scale,
    pub low: f64,
    pub high: f64,
    /// Page coordinate of `low`.
    pub start_pt: f64,
    /// Page coordinate of `high`.
    pub end_pt: f64,
}

impl Span {
    /// Page coordinate of a value; `None` if the scale has no place for it.
    pub fn at(&self, value: f64) -> Option<f64> {
        /// Far outside the page and still exactly written by the SVG writer.
        const FAR_PT: f64 = 1e5;
        let (a, b) = (self.scale.forward(self.low)?, self.scale.forward(self.high)?);
        let t = (self.scale.forward(value)? - a) / (b - a);
        let place = self.start_pt + t * (self.end_pt - self.start_pt);
        place.is_finite().then(|| place.clamp(-FAR_PT, FAR_PT))
    }

    /// True if the value lies within the limits.
    pub fn contains(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }
}

/// The `q`-quantile (0..=1) of the finite values, nearest rank; `None` without any.
pub fn quantile(values: &[f64], q: f64) -> Option<f64> {
    let mut finite: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    let last = finite.len().checked_sub(1)?;
    let rank = ((last as f64 * q.clamp(0.0, 1.0)).round() as usize).min(last);
    Some(*finite.select_nth_unstable_by(rank, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn log_limits_ignore_what_has_no_logarithm() {
        let values = [f64::NAN, -3.0, 0.0, 20.0, f64::INFINITY, 0.5];
        assert_eq!(Scale::Log.range(values), Some((0.5, 20.0)));
        assert_eq!(Scale::Linear.range(values), Some((-3.0, 20.0)));
        assert_eq!(Scale::Log.range([0.0, -1.0]), None);
    }

    #[test]
    fn log_padding_is_a_factor() {
        let (low, high) = Scale::Log.padded((1.0, 100.0), 0.5);
        assert!((low - 0.1).abs() < 1e-12 && (high - 1000.0).abs() < 1e-9);
    }

    #[test]
    fn hopeless_limits_become_drawable() {
        for scale in [Scale::Linear, Scale::Log] {
            for limits in [
                None,
                Some((3.0, 3.0)),
                Some((0.0, 0.0)),
                Some((-4.0, -4.0)),
                Some((f64::NAN, 1.0)),
                Some((1.0, f64::INFINITY)),
                Some((-f64::MAX, f64::MAX)),
                Some((f64::MAX, f64::MAX)),
            ] {
                let (low, high) = scale.drawable(limits);
                assert!(low < high && low.is_finite() && high.is_finite(), "{scale:?} {limits:?}");
                assert!(scale.forward(low).is_some(), "{scale:?} {limits:?}");
            }
        }
        assert_eq!(Scale::Linear.drawable(Some((2.0, 1.0))), (1.0, 2.0));
    }

    #[test]
    fn a_span_maps_its_ends_and_its_logarithmic_middle() {
        let span = Span { scale: Scale::Log, low: 1.0, high: 100.0, start_pt: 50.0, end_pt: 10.0 };
        assert_eq!(span.at(1.0), Some(50.0));
        assert_eq!(span.at(10.0), Some(30.0));
        assert_eq!(span.at(100.0), Some(10.0));
        assert_eq!(span.at(-1.0), None);
    }

    #[test]
    fn quantiles_skip_what_is_not_finite() {
        assert_eq!(quantile(&[f64::NAN, 3.0, 1.0, 2.0, f64::INFINITY], 0.5), Some(2.0));
        assert_eq!(quantile(&[f64::NAN], 0.5), None);
    }
}
