//! The embedded font: its database for the renderer, and the widths of its characters for the layout.

use std::sync::{Arc, LazyLock};

use resvg::usvg::fontdb::Database;
use skrifa::instance::{LocationRef, Size};
use skrifa::{FontRef, MetadataProvider};

/// Font list written into every SVG: the embedded face first, then faces of the same widths, then any.
pub const FAMILY: &str = "'DejaVu Sans', Verdana, 'Bitstream Vera Sans', Arial, sans-serif";

/// DejaVu Sans 2.35 (licence in `data/fonts/LICENSE-DejaVuSans.txt`).
static FONT: &[u8] = include_bytes!("../../data/fonts/DejaVuSans.ttf");

static DATABASE: LazyLock<Arc<Database>> = LazyLock::new(|| {
    let mut database = Database::new();
    database.load_font_data(FONT.to_vec());
    Arc::new(database)
});

static FACE: LazyLock<Option<FontRef<'static>>> = LazyLock::new(|| FontRef::new(FONT).ok());

/// The font database handed to the renderer: the embedded face and nothing of the system's.
pub fn database() -> Arc<Database> {
    DATABASE.clone()
}

/// Width of one character in em; characters that the font lacks count as 0.6 em.
pub fn advance_em(character: char) -> f64 {
    const MISSING_EM: f64 = 0.6;
    /// Of the embedded face.
    const UNITS_PER_EM: f64 = 2048.0;
    let advance = |font: &FontRef| {
        let metrics = font.glyph_metrics(Size::unscaled(), LocationRef::default());
        Some(f64::from(metrics.advance_width(font.charmap().map(character)?)?) / UNITS_PER_EM)
    };
    FACE.as_ref().and_then(advance).unwrap_or(MISSING_EM)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Advances in units of 1/2048 em, read with fontTools 4 (`TTFont(..)["hmtx"]`).
    #[test]
    fn widths_equal_those_fonttools_reads() {
        for (character, units) in [('0', 1303.0), ('i', 569.0), ('⊙', 1716.0), ('κ', 1207.0), ('Δ', 1401.0)]
        {
            assert_eq!(advance_em(character), units / 2048.0, "{character}");
        }
    }

    #[test]
    fn a_character_the_font_lacks_has_a_width() {
        assert_eq!(advance_em('漢'), 0.6);
    }

    #[test]
    fn the_family_list_names_the_embedded_face() {
        let database = database();
        let face = database.faces().next().unwrap();
        assert!(FAMILY.contains(&face.families[0].0));
    }
}
