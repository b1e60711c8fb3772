//! Counter-based random streams: one per (seed, realisation, stage, block), whatever thread runs it.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// What a stream is for; each stage has random numbers of its own, so adding one changes no other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u64)]
pub enum Stage {
    /// Brute-force draw of all haloes.
    BruteForceDraw = 1,
    /// Direct draw of the haloes that pass the cut.
    DirectDraw = 2,
    /// Scatter of the concentrations.
    Concentration = 3,
    /// Random properties of main lens and source.
    LensAndSource = 4,
    /// Pixel noise of the image with all haloes.
    NoiseAllHaloes = 5,
    /// Pixel noise of the image without the haloes beyond the tidal regime.
    NoiseTidalHaloes = 6,
    /// Pixel noise of an image of its own.
    NoiseImage = 7,
    /// Everything about a mock system; realisation = its number.
    MockSystem = 8,
    /// Rays that compare adaptive with exact tracing.
    AccuracyCheck = 9,
    /// Where the random sightlines of a light cone point; realisation = sightline.
    LightconeDirection = 10,
    /// Scatter of concentrations that a light cone lacks; realisation = row.
    LightconeConcentration = 11,
    /// Which haloes sightlines of a light cone are centred on; realisation = row.
    LightconeLens = 12,
    /// Guesses that a fit starts from.
    Start = 15,
    /// Moves of a sampler; realisation = chain, ensemble or run, block = block of draws.
    Sampling = 16,
    /// Parameter sets that an adaptive mesh is made for.
    Mesh = 18,
    /// Evidence and equal-weight draws of nested sampling.
    Evidence = 17,
    /// Sightlines drawn again for the errors of a statistic.
    Bootstrap = 19,
}

/// The name of the random stream of one stage of one realisation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StreamName {
    /// Seed of the run.
    pub seed: u64,
    /// Number of the realisation.
    pub realisation: u64,
    /// What is drawn.
    pub stage: Stage,
}

/// The stream of one block of work.
pub fn stream(seed: u64, realisation: u64, stage: Stage, block: u64) -> ChaCha8Rng {
    let mut key = [0_u8; 32];
    key[..8].copy_from_slice(&seed.to_le_bytes());
    key[8..16].copy_from_slice(&realisation.to_le_bytes());
    key[16..24].copy_from_slice(&(stage as u64).to_le_bytes());
    let mut rng = ChaCha8Rng::from_seed(key);
    rng.set_stream(block);
    rng
}
