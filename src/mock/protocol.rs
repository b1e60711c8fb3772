//! The distributions that mock systems are drawn from: appendix B as its authors' code has it, and as its text.

use serde::Serialize;

use crate::error::{Error, Result};

/// Mass of the dark halo from the mass in stars.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum HaloMassRule {
    /// M_halo = λM, λ uniform: the code.
    Times([f64; 2]),
    /// M_halo = M/λ, λ uniform: the text.
    Over([f64; 2]),
}

/// Size and brightness of the source.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum SourceRule {
    /// The code: log-normal radius, luminosity in proportion to its square.
    Radius {
        /// Median half-light radius.
        median_kpc: f64,
        /// Standard deviation of its logarithm.
        sd_ln: f64,
        /// Absolute magnitude at the median radius.
        magnitude_at_median: f64,
    },
    /// The text: a mass drawn like that of the lens, with radius and magnitude by the same relations.
    Mass,
}

/// Brightness of a perturber of the source.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum PerturberRule {
    /// Surface brightness at its half-light radius over that of the source at the source's: the text.
    Amplitude(f64),
    /// Flux over that of the source: the code.
    Flux(f64),
}

/// What mock systems are drawn from. Log-normal quantities are given by median and standard deviation of the logarithm.
///
/// | | `paper` (the authors' code) | `text` (appendix B) |
/// |---|---|---|
/// | halo mass | λM, λ ∈ U(30, 100) | M/λ, λ ∈ U(0.3, 1) |
/// | largest shear | 0.03 | 0.025 |
/// | axis ratios | U(0.9, 1) | U(0.7, 1) |
/// | source | radius log-normal about 3 kpc, M = −22 there, luminosity ∝ area | as the lens's stars |
/// | perturbers | one to three, round | three, elliptical |
///
/// All else is the same in both. Axis ratios and offsets are drawn for stars, halo and source alike. The text does not give
/// the redshift of the source, the size of the images nor that of the perturbers; they are those of the code that made the
/// first released images. Perturbers have 1% of the source's amplitude, as in the text. In the code it is 1% of the flux,
/// which biases fits that do not know of them (docs/CATALOGUE.md).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Protocol {
    /// Name of the preset.
    pub name: &'static str,
    /// Lens redshift, uniform.
    pub z_lens: [f64; 2],
    /// Source redshift, uniform.
    pub z_source: [f64; 2],
    /// Median mass in stars.
    pub mass_median_msun: f64,
    /// Spread of its logarithm.
    pub mass_sd_ln: f64,
    /// Half-light radius at the median mass, in proportion to the mass.
    pub radius_at_median_kpc: f64,
    /// Median Sérsic index, of lens and source.
    pub index_median: f64,
    /// Spread of its logarithm.
    pub index_sd_ln: f64,
    /// Axis ratios are uniform from here to 1, orientations uniform.
    pub least_axis_ratio: f64,
    /// Mass of stars per luminosity, solar units.
    pub mass_to_light: f64,
    /// Absolute magnitude of the Sun.
    pub magnitude_of_sun: f64,
    /// Halo mass (M200c).
    pub halo_mass: HaloMassRule,
    /// Median concentration (c200c).
    pub concentration_median: f64,
    /// Spread of its logarithm.
    pub concentration_sd_ln: f64,
    /// Offset of the halo from the stars, normal in x and in y.
    pub halo_offset_sd_pc: f64,
    /// The source.
    pub source: SourceRule,
    /// Sérsic profiles on top of the source: fewest and most.
    pub perturbers: [u32; 2],
    /// Brightness of each.
    pub perturber_brightness: PerturberRule,
    /// Half-light radius of each relative to the source, uniform.
    pub perturber_radius: [f64; 2],
    /// Their axis ratios are uniform from here to 1.
    pub perturber_least_axis_ratio: f64,
    /// Shears od, os, ds are uniform on a disk of this radius.
    pub largest_shear: f64,
    /// Lenses below this Einstein radius are drawn again.
    pub least_einstein_radius_arcsec: f64,
    /// Width of the image in units of Einstein radius plus source offset.
    pub image_width: f64,
}

impl Protocol {
    /// Presets by name.
    pub const NAMES: [&str; 2] = ["paper", "text"];

    /// The values of the authors' code.
    pub fn paper() -> Self {
        let half_factor = |factor: f64| 0.5 * factor.ln();
        Self {
            name: "paper",
            z_lens: [0.4, 0.6],
            z_source: [1.5, 2.5],
            mass_median_msun: 2e11,
            mass_sd_ln: half_factor(2.0),
            radius_at_median_kpc: 2.0,
            index_median: 4.0,
            index_sd_ln: half_factor(1.5),
            least_axis_ratio: 0.9,
            mass_to_light: 2.0,
            magnitude_of_sun: 4.74,
            halo_mass: HaloMassRule::Times([30.0, 100.0]),
            concentration_median: 10f64.powf(1.1),
            concentration_sd_ln: 0.2,
            halo_offset_sd_pc: 300.0,
            source: SourceRule::Radius {
                median_kpc: 3.0,
                sd_ln: half_factor(2.0),
                magnitude_at_median: -22.0,
            },
            perturbers: [1, 3],
            perturber_brightness: PerturberRule::Amplitude(0.01),
            perturber_radius: [0.1, 1.0],
            perturber_least_axis_ratio: 1.0,
            largest_shear: 0.03,
            least_einstein_radius_arcsec: 0.5,
            image_width: 3.0,
        }
    }

    /// The same with sources of one Sérsic profile alone; all else of a system stays.
    pub fn without_perturbers(self) -> Self {
        Self { perturbers: [0, 0], ..self }
    }

    /// The values of the text of appendix B.
    pub fn text() -> Self {
        Self {
            name: "text",
            least_axis_ratio: 0.7,
            halo_mass: HaloMassRule::Over([0.3, 1.0]),
            source: SourceRule::Mass,
            perturbers: [3, 3],
            perturber_least_axis_ratio: 0.7,
            largest_shear: 0.025,
            ..Self::paper()
        }
    }

    /// The preset of that name.
    ///
    /// # Errors
    /// Another name.
    pub fn named(name: &str) -> Result<Self> {
        match name {
            "paper" => Ok(Self::paper()),
            "text" => Ok(Self::text()),
            _ => Err(Error::argument("--preset", name, &Self::NAMES.join(" or "))),
        }
    }
}
