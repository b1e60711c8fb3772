//! Nested sampling for the evidence: independent runs whose live points climb to the peak by slice moves.
//!
//! Skilling (2006, Bayesian Anal. 1, 833); new points by slices through live ones, in the coordinates that
//! whiten the live points (Handley, Hobson & Lasenby 2015, MNRAS 453, 4384). The runs are merged for the
//! evidence (Higson et al. 2018, Bayesian Anal. 13, 873) and stay apart as chains, so that R-hat compares runs
//! that know nothing of one another.

mod evidence;
mod live_points;

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use self::live_points::NestedRun;
use super::chains::Chains;
use super::problem::Problem;
use super::sampler::{Evidence, EvidenceSoFar, Sampler};
use crate::error::{Domain, Error, Result};
use crate::inference::LatentLikelihood;
use crate::numerics::random::{Stage, stream};

/// Settings of nested sampling.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct NestedSettings {
    /// Independent runs, at least 2; they are computed side by side.
    pub runs: usize,
    /// Live points of each run, at least 10 and more than twice the number of coordinates.
    pub live_points: usize,
    /// Slices per latent coordinate from a live point to a new one, at least 1. Too few bias the evidence
    /// upwards: by 0.8 with 1, 0.2 with 2, less than 0.1 with 5, for a normal posterior in ten dimensions.
    pub slices_per_coordinate: usize,
    /// A run ends when its live points cannot add more than this to the log-evidence.
    pub log_evidence_tolerance: f64,
    /// Replaced points of a run, in units of its live points, after which it stops unfinished.
    pub max_shrinkage: usize,
}

impl Default for NestedSettings {
    fn default() -> Self {
        Self {
            runs: 4,
            live_points: 125,
            slices_per_coordinate: 5,
            log_evidence_tolerance: 0.01,
            max_shrinkage: 500,
        }
    }
}

impl NestedSettings {
    fn check(&self, dimension: usize) -> Result<()> {
        let least_live = (2 * dimension + 1).max(10);
        for (what, value, domain) in [
            ("runs", self.runs as f64, Domain::at_least(2.0)),
            ("live_points", self.live_points as f64, Domain::at_least(least_live as f64)),
            ("slices_per_coordinate", self.slices_per_coordinate as f64, Domain::at_least(1.0)),
            ("max_shrinkage", self.max_shrinkage as f64, Domain::at_least(1.0)),
            ("log_evidence_tolerance", self.log_evidence_tolerance, Domain::POSITIVE),
        ] {
            domain.check(&format!("{what} of nested"), value)?;
        }
        Ok(())
    }
}

/// Everything a block starts from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Nested {
    pub settings: NestedSettings,
    runs: Vec<NestedRun>,
    evidence: Option<Evidence>,
}

impl Nested {
    pub fn start(settings: NestedSettings, seed: u64, problem: &Problem) -> Result<Self> {
        settings.check(problem.likelihood.dimension())?;
        let runs: Option<Vec<NestedRun>> = (0..settings.runs)
            .into_par_iter()
            .map(|run| {
                let mut rng = stream(seed, run as u64, Stage::Sampling, 0);
                NestedRun::start(problem.likelihood, settings.live_points, &mut rng)
            })
            .collect();
        let runs = runs.ok_or_else(|| {
            let allowed = "finite somewhere under the priors";
            Error::out_of_range("the log-likelihood at every draw from the priors", "-inf", allowed)
        })?;
        Ok(Self { settings, runs, evidence: None })
    }
}

impl Sampler for Nested {
    fn empty_chains(&self, dimension: usize) -> Chains {
        Chains::new(dimension, self.settings.runs, 1)
    }

    /// Replaces as many points as there are live ones in every run that has not ended.
    fn advance(&mut self, likelihood: &dyn LatentLikelihood, seed: u64, block: u64, chains: &mut Chains) {
        let settings = self.settings;
        self.runs.par_iter_mut().enumerate().for_each(|(number, run)| {
            let mut rng = stream(seed, number as u64, Stage::Sampling, block);
            let slices = settings.slices_per_coordinate * likelihood.dimension();
            run.advance(likelihood, slices, settings.log_evidence_tolerance, &mut rng);
        });
        if self.runs.iter().all(|run| run.has_ended) || block as usize >= settings.max_shrinkage {
            let (evidence, draws) = evidence::conclude(&self.runs, seed);
            self.evidence = Some(evidence);
            chains.chains = draws;
        }
    }

    fn max_draws(&self) -> Option<usize> {
        None
    }

    fn evidence(&self) -> Option<EvidenceSoFar> {
        Some(EvidenceSoFar {
            evidence: self.evidence,
            remaining_log_evidence: self
                .runs
                .iter()
                .map(NestedRun::remaining_log_evidence)
                .fold(0.0, f64::max),
            is_precise: self.runs.iter().all(|run| run.has_ended),
        })
    }

    fn fits(&self, dimension: usize) -> bool {
        let live_points = self.settings.live_points;
        self.runs.len() == self.settings.runs && self.runs.iter().all(|run| run.fits(live_points, dimension))
    }
}
