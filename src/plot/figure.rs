//! A figure: panels in a grid.

use super::panel::Panel;

/// Panels of equal size in a grid, to be written as SVG and PNG.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// What the figure shows; not drawn, but told to screen readers and browser tabs.
    pub(crate) title: String,
    /// Width on the printed page; the height follows from the panels.
    pub(crate) width_mm: f64,
    /// Height of a panel's frame divided by its width.
    pub(crate) panel_aspect: f64,
    /// Panels in a row.
    pub(crate) columns: usize,
    /// Panels, row by row from the top.
    pub(crate) panels: Vec<Panel>,
}

impl Figure {
    /// One column of MNRAS.
    pub(crate) const ONE_COLUMN_MM: f64 = 84.0;

    /// One panel in one column of MNRAS.
    pub(crate) fn one_column(title: &str, panel_aspect: f64, panel: Panel) -> Self {
        Self { width_mm: Self::ONE_COLUMN_MM, ..Self::full_width(title, panel_aspect, 1, [panel]) }
    }

    /// The full page of MNRAS, 174 mm.
    pub(crate) fn full_width(
        title: &str,
        panel_aspect: f64,
        columns: usize,
        panels: impl IntoIterator<Item = Panel>,
    ) -> Self {
        let panels = panels.into_iter().collect();
        Self { title: title.into(), width_mm: 174.0, panel_aspect, columns: columns.max(1), panels }
    }
}
