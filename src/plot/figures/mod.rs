//! The figures of this project, one file each: plain saved numbers in, a `Figure` out.

mod calibration;
mod corner;
mod curves;
mod cut;
mod cylinder;
mod flexion_maps;
mod grid;
mod histograms;
mod images;
mod mass_function;
mod mosaic;
mod reconstruction;
mod recovery;
mod tidal_maps;
mod tidal_residuals;
mod trace_plot;

pub use calibration::{RankHistogram, calibration};
pub use corner::{CornerData, CornerParameter, CornerPosterior, corner};
pub use curves::{CurveData, CurvesData, curves, overlay};
pub use cut::{CutData, cut};
pub use cylinder::{CylinderData, cylinder};
pub use flexion_maps::{FlexionMapsData, flexion_maps};
pub use grid::GridData;
pub use histograms::{HaloEffects, histograms};
pub use images::{ImagePairData, ImageRow, ImagesData, image_pair, images};
pub use mass_function::{DrawnHaloes, MassFunctionCurve, MassFunctionData, mass_function};
pub use mosaic::{MosaicImage, mosaic};
pub use reconstruction::{ReconstructionData, reconstruction, source_plane};
pub use recovery::{RecoveredPoint, RecoveryData, recovery, recovery_histograms, recovery_quality};
pub use tidal_maps::{TidalMapsData, tidal_maps};
pub use tidal_residuals::{TidalResidualsData, tidal_residuals};
pub use trace_plot::{TraceParameter, trace_plot};
