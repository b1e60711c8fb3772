//! The square of sky in which images and critical curves are looked for.

use crate::error::{Domain, Result};
use crate::mapping::{Mapping, Order};

/// Points on each side of the edge where the deflection is measured.
const POINTS_PER_SIDE: usize = 48;
/// A window is widened at least by this factor, and at most so often: 1e4 in all.
const WIDENING: f64 = 1.25;
const WIDENINGS: usize = 42;
/// Room beyond what deflection and lens centres need.
const ROOM: f64 = 1.05;
/// Most cells a side of a widened window; beyond it cells grow.
const WIDE_CELLS_MAX: usize = 256;

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
        Domain::POSITIVE.check("half_width_arcsec", half_width_arcsec)?;
        Ok(Self { centre_arcsec: [0.0; 2], half_width_arcsec, cells: Self::CELLS, lens_centres_arcsec })
    }

    /// Largest |β − θ| on the edge of the window, arcsec; infinite where it is not a number.
    pub(super) fn edge_deflection_arcsec(&self, mapping: &(impl Mapping + ?Sized)) -> f64 {
        let theta: Vec<[f64; 2]> = (0..4 * POINTS_PER_SIDE)
            .map(|i| {
                let along = 2.0 * (i % POINTS_PER_SIDE) as f64 / POINTS_PER_SIDE as f64 - 1.0;
                let [u, v] =
                    [[along, -1.0], [1.0, along], [-along, 1.0], [-1.0, -along]][i / POINTS_PER_SIDE];
                [0, 1].map(|c| self.centre_arcsec[c] + self.half_width_arcsec * [u, v][c])
            })
            .collect();
        let beta = mapping.map(&theta, Order::Position).beta_arcsec;
        let bends = theta.iter().zip(&beta).map(|(t, b)| (t[0] - b[0]).hypot(t[1] - b[1]));
        bends.fold(0.0, |most, bend| if bend.is_finite() { bend.max(most) } else { f64::INFINITY })
    }

    /// This window, or a wider one, whose edge lies further from `source` than rays there are deflected, with all lens
    /// centres inside: rays from beyond it do not come from the source unless the deflection grows outwards again.
    ///
    /// `None` where no such window is found, as for a lens whose deflection grows as fast as the window.
    pub(super) fn around_images(&self, mapping: &(impl Mapping + ?Sized), source: [f64; 2]) -> Option<Self> {
        let from_centre =
            |p: &[f64; 2]| (0..2).map(|c| (p[c] - self.centre_arcsec[c]).abs()).fold(0.0, f64::max);
        let furthest_lens = self.lens_centres_arcsec.iter().map(from_centre).fold(0.0, f64::max);
        let mut window = self.clone();
        for _ in 0..WIDENINGS {
            let reach = from_centre(&source) + window.edge_deflection_arcsec(mapping);
            let needed = if furthest_lens >= window.half_width_arcsec { ROOM * furthest_lens } else { 0.0 };
            if reach < window.half_width_arcsec && needed == 0.0 {
                return Some(window);
            }
            let half_width_arcsec = (WIDENING * window.half_width_arcsec).max(needed);
            let cells = (self.cells as f64 * half_width_arcsec / self.half_width_arcsec).ceil() as usize;
            window = Self { half_width_arcsec, cells: cells.min(WIDE_CELLS_MAX.max(self.cells)), ..window };
        }
        None
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
