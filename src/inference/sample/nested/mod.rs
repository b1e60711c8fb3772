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

pub use self::evidence::Evidence;
use self::live_points::NestedRun;
use super::chains::Chains;
use super::point::Problem;
use crate::error::{Error, Result, require};
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
        for (what, value, least) in [
            ("runs", self.runs, 2),
            ("live_points", self.live_points, least_live),
            ("slices_per_coordinate", self.slices_per_coordinate, 1),
            ("max_shrinkage", self.max_shrinkage, 1),
        ] {
            let allowed = format!("at least {least}");
            require(value >= least, &format!("{what} of nested"), value as f64, &allowed)?;
        }
        let tolerance = self.log_evidence_tolerance;
        require(tolerance > 0.0, "log_evidence_tolerance of nested", tolerance, "positive")
    }
}

/// Everything a block starts from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct NestedState {
    settings: NestedSettings,
    climbs: Vec<NestedRun>,
    evidence: Option<Evidence>,
}

impl NestedState {
    pub fn start(settings: NestedSettings, seed: u64, problem: &Problem) -> Result<Self> {
        settings.check(problem.likelihood.dimension())?;
        let climbs: Option<Vec<NestedRun>> = (0..settings.runs)
            .into_par_iter()
            .map(|run| {
                let mut rng = stream(seed, run as u64, Stage::Sampling, 0);
                NestedRun::start(problem.likelihood, settings.live_points, &mut rng)
            })
            .collect();
        let climbs = climbs.ok_or_else(|| {
            let allowed = "finite somewhere under the priors";
            Error::out_of_range("the log-likelihood at every draw from the priors", "-inf", allowed)
        })?;
        Ok(Self { settings, climbs, evidence: None })
    }

    /// Replaces as many points as there are live ones in every run that has not ended.
    pub fn advance(&mut self, likelihood: &dyn LatentLikelihood, seed: u64, block: u64, chains: &mut Chains) {
        let settings = self.settings;
        self.climbs.par_iter_mut().enumerate().for_each(|(run, climb)| {
            let mut rng = stream(seed, run as u64, Stage::Sampling, block);
            let slices = settings.slices_per_coordinate * likelihood.dimension();
            climb.advance(likelihood, slices, settings.log_evidence_tolerance, &mut rng);
        });
        if self.climbs.iter().all(|climb| climb.has_ended) || block as usize >= settings.max_shrinkage {
            let (evidence, draws) = evidence::conclude(&self.climbs, seed);
            self.evidence = Some(evidence);
            chains.chains = draws;
        }
    }

    /// The evidence, once all runs have ended.
    pub fn evidence(&self) -> Option<Evidence> {
        self.evidence
    }

    /// True if the runs ended by their tolerance and not by the limit.
    pub fn has_ended(&self) -> bool {
        self.climbs.iter().all(|climb| climb.has_ended)
    }

    /// What the live points may still add to the log-evidence, the most of any run.
    pub fn remaining_log_evidence(&self) -> f64 {
        self.climbs.iter().map(NestedRun::remaining_log_evidence).fold(0.0, f64::max)
    }

    pub fn evaluations(&self) -> u64 {
        self.climbs.iter().map(|climb| climb.evaluations).sum()
    }
}
