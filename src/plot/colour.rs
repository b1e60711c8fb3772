//! Colours of marks, strokes, and the colour maps of rasters.

use std::fmt;

/// An sRGB colour: red, green, blue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Colour(pub u8, pub u8, pub u8);

/// The first colours stay apart for colour-blind readers (Okabe & Ito 2008, "Color Universal Design").
impl Colour {
    pub const BLACK: Self = Self(0, 0, 0);
    pub const WHITE: Self = Self(255, 255, 255);
    /// Grey of notes and guide lines.
    pub const GREY: Self = Self(110, 110, 110);
    pub const BLUE: Self = Self(0, 114, 178);
    pub const ORANGE: Self = Self(213, 94, 0);
    pub const GREEN: Self = Self(0, 158, 115);
    pub const PURPLE: Self = Self(204, 121, 167);
    /// Red, for what must stand out against blue.
    pub const RED: Self = Self(200, 24, 38);

    /// The colour of the n-th curve of a panel.
    pub fn of_curve(n: usize) -> Self {
        const CYCLE: [Colour; 5] =
            [Colour::BLUE, Colour::ORANGE, Colour::GREEN, Colour::PURPLE, Colour::BLACK];
        CYCLE[n % CYCLE.len()]
    }
}

impl fmt::Display for Colour {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "#{:02x}{:02x}{:02x}", self.0, self.1, self.2)
    }
}

/// How a line is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stroke {
    pub colour: Colour,
    /// Width in points on the printed page.
    pub width_pt: f64,
    pub is_dashed: bool,
}

impl Stroke {
    pub const fn solid(colour: Colour, width_pt: f64) -> Self {
        Self { colour, width_pt, is_dashed: false }
    }

    /// Curve number `n` of a panel: dashed where the colours begin again.
    pub fn of_curve(n: usize, width_pt: f64) -> Self {
        let colour = Colour::of_curve(n);
        Self { colour, width_pt, is_dashed: (0..n).any(|former| Colour::of_curve(former) == colour) }
    }

    pub const fn dashed(colour: Colour, width_pt: f64) -> Self {
        Self { colour, width_pt, is_dashed: true }
    }
}

/// A perceptual colour map, dark to light or cold to warm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColourMap {
    /// Blue to yellow (van der Walt & Smith 2015).
    Viridis,
    /// Black to yellow.
    Inferno,
    /// Black to pale yellow.
    Magma,
    /// Blue through white to red, for signed fields.
    Diverging,
}

impl ColourMap {
    /// The colour of what is written on it, and that of an outline about it: most colours of a map are dark.
    pub fn ink(self) -> [Colour; 2] {
        if self == Self::Diverging { [Colour::BLACK, Colour::WHITE] } else { [Colour::WHITE, Colour::BLACK] }
    }

    /// Colour at `t` in 0..=1; outside, the end's colour.
    pub fn at(self, t: f64) -> Colour {
        let t = t.clamp(0.0, 1.0);
        let colour = match self {
            Self::Viridis => colorous::VIRIDIS.eval_continuous(t),
            Self::Inferno => colorous::INFERNO.eval_continuous(t),
            Self::Magma => colorous::MAGMA.eval_continuous(t),
            Self::Diverging => colorous::RED_BLUE.eval_continuous(1.0 - t),
        };
        Colour(colour.r, colour.g, colour.b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn diverging_is_blue_below_and_red_above() {
        let (low, middle, high) =
            (ColourMap::Diverging.at(0.0), ColourMap::Diverging.at(0.5), ColourMap::Diverging.at(1.0));
        assert!(low.2 > low.0 && high.0 > high.2);
        assert!(middle.0 > 230 && middle.1 > 230 && middle.2 > 230);
    }

    #[test]
    fn perceptual_maps_brighten_throughout() {
        let luminance =
            |c: Colour| 0.2126 * f64::from(c.0) + 0.7152 * f64::from(c.1) + 0.0722 * f64::from(c.2);
        for map in [ColourMap::Viridis, ColourMap::Inferno, ColourMap::Magma] {
            let steps: Vec<f64> = (0..=20).map(|i| luminance(map.at(f64::from(i) / 20.0))).collect();
            assert!(steps.windows(2).all(|pair| pair[1] > pair[0]), "{map:?}");
        }
    }
}
