//! Points to trace and rays that were traced, as tables.

use std::path::Path;

use crate::error::{Error, Result, TableKind};
use crate::io::containers::{Column, Table};
use crate::mapping::RayBundle;

/// Name of the HDF5 group or FITS extension with points on the sky.
const POINTS_GROUP: &str = "points";
/// Name of the HDF5 group or FITS extension with traced rays.
pub const RAYS_GROUP: &str = "rays";

/// The columns of a point.
const COLUMNS: [&str; 2] = ["theta_x_arcsec", "theta_y_arcsec"];

/// A table of directions, and what else it held.
#[derive(Debug, Clone)]
pub struct Points {
    /// Directions θ in arcsec.
    pub theta_arcsec: Vec<[f64; 2]>,
    table: Table,
}

/// Names of the Jacobian columns, a_ij = ∂β_i/∂θ_j.
const JACOBIAN: [&str; 4] = ["a_xx", "a_xy", "a_yx", "a_yy"];

/// Names of the second derivatives, b_ijk = ∂²β_i/∂θ_j∂θ_k.
const SECOND: [&str; 6] = ["b_xxx", "b_xxy", "b_xyy", "b_yxx", "b_yxy", "b_yyy"];

/// Reads `theta_x_arcsec,theta_y_arcsec`, in arcsec or in the unit that they state, and keeps all other columns.
///
/// # Errors
/// As [`Table::read`], [`Table::in_own_units`] and [`Table::required_f64`].
pub fn read_points(path: &Path) -> Result<Points> {
    let of_points = |error: Error| error.in_table(TableKind::Points);
    let table = Table::read(path, POINTS_GROUP).and_then(|table| table.in_own_units(&COLUMNS));
    let table = table.map_err(of_points)?;
    let [x, y] = COLUMNS.map(|name| table.required_f64(name).map_err(of_points));
    let [x, y] = [x?, y?];
    let theta_arcsec = x.iter().zip(y).map(|(x, y)| [*x, *y]).collect();
    Ok(Points { theta_arcsec, table })
}

/// The points with where they come from: β, then A, then b as far as the bundle has them.
///
/// Columns of the points that have the name of a result are replaced by it.
///
/// # Errors
/// Never for a bundle traced from these points.
pub fn ray_table(points: &Points, rays: &RayBundle) -> Result<Table> {
    let mut results: Vec<Column> = Vec::new();
    let beta = |i: usize| rays.beta_arcsec.iter().map(|b| b[i]).collect();
    results.push(Column::f64("beta_x_arcsec", Some("arcsec"), beta(0)));
    results.push(Column::f64("beta_y_arcsec", Some("arcsec"), beta(1)));
    if !rays.jacobian.is_empty() {
        for (i, name) in JACOBIAN.iter().enumerate() {
            results.push(Column::f64(name, None, rays.jacobian.iter().map(|a| a[i]).collect()));
        }
    }
    if !rays.second_per_arcsec.is_empty() {
        for (i, name) in SECOND.iter().enumerate() {
            let values = rays.second_per_arcsec.iter().map(|b| b[i]).collect();
            results.push(Column::f64(name, Some("arcsec^-1"), values));
        }
    }
    points.with(results)
}

impl Points {
    /// The points' own columns and these; columns of the points that have the name of a result are replaced by it.
    ///
    /// # Errors
    /// When a result has not one row a point.
    pub fn with(&self, results: Vec<Column>) -> Result<Table> {
        let is_result = |c: &&Column| results.iter().any(|r| r.name.eq_ignore_ascii_case(&c.name));
        let kept: Vec<Column> = self.table.columns().iter().filter(|c| !is_result(c)).cloned().collect();
        let names: Vec<String> = kept.iter().map(|column| column.name.clone()).collect();
        let table = Table::new(kept.into_iter().chain(results).collect())?;
        Ok(table.with_gaps_in(names.iter().map(String::as_str)))
    }
}
