//! The styles in which a figure can be written, one table each: colours, size of letters, width of lines.

use super::colour::Colour;

/// How a figure is written: what stands for the colours of `Colour` where they lie on the page and not on a picture, and how
/// large letters and how thick lines are beside the page.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Style {
    /// By which it is asked for.
    pub name: &'static str,
    /// Magnifies letters, lines, marks and gaps; the page keeps its width, so that panels have less room.
    pub magnification: f64,
    /// Lines are so much thicker besides.
    pub line_width: f64,
    /// Colours that give way to others.
    pub colours: &'static [(Colour, Colour)],
}

impl Style {
    /// 7 and 8 pt on a page of MNRAS, black on white.
    pub const SCREEN: Self = Self { name: "screen", magnification: 1.0, line_width: 1.0, colours: &[] };

    /// Scripts, the smallest letters, have 6 pt: 0.72 of 8.4 pt.
    pub const PAPER: Self = Self { name: "paper", magnification: 1.2, line_width: 0.9, colours: &[] };

    /// Light on the dark page of reports.
    pub const DARK: Self = Self {
        name: "dark",
        magnification: 1.0,
        line_width: 1.1,
        colours: &[
            (Colour::WHITE, Colour(20, 22, 26)),
            (Colour::BLACK, Colour(230, 232, 236)),
            (Colour::GREY, Colour(165, 172, 184)),
            (Colour::BLUE, Colour(86, 160, 240)),
            (Colour::ORANGE, Colour(240, 140, 60)),
            (Colour::GREEN, Colour(44, 199, 154)),
            (Colour::PURPLE, Colour(226, 154, 196)),
            (Colour::RED, Colour(255, 107, 107)),
        ],
    };

    /// The style of that name, the first where there is none.
    pub fn named(name: &str) -> Self {
        [Self::SCREEN, Self::PAPER, Self::DARK].into_iter().find(|s| s.name == name).unwrap_or(Self::SCREEN)
    }

    /// What stands for a colour.
    pub fn colour(&self, colour: Colour) -> Colour {
        self.colours.iter().find(|(own, _)| *own == colour).map_or(colour, |(_, other)| *other)
    }
}
