//! All images of a catalogue in one figure.

use super::grid::{GridData, caption, scale_bar};
use super::images::image_colours;
use crate::plot::{Figure, Panel};

/// One image and what is written in it.
#[derive(Debug, Clone, Copy)]
pub struct MosaicImage<'a> {
    /// The image in e⁻/s per pixel.
    pub image: GridData<'a>,
    /// Rms of its background.
    pub background_rms_e_per_s: f64,
    /// Written in its corner.
    pub name: &'a str,
}

/// Draws the images in rows of `columns`, each filling its panel, each with a stretch and a scale bar of its own.
pub fn mosaic(images: &[MosaicImage], columns: usize) -> Figure {
    let panels = images.iter().map(|one| {
        let colours = image_colours(&[one.image], one.background_rms_e_per_s);
        let mut panel = one.image.panel(colours, 0);
        panel.marks.push(caption(one.name, (0.06, 0.9), colours.map));
        panel.marks.extend(scale_bar(one.image.extent_arcsec, colours.map));
        Panel::new(panel.x.outer(false), panel.y.outer(false), panel.marks)
    });
    Figure::full_width("Catalogue of mock images", 1.0, columns, panels)
}
