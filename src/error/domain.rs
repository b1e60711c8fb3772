//! What a number may be: one description checks it, and says in an error what is allowed.

use std::fmt;
use std::ops::Bound::{self, Excluded, Included, Unbounded};

use super::{Error, Result, shortest};

/// An interval of finite numbers.
///
/// ```
/// use haloray::error::Domain;
/// assert!(Domain::POSITIVE.check("radius_arcsec", 0.5).is_ok());
/// let error = Domain::from_to(0.3, 10.0).check("n_sersic", 12.0).unwrap_err();
/// assert_eq!(error.to_string(), "n_sersic is 12, but must be from 0.3 to 10");
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Domain {
    low: Bound<f64>,
    high: Bound<f64>,
}

impl Domain {
    /// Every finite number.
    pub const FINITE: Self = Self { low: Unbounded, high: Unbounded };
    /// Above zero.
    pub const POSITIVE: Self = Self::above(0.0);
    /// Zero or above.
    pub const NON_NEGATIVE: Self = Self::at_least(0.0);

    /// Above `low`.
    pub const fn above(low: f64) -> Self {
        Self { low: Excluded(low), high: Unbounded }
    }

    /// `low` or more.
    pub const fn at_least(low: f64) -> Self {
        Self { low: Included(low), high: Unbounded }
    }

    /// Below `high`.
    pub const fn below(high: f64) -> Self {
        Self { low: Unbounded, high: Excluded(high) }
    }

    /// From `low` to `high`, both allowed.
    pub const fn from_to(low: f64, high: f64) -> Self {
        Self { low: Included(low), high: Included(high) }
    }

    /// Between `low` and `high`, neither allowed.
    pub const fn inside(low: f64, high: f64) -> Self {
        Self { low: Excluded(low), high: Excluded(high) }
    }

    /// Above `low`, `high` at most.
    pub const fn above_to(low: f64, high: f64) -> Self {
        Self { low: Excluded(low), high: Included(high) }
    }

    /// `low` or more, below `high`.
    pub const fn from_below(low: f64, high: f64) -> Self {
        Self { low: Included(low), high: Excluded(high) }
    }

    /// Whether `value` is finite and inside.
    pub fn contains(self, value: f64) -> bool {
        let above = match self.low {
            Unbounded => true,
            Included(low) => value >= low,
            Excluded(low) => value > low,
        };
        let below = match self.high {
            Unbounded => true,
            Included(high) => value <= high,
            Excluded(high) => value < high,
        };
        value.is_finite() && above && below
    }

    /// The edges, infinite where there is none.
    pub fn edges(self) -> [f64; 2] {
        let edge = |bound, open| match bound {
            Unbounded => open,
            Included(value) | Excluded(value) => value,
        };
        [edge(self.low, f64::NEG_INFINITY), edge(self.high, f64::INFINITY)]
    }

    /// `value` itself where it is allowed.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] with the name `what`, the value and this domain.
    pub fn check(self, what: &str, value: f64) -> Result<f64> {
        // Words are made for an error alone: profiles are built by the ten thousand.
        if self.contains(value) { Ok(value) } else { self.check_in_words(what, value, &self.to_string()) }
    }

    /// `value` itself where it is allowed; `allowed` says the domain in words of its own, such as what bounds it.
    ///
    /// # Errors
    /// As [`check`](Self::check).
    pub fn check_in_words(self, what: &str, value: f64, allowed: &str) -> Result<f64> {
        if self.contains(value) {
            return Ok(value);
        }
        let finite = if value.is_finite() || self == Self::FINITE { "" } else { "a finite number, " };
        Err(Error::out_of_range(what, shortest(value), &format!("{finite}{allowed}")))
    }
}

impl fmt::Display for Domain {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match (self.low, self.high) {
            (Unbounded, Unbounded) => write!(f, "finite"),
            (Excluded(0.0), Unbounded) => write!(f, "positive"),
            (Included(0.0), Unbounded) => write!(f, "zero or positive"),
            (Included(low), Included(high)) => write!(f, "from {} to {}", shortest(low), shortest(high)),
            (low, high) => {
                let low = match low {
                    Unbounded => None,
                    Included(low) => Some(format!("at least {}", shortest(low))),
                    Excluded(low) => Some(format!("above {}", shortest(low))),
                };
                let high = match high {
                    Unbounded => None,
                    Included(high) => Some(format!("at most {}", shortest(high))),
                    Excluded(high) => Some(format!("below {}", shortest(high))),
                };
                write!(f, "{}", low.into_iter().chain(high).collect::<Vec<_>>().join(" and "))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_domain_says_what_it_allows_and_allows_that() {
        for (domain, text, inside, outside) in [
            (Domain::FINITE, "finite", -1e300, f64::NAN),
            (Domain::POSITIVE, "positive", 1e-300, 0.0),
            (Domain::NON_NEGATIVE, "zero or positive", 0.0, -1.0),
            (Domain::from_to(0.3, 10.0), "from 0.3 to 10", 10.0, 10.1),
            (Domain::inside(1.0, 3.0), "above 1 and below 3", 2.0, 3.0),
            (Domain::above_to(0.0, 1.0), "above 0 and at most 1", 1.0, 0.0),
            (Domain::from_below(0.0, 1.0), "at least 0 and below 1", 0.0, 1.0),
            (Domain::below(1.0), "below 1", 0.5, 1.0),
            (Domain::at_least(2.0), "at least 2", 2.0, 1.0),
        ] {
            assert_eq!(domain.to_string(), text);
            assert!(domain.contains(inside) && !domain.contains(outside), "{text}");
        }
    }

    #[test]
    fn a_number_that_is_not_finite_is_told_to_be_finite() {
        let message = |domain: Domain, value| domain.check("radius", value).unwrap_err().to_string();
        let wanted = "radius is inf, but must be a finite number, positive";
        assert_eq!(message(Domain::POSITIVE, f64::INFINITY), wanted);
        assert_eq!(message(Domain::FINITE, f64::NAN), "radius is NaN, but must be finite");
        assert_eq!(message(Domain::POSITIVE, -1e300), "radius is -1e300, but must be positive");
    }
}
