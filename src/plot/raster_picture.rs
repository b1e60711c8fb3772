//! Pictures inside the SVG: grids of values as PNG data URIs.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use resvg::tiny_skia::{IntSize, Pixmap};

use super::colour::Colour;
use super::norm::ColourScale;

/// An RGBA picture with premultiplied colours, row 0 on top.
pub(super) struct Picture {
    width: usize,
    height: usize,
    rgba: Vec<u8>,
}

impl Picture {
    /// The largest side, so that no figure asks for unbounded memory.
    const MAX_SIDE: usize = 16_384;

    /// A row-major (y, x) grid with y up in colours; cells that are missing or not finite stay transparent.
    pub fn of_grid(values: &[f64], nx: usize, ny: usize, colours: ColourScale) -> Self {
        let (width, height) = (nx.clamp(1, Self::MAX_SIDE), ny.clamp(1, Self::MAX_SIDE));
        let mut rgba = vec![0; 4 * width * height];
        for (row, pixels) in rgba.chunks_exact_mut(4 * width).enumerate() {
            let start = (height - 1 - row) * nx;
            let cells = values.get(start..).unwrap_or_default().iter().take(nx);
            for (pixel, &value) in pixels.chunks_exact_mut(4).zip(cells) {
                if let Some(t) = colours.norm.position(value) {
                    let Colour(r, g, b) = colours.map.at(t);
                    pixel.copy_from_slice(&[r, g, b, 255]);
                }
            }
        }
        Self { width, height, rgba }
    }

    /// The picture as `data:image/png;base64,…`; `None` only if the encoder refuses it.
    pub fn data_uri(self) -> Option<String> {
        let size = IntSize::from_wh(self.width as u32, self.height as u32)?;
        let png = Pixmap::from_vec(self.rgba, size)?.encode_png().ok()?;
        Some(format!("data:image/png;base64,{}", STANDARD.encode(&png)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::{ColourMap, Norm};

    fn linear(map: ColourMap) -> ColourScale {
        ColourScale { map, norm: Norm::Linear { low: 0.0, high: 1.0 } }
    }

    #[test]
    fn the_first_row_of_a_grid_is_at_the_bottom_and_nan_is_transparent() {
        let picture = Picture::of_grid(&[0.0, f64::NAN, 1.0, 1.0], 2, 2, linear(ColourMap::Inferno));
        let Colour(r, g, b) = ColourMap::Inferno.at(1.0);
        assert_eq!(picture.rgba[..4], [r, g, b, 255]);
        assert_eq!(picture.rgba[12..], [0, 0, 0, 0]);
    }

    #[test]
    fn missing_cells_do_not_panic() {
        for (nx, ny) in [(3, 3), (0, 0), (1, 100_000)] {
            let uri = Picture::of_grid(&[1.0], nx, ny, linear(ColourMap::Viridis)).data_uri();
            assert!(uri.unwrap().starts_with("data:image/png;base64,iVBOR"));
        }
    }
}
