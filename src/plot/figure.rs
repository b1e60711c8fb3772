//! A figure: panels in a grid.

use super::panel::Panel;

/// Panels of equal size in a grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// What the figure shows; not drawn, but told to screen readers and browser tabs.
    pub title: String,
    /// Width on the printed page; the height follows from the panels.
    pub width_mm: f64,
    /// Height of a panel's frame divided by its width.
    pub panel_aspect: f64,
    /// Panels in a row.
    pub columns: usize,
    /// Panels, row by row from the top.
    pub panels: Vec<Panel>,
}

impl Figure {
    /// One column of MNRAS, 84 mm.
    pub fn one_column(title: &str) -> Self {
        Self { width_mm: 84.0, ..Self::full_width(title) }
    }

    /// The full page of MNRAS, 174 mm.
    pub fn full_width(title: &str) -> Self {
        Self { title: title.into(), width_mm: 174.0, panel_aspect: 0.75, columns: 1, panels: Vec::new() }
    }
}
