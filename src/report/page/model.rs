//! What every page is made of, whatever was run: warnings, facts, figures, grids, tables, configuration.

use serde::Serialize;

/// A page.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Page {
    /// The command.
    pub title: String,
    /// What it did.
    pub about: String,
    /// What to know before anything else is believed.
    pub warnings: Vec<String>,
    /// What repeats the run.
    pub repeat: Vec<String>,
    /// The numbers that a person wants first.
    pub facts: Vec<Fact>,
    /// Text of a result, paragraph by paragraph.
    pub paragraphs: Vec<String>,
    /// Maps and images to be explored.
    pub grids: Vec<GridSet>,
    /// Parameters of a posterior, whose panels can be chosen.
    pub posterior: Vec<PosteriorParameter>,
    /// Figures as drawn.
    pub figures: Vec<PageFigure>,
    /// Which figures the page has no room for, in words; empty where it has.
    pub figures_left_out: String,
    /// Tables, the most important first.
    pub tables: Vec<PageTable>,
    /// Pages of parts of the run: folder and title.
    pub parts: Vec<[String; 2]>,
    /// Files of the run with what they are.
    pub files: Vec<[String; 2]>,
    /// The configuration as TOML.
    pub configuration: String,
    /// Version, revision, seed.
    pub versions: Vec<[String; 2]>,
    /// What to cite.
    pub citations: Vec<&'static str>,
    /// Terms of the page with what they mean.
    pub glossary: Vec<Term>,
}

/// A name as it is shown.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Label {
    /// On the line.
    pub text: String,
    /// Lowered.
    pub sub: String,
    /// Unit; empty for pure numbers.
    pub unit: String,
    /// Anchor of the glossary's entry; empty where there is none.
    pub term: String,
}

/// A named number or word.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Fact {
    /// What.
    pub label: Label,
    /// How much.
    pub value: String,
}

/// A table that sorts.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct PageTable {
    /// Anchor.
    pub id: String,
    /// What it holds.
    pub title: String,
    /// More words; empty for none.
    pub note: String,
    /// Heads.
    pub columns: Vec<Label>,
    /// Rows.
    pub rows: Vec<Vec<Cell>>,
    /// Shown only on request.
    pub is_folded: bool,
}

/// A cell of a table.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cell {
    /// As it is read.
    pub text: String,
    /// As it is sorted, where it is a number.
    pub value: Option<f64>,
    /// Set where it is the name of a quantity.
    pub label: Option<Label>,
}

/// A figure.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PageFigure {
    /// Anchor.
    pub id: String,
    /// What it is called.
    pub title: String,
    /// What am I looking at?
    pub caption: String,
    /// An `<svg>` or an `<img>`.
    pub markup: String,
    /// Width on a printed page, in millimetres.
    pub width_mm: f64,
    /// Colour of its page; empty for that of the page it is in.
    pub page_colour: String,
}

/// Grids over one field, of which one is shown at a time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GridSet {
    /// Anchor.
    pub id: String,
    /// What it shows.
    pub title: String,
    /// The grids.
    pub grids: Vec<Grid>,
}

/// A map or image.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Grid {
    /// What is shown.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Rows and columns.
    pub shape: [usize; 2],
    /// Left, right, bottom and top edge, arcsec.
    pub extent_arcsec: [f64; 4],
    /// `signed` fields have colours about zero, `light` a stretch for faint parts.
    pub kind: GridKind,
    /// Float32, little-endian, base64, bottom row first; empty where it is made from others.
    pub data: String,
    /// Made of those grids of the set: the first minus the second.
    pub difference_of: Option<[usize; 2]>,
}

/// A parameter of a posterior.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PosteriorParameter {
    /// Name in the model.
    pub name: String,
    /// Label in markup.
    pub label: String,
    /// Unit; empty for pure numbers.
    pub unit: String,
    /// Median and 68% interval in words.
    pub interval_text: String,
    /// Median of all draws.
    pub median: f64,
    /// Ends of the 68% highest-density interval of all draws.
    pub interval: [f64; 2],
    /// Some of the draws less the median: float32, little-endian, base64.
    pub draws: String,
    /// How many there are in all.
    pub number_of_draws: usize,
    /// Shown before a choice is made.
    pub is_shown: bool,
}

/// What colours suit a grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum GridKind {
    /// Of either sign.
    Signed,
    /// Not below zero.
    Positive,
    /// Surface brightness.
    Light,
}

/// An entry of the glossary.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Term {
    /// Anchor.
    pub id: String,
    /// The term.
    pub name: String,
    /// What it means.
    pub meaning: String,
}
