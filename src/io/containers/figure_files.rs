//! As what the figures of a folder are written.

/// As what figures are written, and how they look; SVG and PNG of the first style where nobody says otherwise.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FigureFiles {
    /// Extensions; none for no figures.
    pub extensions: Vec<&'static str>,
    /// Name of the style.
    pub style: &'static str,
}

impl Default for FigureFiles {
    fn default() -> Self {
        Self { extensions: vec!["svg", "png"], style: "" }
    }
}
