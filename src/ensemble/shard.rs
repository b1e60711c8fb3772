//! A part of an ensemble: shard I of K has an unbroken run of its sightlines.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

use crate::error::{Error, Result};

/// Shard `index` of `count`, counted from 1 and written "2/8".
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    index: u64,
    count: u64,
}

impl Shard {
    /// Everything.
    pub const WHOLE: Self = Self { index: 1, count: 1 };

    /// The numbers of this shard among those of the whole: shards differ by one number at most.
    pub fn numbers(self, whole: &Range<u64>) -> Range<u64> {
        let length = u128::from(whole.end - whole.start);
        let at = |i: u64| whole.start + (length * u128::from(i) / u128::from(self.count)) as u64;
        at(self.index - 1)..at(self.index)
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}/{}", self.index, self.count)
    }
}

impl FromStr for Shard {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let numbers = text.split_once('/').and_then(|(i, k)| Some((i.parse().ok()?, k.parse().ok()?)));
        match numbers {
            Some((index, count)) if (1..=count).contains(&index) => Ok(Self { index, count }),
            _ => Err(Error::out_of_range("shard", text, "I/K with 1 ≤ I ≤ K, such as 2/8")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_are_the_whole_without_gap_or_overlap() {
        for (whole, count) in [(5..105, 7), (0..3, 5), (0..20, 20), (7..7, 2), (u64::MAX - 9..u64::MAX, 4)] {
            let mut next = whole.start;
            for index in 1..=count {
                let part = Shard { index, count }.numbers(&whole);
                assert_eq!(part.start, next);
                let fair = (whole.end - whole.start) / count;
                assert!((fair..=fair + 1).contains(&(part.end - part.start)));
                next = part.end;
            }
            assert_eq!(next, whole.end);
        }
        assert_eq!(Shard::WHOLE.numbers(&(3..9)), 3..9);
    }

    #[test]
    fn what_is_no_shard_is_refused() {
        assert_eq!("2/8".parse::<Shard>().unwrap().to_string(), "2/8");
        for text in ["", "0/4", "5/4", "1", "1/0", "-1/3", "1/2/3", "a/b", "1.0/2"] {
            assert!(text.parse::<Shard>().unwrap_err().is_bad_input(), "{text}");
        }
    }
}
