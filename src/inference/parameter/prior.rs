//! Prior distributions and their latent coordinates.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spec_math::cephes64::{ndtr, ndtri};

use crate::error::{Domain, Error, Result};
pub use crate::profile::registry::PriorShape;

/// The prior of one parameter: `{ uniform = [a, b] }`, `{ normal = [mean, sd] }` or `{ log_normal = [median, sd of ln] }`;
/// the last two may be cut with `low` and `high`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "PriorInFile")]
pub struct Prior {
    /// Shape.
    #[serde(flatten)]
    pub shape: PriorShape,
    /// Lower edge.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub low: Option<f64>,
    /// Upper edge.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub high: Option<f64>,
}

/// A prior as it is written: serde takes the first of several flattened shapes and passes over names that it does not know.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct PriorInFile {
    uniform: Option<[f64; 2]>,
    normal: Option<[f64; 2]>,
    log_normal: Option<[f64; 2]>,
    low: Option<f64>,
    high: Option<f64>,
}

impl TryFrom<PriorInFile> for Prior {
    type Error = &'static str;

    fn try_from(written: PriorInFile) -> std::result::Result<Self, Self::Error> {
        let PriorInFile { uniform, normal, log_normal, low, high } = written;
        let shape = match (uniform, normal, log_normal) {
            (Some(edges), None, None) => PriorShape::Uniform(edges),
            (None, Some(pair), None) => PriorShape::Normal(pair),
            (None, None, Some(pair)) => PriorShape::LogNormal(pair),
            _ => return Err("a prior has one of uniform, normal and log_normal"),
        };
        Ok(Self { shape, low, high })
    }
}

impl Prior {
    /// Uniform from `low` to `high`.
    pub fn uniform(low: f64, high: f64) -> Self {
        Self { shape: PriorShape::Uniform([low, high]), low: None, high: None }
    }

    /// Checks its numbers; `name` is the parameter's.
    ///
    /// # Errors
    /// A number that is not finite, a width that is not positive, edges that leave nothing.
    pub fn validate(&self, name: &str) -> Result<()> {
        let what = |part: &str| format!("prior of {name}: {part}");
        let (PriorShape::Uniform(pair) | PriorShape::Normal(pair) | PriorShape::LogNormal(pair)) = self.shape;
        for value in pair.into_iter().chain(self.low).chain(self.high) {
            Domain::FINITE.check(&what("a number"), value)?;
        }
        match self.shape {
            PriorShape::Uniform([low, high]) => {
                let allowed = format!("above the lower edge, {low}");
                Domain::above(low).check_in_words(&what("upper edge"), high, &allowed)?;
                if self.low.or(self.high).is_some() {
                    let allowed = "left out: a uniform prior has its edges already";
                    return Err(Error::out_of_range(&what("low or high"), "given", allowed));
                }
            }
            PriorShape::Normal([_, sd]) => {
                Domain::POSITIVE.check(&what("standard deviation"), sd)?;
            }
            PriorShape::LogNormal([median, sd]) => {
                Domain::POSITIVE.check(&what("median"), median)?;
                Domain::POSITIVE.check(&what("standard deviation of ln"), sd)?;
            }
        }
        if let (Some(low), Some(high)) = (self.low, self.high) {
            Domain::above(low).check_in_words(&what("high"), high, &format!("above low, {low}"))?;
        }
        Domain::POSITIVE.check(&what("probability between low and high"), self.window().inside)?;
        Ok(())
    }

    /// The edges of its support, infinite where there is none.
    pub fn edges(&self) -> [f64; 2] {
        let [low, high] = match self.shape {
            PriorShape::Uniform(edges) => edges,
            PriorShape::Normal(_) => [f64::NEG_INFINITY, f64::INFINITY],
            PriorShape::LogNormal(_) => [0.0, f64::INFINITY],
        };
        [self.low.unwrap_or(low), self.high.unwrap_or(high)]
    }

    /// The value at latent coordinate z and its derivative dp/dz: p = F⁻¹(Φ(z)).
    pub fn at_latent(&self, z: f64) -> [f64; 2] {
        if let PriorShape::Uniform([low, high]) = self.shape {
            // From the nearer edge, which keeps all digits there.
            let width = high - low;
            let value = if z < 0.0 { low + width * ndtr(z) } else { high - width * ndtr(-z) };
            return [value, width * density(z)];
        }
        let (y, dy) = if self.low.is_none() && self.high.is_none() {
            (z, 1.0)
        } else {
            // From the nearer tail, which keeps all digits there.
            let Window { below, inside, above } = self.window();
            let tail = |outside: f64, p: f64| ndtri((outside + inside * p).max(f64::MIN_POSITIVE));
            let y = if z < 0.0 { tail(below, ndtr(z)) } else { -tail(above, ndtr(-z)) };
            (y, inside * density(z) / density(y))
        };
        match self.shape {
            PriorShape::Normal([mean, sd]) => [mean + sd * y, sd * dy],
            PriorShape::LogNormal([median, sd]) => {
                let value = median * (sd * y).exp();
                [value, value * sd * dy]
            }
            PriorShape::Uniform(_) => [f64::NAN; 2],
        }
    }

    /// The latent coordinate of a value, kept within ±8.
    pub fn to_latent(&self, value: f64) -> f64 {
        let y = self.standardise(value);
        let z = match self.shape {
            PriorShape::Uniform(_) => ndtri(y.clamp(0.0, 1.0)),
            _ if self.low.is_none() && self.high.is_none() => y,
            _ => {
                let Window { below, inside, above } = self.window();
                let tail = |outside: f64, p: f64| ndtri(((p - outside) / inside).clamp(0.0, 1.0));
                if y < 0.0 { tail(below, ndtr(y)) } else { -tail(above, ndtr(-y)) }
            }
        };
        if z.is_nan() { 0.0 } else { z.clamp(-8.0, 8.0) }
    }

    /// (p − mean)/sd, in ln p for the log-normal.
    fn standardise(&self, value: f64) -> f64 {
        match self.shape {
            PriorShape::LogNormal([median, sd]) => (value.max(0.0) / median).ln() / sd,
            PriorShape::Normal([mean, sd]) => (value - mean) / sd,
            PriorShape::Uniform([low, high]) => (value - low) / (high - low),
        }
    }

    /// How the edges divide the probability of the shape that is not cut.
    fn window(&self) -> Window {
        let edge = |v: Option<f64>, open: f64| v.map_or(open, |v| self.standardise(v));
        let (low, high) = (edge(self.low, f64::NEG_INFINITY), edge(self.high, f64::INFINITY));
        let inside = if low > 0.0 { ndtr(-low) - ndtr(-high) } else { ndtr(high) - ndtr(low) };
        Window { below: ndtr(low), inside, above: ndtr(-high) }
    }
}

/// Probabilities below, between and above the edges of a prior.
struct Window {
    below: f64,
    inside: f64,
    above: f64,
}

/// The standard normal density.
fn density(z: f64) -> f64 {
    (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt()
}
