//! Pictures inside the SVG: grids of values as PNG data URIs.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use resvg::tiny_skia::{IntSize, Pixmap};

use super::colour::Colour;
use super::colour_scale::ColourScale;

/// The largest side, so that no figure asks for unbounded memory.
const MAX_SIDE: usize = 16_384;

/// A row-major (y, x) grid with y up as `data:image/png;base64,…`; `None` only if the encoder refuses it.
pub fn data_uri(values: &[f64], nx: usize, ny: usize, colours: ColourScale) -> Option<String> {
    let (width, height) = (nx.clamp(1, MAX_SIDE), ny.clamp(1, MAX_SIDE));
    let size = IntSize::from_wh(width as u32, height as u32)?;
    let png = Pixmap::from_vec(rgba(values, nx, [width, height], colours), size)?.encode_png().ok()?;
    Some(format!("data:image/png;base64,{}", STANDARD.encode(&png)))
}

/// Row 0 on top; cells that are missing or not finite stay transparent.
fn rgba(values: &[f64], nx: usize, [width, height]: [usize; 2], colours: ColourScale) -> Vec<u8> {
    let mut rgba = vec![0; 4 * width * height];
    for (row, pixels) in rgba.chunks_exact_mut(4 * width).rev().enumerate() {
        let cells = values.get(row * nx..).unwrap_or_default().iter().take(nx);
        for (pixel, &value) in pixels.chunks_exact_mut(4).zip(cells) {
            if let Some(Colour(r, g, b)) = colours.colour(value) {
                pixel.copy_from_slice(&[r, g, b, 255]);
            }
        }
    }
    rgba
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::{ColourMap, Stretch};

    const COLOURS: ColourScale =
        ColourScale { map: ColourMap::Inferno, low: 0.0, high: 1.0, stretch: Stretch::Linear };

    #[test]
    fn the_first_row_of_a_grid_is_at_the_bottom_and_nan_is_transparent() {
        let rgba = rgba(&[0.0, f64::NAN, 1.0, 1.0], 2, [2, 2], COLOURS);
        let Colour(r, g, b) = ColourMap::Inferno.at(1.0);
        assert_eq!((&rgba[..4], &rgba[12..]), (&[r, g, b, 255][..], &[0; 4][..]));
    }

    #[test]
    fn missing_cells_do_not_panic() {
        for (nx, ny) in [(3, 3), (0, 0), (1, 100_000)] {
            let uri = data_uri(&[1.0], nx, ny, COLOURS);
            assert!(uri.unwrap().starts_with("data:image/png;base64,iVBOR"));
        }
    }
}
