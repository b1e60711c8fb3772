//! Polynomials of several variables: all monomials up to a degree.

use nalgebra::DVector;
use serde::{Deserialize, Serialize};

/// All monomials of x up to a degree, by degree; the first is 1.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(from = "[usize; 2]", into = "[usize; 2]")]
pub(super) struct Monomials {
    dimension: usize,
    degree: usize,
    /// Of the monomials after the first: the number of an earlier one, and the coordinate that multiplies it.
    factors: Vec<(usize, usize)>,
    degrees: Vec<usize>,
}

impl From<[usize; 2]> for Monomials {
    fn from([dimension, degree]: [usize; 2]) -> Self {
        Self::new(dimension, degree)
    }
}

impl From<Monomials> for [usize; 2] {
    fn from(monomials: Monomials) -> Self {
        [monomials.dimension, monomials.degree]
    }
}

impl Monomials {
    /// The monomials of that many variables.
    pub fn new(dimension: usize, degree: usize) -> Self {
        let (mut factors, mut degrees) = (vec![], vec![0]);
        // The last coordinate of each monomial; later ones multiply it, so that none comes twice.
        let mut last = vec![0];
        for of in 1..=degree {
            for parent in (0..degrees.len()).filter(|i| degrees[*i] + 1 == of).collect::<Vec<_>>() {
                for coordinate in last[parent]..dimension {
                    factors.push((parent, coordinate));
                    degrees.push(of);
                    last.push(coordinate);
                }
            }
        }
        Self { dimension, degree, factors, degrees }
    }

    /// How many there are of that many variables: (dimension + degree)!/(dimension! degree!).
    pub fn count(dimension: usize, degree: usize) -> usize {
        (1..=degree).fold(1, |count, k| count * (dimension + k) / k)
    }

    /// The degree of each.
    pub fn degrees(&self) -> &[usize] {
        &self.degrees
    }

    /// The value of each.
    pub fn values(&self, x: &[f64]) -> Vec<f64> {
        let mut values = Vec::with_capacity(self.degrees.len());
        values.push(1.0);
        for &(parent, coordinate) in &self.factors {
            values.push(values[parent] * x[coordinate]);
        }
        values
    }

    /// ∂/∂x of each, a row a monomial, where `values` are theirs.
    pub fn slopes(&self, x: &[f64], values: &[f64]) -> Vec<f64> {
        let d = self.dimension;
        let mut slopes = vec![0.0; d * values.len()];
        for (i, &(parent, coordinate)) in self.factors.iter().enumerate() {
            let (earlier, own) = slopes.split_at_mut(d * (i + 1));
            let parents = &earlier[d * parent..d * (parent + 1)];
            own.iter_mut().zip(parents).for_each(|(slope, of_parent)| *slope = of_parent * x[coordinate]);
            own[coordinate] += values[parent];
        }
        slopes
    }

    /// The polynomial of these coefficients, and its ∂/∂x: backwards through the factors, at three times the cost of a value.
    pub fn polynomial(&self, coefficients: &[f64], x: &[f64]) -> (f64, DVector<f64>) {
        let values = self.values(x);
        let value = values.iter().zip(coefficients).map(|(value, c)| value * c).sum();
        let mut by_value = coefficients.to_vec();
        let mut slope = DVector::zeros(self.dimension);
        for (i, &(parent, coordinate)) in self.factors.iter().enumerate().rev() {
            let by_own = by_value[i + 1];
            by_value[parent] += by_own * x[coordinate];
            slope[coordinate] += by_own * values[parent];
        }
        (value, slope)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::profile::mass::derivative_checks::derivative;

    #[test]
    fn there_are_as_many_as_the_binomial_says_and_no_two_are_alike() {
        for (dimension, degree) in [(1, 4), (2, 2), (3, 4), (8, 3)] {
            let monomials = Monomials::new(dimension, degree);
            assert_eq!(monomials.degrees().len(), Monomials::count(dimension, degree));
            // Logarithms of primes: equal values mean equal monomials.
            let primes = [2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0];
            let mut values = monomials.values(&primes[..dimension]);
            values.sort_by(f64::total_cmp);
            assert!(values.windows(2).all(|pair| pair[0] < pair[1]));
        }
    }

    #[test]
    fn slopes_are_those_of_the_values() {
        let monomials = Monomials::new(3, 4);
        let x = [0.3, -1.2, 0.7];
        let slopes = monomials.slopes(&x, &monomials.values(&x));
        for a in 0..3 {
            for i in 0..monomials.degrees().len() {
                let moved = |v: f64| {
                    let mut x = x;
                    x[a] = v;
                    monomials.values(&x)[i]
                };
                assert!((slopes[3 * i + a] - derivative(moved, x[a], 1e-2)).abs() < 1e-8);
            }
        }
        let coefficients: Vec<f64> = (0..slopes.len() / 3).map(|i| (i as f64).sin()).collect();
        let sum = |of: &[f64], step| -> f64 {
            of.iter().step_by(step).zip(&coefficients).map(|(a, c)| a * c).sum()
        };
        let (value, slope) = monomials.polynomial(&coefficients, &x);
        assert!((value - sum(&monomials.values(&x), 1)).abs() < 1e-13);
        assert!((0..3).all(|a| (slope[a] - sum(&slopes[a..], 3)).abs() < 1e-12));
    }
}
