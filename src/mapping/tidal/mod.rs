//! The line of sight as a tidal field around one main lens: full, minimal and flexion models.
//!
//! Full: β = A_os θ − A_ds α(A_od θ). Minimal: β̃ = A_LOS θ − A_odᵀ α(A_od θ) (Fleury, Larena & Uzan 2021; the
//! transpose matters when ω_od ≠ 0, and lenstronomy leaves it out). Flexion: Duboscq et al. 2024.
//! First and second derivatives come from second-order jets, so that the Jacobian *is* the derivative of β.

mod algebra;
mod centres;
mod equation;
mod fermat;
mod flexion;
mod jet;
mod kind;
mod lens;
mod model;
mod response;
mod tensor;

pub use flexion::{Flexion, FlexionModel};
pub use kind::LineOfSightKind;
pub use lens::TidalLens;
pub use model::LineOfSightModel;
pub(crate) use model::los_jacobian;
pub(crate) use response::{LensResponse, MANY_LENSES, MOST_NUMBERS};
pub use tensor::Tidal;
