//! Orders that are declared: of the rooms, and of the parts of some rooms.

use crate::house::Arrows;

/// Parts of a folder, each of which may import those before it and none after it.
pub struct Order {
    /// The folder below `src`; empty for the rooms themselves.
    pub folder: &'static str,
    /// Files without `.rs`, and folders.
    pub parts: &'static [&'static str],
}

/// The rooms, as in docs/ARCHITECTURE.md, and the parts of those rooms that have an order of their own.
///
/// A folder inside such a room must be named; a file there may be, and is held by the rule on circles otherwise.
pub const ORDERS: [Order; 8] = [
    Order {
        folder: "",
        parts: &[
            "constants",
            "error",
            "monitor",
            "numerics",
            "profile",
            "cosmology",
            "halo",
            "mapping",
            "diagnostics",
            "imaging",
            "inference",
            "mock",
            "config",
            "pipeline",
            "io",
            "ensemble",
            "plot",
            "report",
        ],
    },
    Order { folder: "mapping", parts: &["centre", "multiplane", "tidal"] },
    Order {
        folder: "mapping/multiplane",
        parts: &[
            "plane",
            "kick",
            "delay",
            "recursion",
            "span",
            "segment",
            "line_of_sight",
            "near_axis",
            "general",
            "centres",
            "adaptive",
        ],
    },
    Order {
        folder: "inference",
        parts: &["parameter", "model", "likelihood", "optimise", "sample", "diagnose", "run", "fit"],
    },
    Order { folder: "io", parts: &["containers", "documents"] },
    Order {
        folder: "inference/sample",
        parts: &["whitening", "point", "chains", "ensemble", "nested", "nuts", "valley"],
    },
    Order {
        folder: "plot",
        parts: &[
            "colour",
            "figure_style",
            "font",
            "scale",
            "markup",
            "svg",
            "style",
            "ticks",
            "colour_scale",
            "mark",
            "contour",
            "density",
            "panel",
            "figure",
            "layout",
            "raster_picture",
            "draw_marks",
            "axes",
            "colour_bar",
            "legend",
            "png",
            "pdf",
            "render",
            "figures",
        ],
    },
    Order {
        folder: "report",
        parts: &[
            "number_text",
            "staged",
            "page",
            "curve_figure",
            "exposure_figure",
            "study_figures",
            "ensemble_figures",
            "ensemble_folder",
            "catalogue_report",
            "run_figures",
            "run_folder",
            "fit_warnings",
            "fit_folder",
        ],
    },
];

impl Order {
    /// Place in the order of the part that a file below `src` belongs to, if it is named.
    fn rank(&self, file: &str) -> Option<usize> {
        let part = part_of(self.folder, file)?;
        self.parts.iter().position(|name| *name == part.trim_end_matches(".rs"))
    }

    /// Imports of parts that come after the importing file's own.
    pub fn arrows_against(&self, arrows: &Arrows) -> Vec<String> {
        let mut against = Vec::new();
        for (file, imported) in arrows {
            let Some(own) = self.rank(file) else { continue };
            let later = imported.iter().filter(|other| self.rank(other).is_some_and(|rank| rank > own));
            against.extend(later.map(|other| format!("{file} imports {other}")));
        }
        against
    }

    /// Parts that must be named and are not: every room, and every folder inside a room with an order.
    pub fn unnamed<'a>(&self, files: impl Iterator<Item = &'a String>) -> Vec<&'a str> {
        let parts = files.filter_map(|file| part_of(self.folder, file).map(|part| (file, part)));
        let must =
            parts.filter(|(_, part)| !part.ends_with(".rs") || self.folder.is_empty() && *part != "lib.rs");
        must.filter(|(file, _)| self.rank(file).is_none()).map(|(_, part)| part).collect()
    }
}

/// The child of `folder` that is the file or holds it; the folder's own `mod.rs` is none of its parts.
pub fn part_of<'a>(folder: &str, file: &'a str) -> Option<&'a str> {
    let inside = if folder.is_empty() { file } else { file.strip_prefix(folder)?.strip_prefix('/')? };
    inside.split('/').next().filter(|part| *part != "mod.rs")
}
