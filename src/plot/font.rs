//! The embedded font: its database for the renderer, and the widths of its characters for the layout.

use std::sync::{Arc, LazyLock};

use resvg::usvg::fontdb::Database;

/// Font list written into every SVG: the embedded face first, then faces of the same widths, then any.
pub(super) const FAMILY: &str = "'DejaVu Sans', Verdana, 'Bitstream Vera Sans', Arial, sans-serif";

/// DejaVu Sans 2.35 (licence in `data/fonts/LICENSE-DejaVuSans.txt`).
static FONT: &[u8] = include_bytes!("../../data/fonts/DejaVuSans.ttf");

static DATABASE: LazyLock<Arc<Database>> = LazyLock::new(|| {
    let mut database = Database::new();
    database.load_font_data(FONT.to_vec());
    Arc::new(database)
});

static TABLES: LazyLock<Option<Tables>> = LazyLock::new(Tables::find);

/// The font database handed to the renderer: the embedded face and nothing of the system's.
pub(super) fn database() -> Arc<Database> {
    DATABASE.clone()
}

/// Width of one character in em; characters that the font lacks count as 0.6 em.
pub(super) fn advance_em(character: char) -> f64 {
    const MISSING_EM: f64 = 0.6;
    TABLES.as_ref().and_then(|tables| tables.advance_em(character)).unwrap_or(MISSING_EM)
}

/// Where the needed TrueType tables start, in bytes (OpenType specification 1.9: `cmap` format 12, `hmtx`).
struct Tables {
    groups: usize,
    group_count: u32,
    metrics: usize,
    metric_count: usize,
    units_per_em: f64,
}

impl Tables {
    fn find() -> Option<Self> {
        let head = table(b"head")?;
        let hhea = table(b"hhea")?;
        let cmap = table(b"cmap")?;
        let subtable = (0..u16_at(cmap + 2)? as usize).find_map(|i| {
            let start = cmap + u32_at(cmap + 4 + 8 * i + 4)? as usize;
            (u16_at(start)? == 12).then_some(start)
        })?;
        Some(Self {
            groups: subtable + 16,
            group_count: u32_at(subtable + 12)?,
            metrics: table(b"hmtx")?,
            metric_count: u16_at(hhea + 34)? as usize,
            units_per_em: f64::from(u16_at(head + 18)?),
        })
    }

    fn advance_em(&self, character: char) -> Option<f64> {
        let code = u32::from(character);
        let glyph = (0..self.group_count as usize).find_map(|i| {
            let group = self.groups + 12 * i;
            let (first, last) = (u32_at(group)?, u32_at(group + 4)?);
            (first..=last).contains(&code).then_some(u32_at(group + 8)? + (code - first))
        })?;
        let row = (glyph as usize).min(self.metric_count.checked_sub(1)?);
        Some(f64::from(u16_at(self.metrics + 4 * row)?) / self.units_per_em)
    }
}

/// Start of the table of that name, from the table directory at the head of the file.
fn table(name: &[u8; 4]) -> Option<usize> {
    (0..u16_at(4)? as usize).find_map(|i| {
        let record = 12 + 16 * i;
        (FONT.get(record..record + 4)? == name).then_some(u32_at(record + 8)? as usize)
    })
}

fn u16_at(start: usize) -> Option<u16> {
    Some(u16::from_be_bytes(FONT.get(start..start + 2)?.try_into().ok()?))
}

fn u32_at(start: usize) -> Option<u32> {
    Some(u32::from_be_bytes(FONT.get(start..start + 4)?.try_into().ok()?))
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
