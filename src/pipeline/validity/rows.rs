//! What the study keeps of a sightline.

use serde::{Deserialize, Serialize};

use super::plan::FitStart;
use crate::diagnostics::HaloTidal;
use crate::halo::HaloCatalogue;

/// What an image was seen through.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Mock {
    /// Its haloes.
    Haloes,
    /// The tensors of their axis ray alone.
    Tidal,
}

impl Mock {
    /// In tables.
    pub fn name(self) -> &'static str {
        if self == Self::Haloes { "haloes" } else { "tidal" }
    }
}

/// One sightline of one case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ValiditySightline {
    /// Number of the sightline (realisation of the seed).
    pub sightline: u64,
    /// Place of the case in its plan.
    pub case: usize,
    /// Of all haloes, the one whose shear changes most over the Einstein radius; none of an empty line of sight.
    pub halo: Option<VaryingHalo>,
    /// Views in the order of the plan; none where the sightline failed.
    pub views: Vec<ValidityView>,
    /// Why the sightline failed; empty where it did not.
    pub failure: String,
}

/// The halo of the largest Δ_h|γ_h|, the change of its shear over the Einstein radius.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct VaryingHalo {
    /// M200c; not a number where masses are not known.
    pub m200c_msun: f64,
    /// Redshift.
    pub z: f64,
    /// Distance from the axis, arcsec.
    pub distance_arcsec: f64,
    /// Δ_h.
    pub delta: f64,
    /// κ_h on the axis ray.
    pub kappa: f64,
    /// Δ_h|γ_h|.
    pub shear_change: f64,
}

impl VaryingHalo {
    /// Of a catalogue and what each of its haloes does.
    pub fn of(haloes: &HaloCatalogue, effects: &HaloTidal) -> Option<Self> {
        let change = |i: usize| effects.delta[i] * effects.gamma[i].norm();
        let most = (0..haloes.len())
            .filter(|&i| change(i).is_finite())
            .max_by(|&a, &b| change(a).total_cmp(&change(b)))?;
        Some(Self {
            m200c_msun: haloes.m200c_msun.as_ref().map_or(f64::NAN, |masses| masses[most]),
            z: haloes.z[most],
            distance_arcsec: haloes.theta_x_arcsec[most].hypot(haloes.theta_y_arcsec[most]),
            delta: effects.delta[most],
            kappa: effects.kappa[most],
            shear_change: change(most),
        })
    }
}

/// What is seen of a sightline through some of its haloes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ValidityView {
    /// Haloes traced.
    pub number_of_haloes: usize,
    /// Δ_tot of the axis and of the ring.
    pub delta_tot: [f64; 2],
    /// Seen through the haloes.
    pub haloes: ValidityImage,
    /// The strictly tidal twin.
    pub tidal: ValidityImage,
}

impl ValidityView {
    /// Both images.
    pub fn images(&self) -> [(Mock, &ValidityImage); 2] {
        [(Mock::Haloes, &self.haloes), (Mock::Tidal, &self.tidal)]
    }
}

/// One image and its fits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ValidityImage {
    /// (γ1, γ2) of the line of sight by the definitions of [`DEFINITIONS`](crate::pipeline::DEFINITIONS); not a number where
    /// there is none.
    pub by_definition: [[f64; 2]; 5],
    /// Weighted rms that the nearest tidal and flexion models leave of β, arcsec.
    pub residual_arcsec: [f64; 2],
    /// H0 that delays give, over the true one, where the lens is known and the line of sight has the tensors of the axis ray and
    /// of the ring; not a number where images were lost from one to the other.
    pub h0_ratio: [f64; 2],
    /// Fits: models in the order of the plan, in each the starts.
    pub fits: Vec<ValidityFit>,
}

/// One fit of one image.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ValidityFit {
    /// Place of the model in its plan.
    pub model: usize,
    /// Where it began.
    pub start: FitStart,
    /// (γ1, γ2) of the line of sight.
    pub shear: [f64; 2],
    /// Their covariance (11, 12, 22).
    pub covariance: [f64; 3],
    /// χ² of the best fit.
    pub chi2: f64,
    /// Pixels less parameters.
    pub degrees_of_freedom: f64,
    /// Probability of a larger χ².
    pub p_value: f64,
    /// ln p of the highest maximum, up to a constant of the image.
    pub log_posterior: f64,
    /// ln ∫ L by Laplace's approximation about it, up to the same constant.
    pub log_evidence: f64,
    /// Whether the draws converged; always where there are none.
    pub is_converged: bool,
    /// H0 that delays give, over the true one, where lens and line of sight are those of the best fit.
    pub h0_ratio: f64,
    /// Why the fit failed; empty where it did not.
    pub failure: String,
}

impl ValidityFit {
    /// A fit that came to nothing.
    pub(super) fn failed(model: usize, start: FitStart, failure: String) -> Self {
        let none = f64::NAN;
        Self {
            model,
            start,
            shear: [none; 2],
            covariance: [none; 3],
            chi2: none,
            degrees_of_freedom: none,
            p_value: none,
            log_posterior: none,
            log_evidence: none,
            is_converged: false,
            h0_ratio: none,
            failure,
        }
    }
}
