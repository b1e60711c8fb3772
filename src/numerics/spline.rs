//! Not-a-knot cubic spline on equally spaced knots: constant-time value and derivative.

use crate::error::{Domain, Error, Result};

/// Cubic spline through equally spaced knots with not-a-knot ends (de Boor 1978).
///
/// The error inside is about step⁴/384·|f⁗| for the value and step³/24·|f⁗| for the derivative.
/// Cubic polynomials are reproduced exactly.
#[derive(Debug, Clone)]
pub struct UniformSpline {
    start: f64,
    step: f64,
    /// Polynomial coefficients of each interval in t = (x − x_i)/step, lowest order first.
    coefficients: Vec<[f64; 4]>,
}

impl UniformSpline {
    /// Spline through (`start` + i·`step`, `values[i]`); at least four finite values, `step` > 0.
    ///
    /// ```
    /// use haloray::numerics::spline::UniformSpline;
    /// let cubes: Vec<f64> = (0..5).map(|i| f64::from(i).powi(3)).collect();
    /// let spline = UniformSpline::new(0.0, 1.0, &cubes).unwrap();
    /// assert!((spline.value(2.5) - 15.625).abs() < 1e-13);
    /// assert!((spline.derivative(2.5) - 18.75).abs() < 1e-13);
    /// ```
    pub fn new(start: f64, step: f64, values: &[f64]) -> Result<Self> {
        Domain::FINITE.check("start of the spline", start)?;
        Domain::POSITIVE.check("step of the spline", step)?;
        if values.len() < 4 {
            return Err(Error::out_of_range("number of spline knots", values.len(), "at least 4"));
        }
        for &value in values {
            Domain::FINITE.check("value at a spline knot", value)?;
        }
        let curvature = not_a_knot_curvatures(values);
        let coefficients = values
            .windows(2)
            .zip(curvature.windows(2))
            .map(|(y, m)| [y[0], y[1] - y[0] - (2.0 * m[0] + m[1]) / 6.0, 0.5 * m[0], (m[1] - m[0]) / 6.0])
            .collect();
        Ok(Self { start, step, coefficients })
    }

    /// First knot.
    pub fn start(&self) -> f64 {
        self.start
    }

    /// Last knot.
    pub fn end(&self) -> f64 {
        self.start + self.step * self.coefficients.len() as f64
    }

    /// Interval index and position inside it; the end intervals extend beyond the knots.
    #[inline]
    fn locate(&self, x: f64) -> (&[f64; 4], f64) {
        let scaled = (x - self.start) / self.step;
        // The cast saturates: negative numbers and NaN go to the first interval.
        let index = (scaled as usize).min(self.coefficients.len() - 1);
        (&self.coefficients[index], scaled - index as f64)
    }

    /// Value at `x`; outside the knots the end cubics continue.
    #[inline]
    pub fn value(&self, x: f64) -> f64 {
        let (c, t) = self.locate(x);
        c[0] + t * (c[1] + t * (c[2] + t * c[3]))
    }

    /// First derivative at `x`.
    #[inline]
    pub fn derivative(&self, x: f64) -> f64 {
        let (c, t) = self.locate(x);
        (c[1] + t * (2.0 * c[2] + 3.0 * t * c[3])) / self.step
    }
}

/// Second derivatives (times step²) at the knots, from m_{i−1} + 4 m_i + m_{i+1} = 6 δ²y_i.
///
/// A continuous third derivative at the second knot means m_0 = 2 m_1 − m_2, which turns the first
/// equation into m_1 = δ²y_1; likewise at the other end. The rest is tridiagonal.
fn not_a_knot_curvatures(y: &[f64]) -> Vec<f64> {
    let n = y.len();
    let second_difference = |i: usize| y[i - 1] - 2.0 * y[i] + y[i + 1];
    let mut m = vec![0.0; n];
    m[1] = second_difference(1);
    m[n - 2] = second_difference(n - 2);
    if n > 4 {
        // Thomas algorithm for knots 2 to n−3; `upper` holds the eliminated super-diagonal.
        let mut upper = vec![0.0; n];
        for i in 2..n - 2 {
            let mut right = 6.0 * second_difference(i);
            if i == n - 3 {
                right -= m[n - 2];
            }
            let pivot = 4.0 - upper[i - 1];
            upper[i] = 1.0 / pivot;
            m[i] = (right - m[i - 1]) / pivot;
        }
        for i in (2..n - 3).rev() {
            m[i] -= upper[i] * m[i + 1];
        }
    }
    m[0] = 2.0 * m[1] - m[2];
    m[n - 1] = 2.0 * m[n - 2] - m[n - 3];
    m
}
