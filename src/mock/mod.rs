//! The paper's catalogue of mock images (section 3, appendix B): systems drawn at random, their images, how well a fit does.

mod columns;
mod draw;
mod image;
mod protocol;
mod recovery;
mod score;
mod system;

pub use columns::MockColumn;
pub use image::{MockImage, image_quality};
pub use protocol::{HaloMassRule, PerturberRule, Protocol, SourceRule};
pub use recovery::{ProfiledShear, RecoveredShear, ShearRecovery};
pub use score::{
    ModelScore, PAPER_QUALITY_FIT, PAPER_TABLE_2, PaperScore, QualityFit, residual_in_sigma, uncertainty,
};
pub use system::{Baryons, Halo, LensedSource, MockSystem, Perturber};
