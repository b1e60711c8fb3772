//! Pictures inside the SVG: grids of values as PNG data URIs.

use resvg::tiny_skia::{IntSize, Pixmap};

use super::colour::{Colour, ColourMap};
use super::norm::Norm;

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
    pub fn of_grid(values: &[f64], nx: usize, ny: usize, map: ColourMap, norm: &Norm) -> Self {
        let (width, height) = (nx.clamp(1, Self::MAX_SIDE), ny.clamp(1, Self::MAX_SIDE));
        let mut rgba = vec![0; 4 * width * height];
        for (row, pixels) in rgba.chunks_exact_mut(4 * width).enumerate() {
            let start = (height - 1 - row) * nx;
            let cells = values.get(start..).unwrap_or_default().iter().take(nx);
            for (pixel, &value) in pixels.chunks_exact_mut(4).zip(cells) {
                if let Some(t) = norm.position(value) {
                    let Colour(r, g, b) = map.at(t);
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
        Some(format!("data:image/png;base64,{}", base64(&png)))
    }
}

/// Base64 with padding (RFC 4648, section 4).
fn base64(bytes: &[u8]) -> String {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let padded = [0, group[0], *group.get(1).unwrap_or(&0), *group.get(2).unwrap_or(&0)];
        let bits = u32::from_be_bytes(padded);
        for i in 0..4 {
            let digit = ALPHABET[(bits >> (18 - 6 * i) & 63) as usize];
            out.push(if i <= group.len() { char::from(digit) } else { '=' });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_equals_the_vectors_of_rfc_4648() {
        for (plain, coded) in
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")]
        {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
    }

    #[test]
    fn the_first_row_of_a_grid_is_at_the_bottom_and_nan_is_transparent() {
        let norm = Norm::Linear { low: 0.0, high: 1.0 };
        let picture = Picture::of_grid(&[0.0, f64::NAN, 1.0, 1.0], 2, 2, ColourMap::Inferno, &norm);
        let Colour(r, g, b) = ColourMap::Inferno.at(1.0);
        assert_eq!(picture.rgba[..4], [r, g, b, 255]);
        assert_eq!(picture.rgba[12..], [0, 0, 0, 0]);
    }

    #[test]
    fn missing_cells_do_not_panic() {
        let norm = Norm::Linear { low: 0.0, high: 1.0 };
        for (nx, ny) in [(3, 3), (0, 0), (1, 100_000)] {
            let uri = Picture::of_grid(&[1.0], nx, ny, ColourMap::Viridis, &norm).data_uri();
            assert!(uri.unwrap().starts_with("data:image/png;base64,iVBOR"));
        }
    }
}
