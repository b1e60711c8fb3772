//! Samplers of a posterior behind one trait, [`Sampler`]: blocks of draws, put into [`Chains`].

mod any;
mod chains;
mod ensemble;
mod nested;
mod normal;
mod nuts;
mod point;
mod problem;
mod sampler;
mod settings;
mod valley;
mod whitening;

pub(crate) use any::AnySampler;
pub use chains::{Chain, Chains};
pub use ensemble::{EnsembleSliceSettings, StretchSettings};
pub use nested::NestedSettings;
pub use nuts::NutsSettings;
pub use problem::Problem;
pub use sampler::{Evidence, EvidenceSoFar, Sampler};
pub use settings::SamplerSettings;
pub use valley::ValleySettings;
