//! How images are sampled: what the fitting commands let a user choose.

use clap::ValueEnum;
use haloray::imaging::PixelSampling;
use haloray::inference::sample::{
    EnsembleSliceSettings, NestedSettings, NutsSettings, SamplerSettings, StretchSettings, ValleySettings,
};
use haloray::{Error, Result};

#[derive(Clone, Copy, ValueEnum)]
pub enum SamplerArg {
    /// Along the floor of the posterior's valley, in coordinates that straighten it; the rest is integrated over. The fastest.
    Valley,
    /// No-U-Turn sampler, its metric shaped by the Fisher matrix; on lenses of stars and halo hardly converges.
    Nuts,
    /// Ensemble slice sampling, as zeus.
    EnsembleSlice,
    /// Affine-invariant stretch move, as emcee.
    Stretch,
    /// Nested sampling: the evidence too.
    Nested,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum LikelihoodArg {
    /// One variance, from the model, with its determinant; amplitudes marginalised.
    Gaussian,
    /// No determinant, amplitudes weighted by the data: for comparison.
    Lenstronomy,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum SamplingArg {
    /// The centre stands for the pixel.
    Point,
    /// Integrated to 1% of the noise, in the worst pixel of thirty images to 7%.
    Adaptive,
}

impl From<SamplingArg> for PixelSampling {
    fn from(sampling: SamplingArg) -> Self {
        match sampling {
            SamplingArg::Point => Self::Point,
            SamplingArg::Adaptive => Self::Adaptive,
        }
    }
}

impl SamplerArg {
    pub fn settings(self) -> SamplerSettings {
        match self {
            Self::Nuts => SamplerSettings::Nuts(NutsSettings::default()),
            Self::Valley => SamplerSettings::Valley(ValleySettings::default()),
            Self::EnsembleSlice => SamplerSettings::EnsembleSlice(EnsembleSliceSettings::default()),
            Self::Stretch => SamplerSettings::Stretch(StretchSettings::default()),
            Self::Nested => SamplerSettings::Nested(NestedSettings::default()),
        }
    }
}

/// The same settings with at most so many draws a chain or walker.
pub fn limited(mut settings: SamplerSettings, max_draws: Option<usize>) -> Result<SamplerSettings> {
    let Some(most) = max_draws else { return Ok(settings) };
    let steps = |block: &mut usize, max: &mut usize, thin: usize| {
        *max = most * thin;
        *block = (*block).min(*max);
    };
    match &mut settings {
        SamplerSettings::Nuts(s) => steps(&mut s.block_draws, &mut s.max_draws, 1),
        SamplerSettings::Valley(s) => steps(&mut s.block_draws, &mut s.max_draws, 1),
        SamplerSettings::EnsembleSlice(s) => steps(&mut s.block_steps, &mut s.max_steps, s.thin),
        SamplerSettings::Stretch(s) => steps(&mut s.block_steps, &mut s.max_steps, s.thin),
        SamplerSettings::Nested(_) => {
            return Err(Error::argument("--max-draws", most, "left out with --sampler nested"));
        }
    }
    Ok(settings)
}
