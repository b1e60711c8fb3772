//! From SVG to PNG with the embedded font.

use resvg::tiny_skia::{Color, Pixmap, Transform};
use resvg::usvg;

use super::font;

/// Resolution of the PNG files, dots per inch of the printed page.
pub const DPI: f32 = 300.0;

/// Renders an SVG written by this room to the bytes of a PNG file of [`DPI`].
pub fn render(svg: &str) -> Result<Vec<u8>, String> {
    let options = usvg::Options { fontdb: font::database(), ..Default::default() };
    let tree = usvg::Tree::from_str(svg, &options).map_err(|error| error.to_string())?;
    let scale = DPI / options.dpi;
    let side = |length: f32| (length * scale).round().max(1.0) as u32;
    let (width, height) = (side(tree.size().width()), side(tree.size().height()));
    let mut pixmap =
        Pixmap::new(width, height).ok_or_else(|| format!("{width} × {height} pixels are too many"))?;
    pixmap.fill(Color::WHITE);
    resvg::render(&tree, Transform::from_scale(scale, scale), &mut pixmap.as_mut());
    let png = pixmap.encode_png().map_err(|error| error.to_string())?;
    Ok(with_resolution(png))
}

/// Adds the chunk that tells [`DPI`] (11811 pixels per metre), so that the picture has its size on paper.
fn with_resolution(mut png: Vec<u8>) -> Vec<u8> {
    /// Signature and `IHDR` are 33 bytes in every PNG (PNG specification, 5.2 and 11.2.2).
    const AFTER_HEADER: usize = 33;
    /// Length 9, name, 11811 twice, unit metre, CRC-32 of the preceding 13 bytes.
    const PHYS: [u8; 21] = *b"\x00\x00\x00\x09pHYs\x00\x00\x2e\x23\x00\x00\x2e\x23\x01\x78\xa5\x3f\x76";
    png.splice(AFTER_HEADER..AFTER_HEADER, PHYS);
    png
}

#[cfg(test)]
mod tests {
    use super::*;

    const SVG: &str = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"25.4mm\" height=\"12.7mm\" \
                       viewBox=\"0 0 72 36\"><text x=\"4\" y=\"30\" font-size=\"30\" \
                       font-family=\"'DejaVu Sans'\">Γ</text></svg>";

    #[test]
    fn an_inch_is_300_pixels_and_text_leaves_ink() {
        let png = render(SVG).unwrap();
        let pixmap = Pixmap::decode_png(&png).unwrap();
        assert_eq!((pixmap.width(), pixmap.height()), (300, 150));
        let dark = pixmap.pixels().iter().filter(|pixel| pixel.red() < 50).count();
        assert!(dark > 500, "{dark}");
    }

    #[test]
    fn what_is_not_svg_is_refused() {
        assert!(render("<svg").is_err());
    }
}
