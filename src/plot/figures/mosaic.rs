//! All images of a catalogue in one figure.

use super::grid::{GridData, caption};
use super::images::image_colours;
use crate::plot::{Axis, ColourMap, Extent, Figure, Panel};

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

/// Draws the images in rows of `columns`, each filling its panel, each with a stretch of its own.
pub fn mosaic(images: &[MosaicImage], columns: usize) -> Figure {
    let panels = images.iter().map(|one| {
        let Extent { left, right, bottom, top } = one.image.extent_arcsec;
        let bare = |low, high| Axis { limits: Some((low, high)), tick_labels: false, ..Axis::linear("") };
        let colours = image_colours(&[one.image], one.background_rms_e_per_s);
        let marks = vec![one.image.raster(colours), caption(one.name, (0.06, 0.9), ColourMap::Inferno)];
        Panel { marks, ..Panel::new(bare(left, right), bare(bottom, top)) }
    });
    Figure {
        columns: columns.max(1),
        panel_aspect: 1.0,
        panels: panels.collect(),
        ..Figure::full_width("Catalogue of mock images")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_image_has_its_panel() {
        let grid = GridData::square(&[0.1, 0.2, 0.3, 1.0], 2, 1.0);
        let one = MosaicImage { image: grid, background_rms_e_per_s: 0.006, name: "7" };
        let figure = mosaic(&[one; 5], 3);
        assert_eq!((figure.panels.len(), figure.columns), (5, 3));
        assert!(!mosaic(&[], 8).to_svg().contains("NaN"));
    }
}
