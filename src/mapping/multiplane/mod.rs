//! Recursive ray tracing through one plane per halo (Blandford & Narayan 1986; Schneider 2014).

mod adaptive;
mod axis;
mod beams;
mod centres;
mod circle;
mod delay;
mod general;
mod kick;
mod line_of_sight;
mod near_axis;
mod plane;
mod recursion;
mod segment;
mod span;

pub use adaptive::{Accuracy, AccuracyReport, AdaptiveSegment, Exact, Field};
pub use axis::Reference;
pub use beams::Beam;
pub(crate) use circle::{Circle, CircleWave, Distorts, Meeting, RAYS, turn};
pub use general::GeneralMultiPlane;
pub use line_of_sight::{LineOfSight, MainLens, RaysAtPlane};
pub use near_axis::{NearAxis, RayDerivatives};
pub use plane::Sheets;
pub use segment::Segment;
