//! From where to where rays are traced, and the ray that the observer sees on the axis.

/// A stretch of the line of sight; θ and β of its rays are measured from the ray that the observer sees on the axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Span {
    pub chi_start_cmpc: f64,
    pub chi_end_cmpc: f64,
    /// Position (Mpc·arcsec) and slope (arcsec) of the axis ray at the start, and its position at the end.
    pub x_start: [f64; 2],
    pub s_start: [f64; 2],
    pub x_axis_end: [f64; 2],
}

impl Span {
    /// From the observer, where the axis ray is the axis.
    pub fn from_observer(chi_end_cmpc: f64) -> Self {
        let zero = [0.0; 2];
        Self { chi_start_cmpc: 0.0, chi_end_cmpc, x_start: zero, s_start: zero, x_axis_end: zero }
    }

    /// Length L, Mpc.
    pub fn length_cmpc(&self) -> f64 {
        self.chi_end_cmpc - self.chi_start_cmpc
    }

    /// w = χ/L of a plane.
    pub fn weight(&self, chi_cmpc: f64) -> f64 {
        chi_cmpc / self.length_cmpc()
    }
}
