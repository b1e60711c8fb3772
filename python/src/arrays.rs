//! Arrays across the border: float64 columns in without a copy, results out without a copy.

use haloray::Error;
use haloray::mapping::{Mapping, Order, RayBundle};
use haloray::monitor::Monitor;
use numpy::{PyArray, PyArray1, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;

use crate::errors::{OrRaise, input};

/// A column as Python hands it over: float64, contiguous.
pub type Column<'py> = PyReadonlyArray1<'py, f64>;

/// Rays that are traced together: adaptive tracing prepares its tiles and checks itself anew in every call, so that few large
/// calls cost less; a million rays with all derivatives take a hundred megabytes meanwhile.
const CHUNK: usize = 1 << 20;

/// The numbers of a column.
pub fn numbers<'a>(py: Python<'_>, name: &str, column: &'a Column<'_>) -> PyResult<&'a [f64]> {
    column.as_slice().map_err(|_| input(py, name, "not contiguous", "a contiguous array of float64"))
}

/// The coordinates of points: as many x as y, all finite.
pub fn points<'a>(py: Python<'_>, names: [&str; 2], [x, y]: [&'a Column<'_>; 2]) -> PyResult<[&'a [f64]; 2]> {
    let [x, y] = [numbers(py, names[0], x)?, numbers(py, names[1], y)?];
    if x.len() != y.len() {
        let allowed = format!("that of {} ({})", names[0], x.len());
        return Err(input(py, &format!("length of {}", names[1]), y.len(), &allowed));
    }
    for (name, column) in names.iter().zip([x, y]) {
        if let Some(i) = column.iter().position(|v| !v.is_finite()) {
            return Err(input(py, &format!("{name}[{i}]"), column[i], "a finite number"));
        }
    }
    Ok([x, y])
}

/// Positions and derivatives of traced rays, ray by ray; derivatives beyond the order asked for are empty.
#[derive(Default)]
pub struct Traced {
    beta: [Vec<f64>; 2],
    /// Four a ray.
    jacobian: Vec<f64>,
    /// Eight a ray, b_ijk with j and k in both orders.
    second: Vec<f64>,
}

impl Traced {
    fn with_room(rays: usize, order: Order) -> Self {
        let room = |from: Order, numbers: usize| if order >= from { rays * numbers } else { 0 };
        Self {
            beta: [Vec::with_capacity(rays), Vec::with_capacity(rays)],
            jacobian: Vec::with_capacity(room(Order::Jacobian, 4)),
            second: Vec::with_capacity(room(Order::SecondDerivatives, 8)),
        }
    }

    fn extend(&mut self, rays: &RayBundle) {
        for (c, column) in self.beta.iter_mut().enumerate() {
            column.extend(rays.beta_arcsec.iter().map(|beta| beta[c]));
        }
        self.jacobian.extend_from_slice(rays.jacobian.as_flattened());
        for [xxx, xxy, xyy, yxx, yxy, yyy] in &rays.second_per_arcsec {
            self.second.extend([xxx, xxy, xxy, xyy, yxx, yxy, yxy, yyy]);
        }
    }

    /// (β_x, β_y, Jacobian (n, 2, 2) or None, second derivatives (n, 2, 2, 2) or None).
    pub fn into_python(self, py: Python<'_>, order: Order) -> PyResult<Bound<'_, PyAny>> {
        let n = self.beta[0].len();
        let [x, y] = self.beta.map(|column| PyArray1::from_vec(py, column));
        let jacobian = match order >= Order::Jacobian {
            true => Some(PyArray1::from_vec(py, self.jacobian).reshape([n, 2, 2])?),
            false => None,
        };
        let second: Option<Bound<'_, PyArray<f64, _>>> = match order >= Order::SecondDerivatives {
            true => Some(PyArray1::from_vec(py, self.second).reshape([n, 2, 2, 2])?),
            false => None,
        };
        Ok((x, y, jacobian, second).into_pyobject(py)?.into_any())
    }
}

/// Traces the rays (x, y), a million of them at a time.
pub fn trace(
    mapping: &dyn Mapping,
    [x, y]: [&[f64]; 2],
    order: Order,
    monitor: &dyn Monitor,
) -> haloray::Result<Traced> {
    let mut all = Traced::with_room(x.len(), order);
    for (x, y) in x.chunks(CHUNK).zip(y.chunks(CHUNK)) {
        let theta: Vec<[f64; 2]> = x.iter().zip(y).map(|(x, y)| [*x, *y]).collect();
        all.extend(&mapping.trace(&theta, order, monitor)?);
    }
    Ok(all)
}

/// The order of that number.
pub fn order(py: Python<'_>, number: u8) -> PyResult<Order> {
    const ORDERS: [Order; 3] = [Order::Position, Order::Jacobian, Order::SecondDerivatives];
    let found = ORDERS.get(usize::from(number)).copied();
    found.ok_or_else(|| Error::out_of_range("order", number, "0, 1 or 2")).or_raise(py)
}

/// A square map (y, x) as an array.
pub fn square<'py>(py: Python<'py>, values: Vec<f64>, side: usize) -> PyResult<Bound<'py, PyAny>> {
    Ok(PyArray1::from_vec(py, values).reshape([side, side])?.into_any())
}

/// Pairs as an array (n, 2).
pub fn pairs<'py>(py: Python<'py>, values: &[[f64; 2]]) -> PyResult<Bound<'py, PyAny>> {
    Ok(PyArray1::from_slice(py, values.as_flattened()).reshape([values.len(), 2])?.into_any())
}
