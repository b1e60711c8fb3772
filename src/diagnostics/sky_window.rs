//! The square of sky in which images and critical curves are looked for.

use crate::error::{Result, require};

/// A square window with the cell size from which a search starts, and directions where lenses are singular.
#[derive(Debug, Clone, PartialEq)]
pub struct SkyWindow {
    /// Middle of the window, arcsec.
    pub centre_arcsec: [f64; 2],
    /// Half the side of the window, arcsec.
    pub half_width_arcsec: f64,
    /// Cells a side at the start; structure smaller than a cell may be missed away from the lens centres.
    pub cells: usize,
    /// Directions in which lens centres are seen: refined whatever their surroundings look like.
    pub lens_centres_arcsec: Vec<[f64; 2]>,
}

impl SkyWindow {
    /// Default number of cells a side.
    pub const CELLS: usize = 32;

    /// A window about the axis with [`Self::CELLS`] cells a side.
    ///
    /// # Errors
    /// Unless the half width is positive and finite.
    pub fn about_axis(half_width_arcsec: f64, lens_centres_arcsec: Vec<[f64; 2]>) -> Result<Self> {
        require(half_width_arcsec > 0.0, "half_width_arcsec", half_width_arcsec, "positive")?;
        Ok(Self { centre_arcsec: [0.0; 2], half_width_arcsec, cells: Self::CELLS, lens_centres_arcsec })
    }

    /// The same window with twice the cells a side.
    pub(super) fn finer(&self) -> Self {
        Self { cells: 2 * self.cells, ..self.clone() }
    }

    /// Half the side of a cell, arcsec.
    pub(super) fn half_cell_arcsec(&self) -> f64 {
        self.half_width_arcsec / self.cells as f64
    }

    /// The cell corner (i, j), counted from the bottom left.
    pub(super) fn node(&self, i: usize, j: usize) -> [f64; 2] {
        let side = 2.0 * self.half_cell_arcsec();
        let at = |c: usize, k: usize| self.centre_arcsec[c] - self.half_width_arcsec + side * k as f64;
        [at(0, i), at(1, j)]
    }

    /// True inside the window or on its edge.
    pub fn contains(&self, theta: [f64; 2]) -> bool {
        (0..2).all(|c| (theta[c] - self.centre_arcsec[c]).abs() <= self.half_width_arcsec)
    }
}
