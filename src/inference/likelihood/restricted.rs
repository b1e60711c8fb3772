//! A likelihood without the cost of flat priors, and one of all coordinates but one.

use super::latent::{Curvature, LatentLikelihood, NoCurvature};

/// ln L alone where priors are flat: their latent coordinates cost nothing.
pub(in crate::inference) struct WithinEdges<'a> {
    pub likelihood: &'a dyn LatentLikelihood,
    pub is_flat: Vec<bool>,
}

impl WithinEdges<'_> {
    /// What the priors that are left out would take, ½z² each.
    pub fn free_of_charge(&self, latent: &[f64]) -> f64 {
        let flat = latent.iter().zip(&self.is_flat).filter(|(_, is_flat)| **is_flat);
        0.5 * flat.map(|(z, _)| z * z).sum::<f64>()
    }
}

impl LatentLikelihood for WithinEdges<'_> {
    fn dimension(&self) -> usize {
        self.likelihood.dimension()
    }

    fn log_likelihood(&self, latent: &[f64]) -> f64 {
        self.likelihood.log_likelihood(latent) + self.free_of_charge(latent)
    }

    fn log_likelihood_gradient(&self, latent: &[f64], gradient: &mut [f64]) -> f64 {
        let value = self.likelihood.log_likelihood_gradient(latent, gradient);
        let flat = gradient.iter_mut().zip(latent).zip(&self.is_flat).filter(|(_, is_flat)| **is_flat);
        flat.for_each(|((slope, z), _)| *slope += z);
        value + self.free_of_charge(latent)
    }

    fn curvature(&self, latent: &[f64]) -> Result<Curvature, NoCurvature> {
        /// What is left of the unit prior, so that a direction that the image does not measure has a scale.
        const LEAST: f64 = 1e-3;
        let mut found = self.likelihood.curvature(latent)?;
        found.log_posterior += self.free_of_charge(latent);
        for i in (0..latent.len()).filter(|i| self.is_flat[*i]) {
            found.gradient[i] += latent[i];
            found.metric[(i, i)] -= 1.0 - LEAST;
        }
        Ok(found)
    }

    fn is_cancelled(&self) -> bool {
        self.likelihood.is_cancelled()
    }
}

/// A likelihood over all coordinates but one, which is held.
pub(in crate::inference) struct Others<'a> {
    pub likelihood: &'a dyn LatentLikelihood,
    pub index: usize,
    pub held: f64,
}

impl Others<'_> {
    /// All coordinates.
    pub fn with_held(&self, others: &[f64]) -> Vec<f64> {
        let mut latent = others.to_vec();
        latent.insert(self.index, self.held);
        latent
    }

    /// What the held coordinate's prior takes from a posterior density of all, and not from one of the others.
    fn own(&self) -> f64 {
        0.5 * self.held * self.held
    }
}

impl LatentLikelihood for Others<'_> {
    fn dimension(&self) -> usize {
        self.likelihood.dimension() - 1
    }

    fn log_likelihood(&self, others: &[f64]) -> f64 {
        self.likelihood.log_likelihood(&self.with_held(others))
    }

    fn log_likelihood_gradient(&self, others: &[f64], gradient: &mut [f64]) -> f64 {
        let mut of_all = vec![0.0; self.likelihood.dimension()];
        let value = self.likelihood.log_likelihood_gradient(&self.with_held(others), &mut of_all);
        of_all.remove(self.index);
        gradient.copy_from_slice(&of_all);
        value
    }

    fn curvature(&self, others: &[f64]) -> Result<Curvature, NoCurvature> {
        let Curvature { log_posterior, gradient, metric } =
            self.likelihood.curvature(&self.with_held(others))?;
        Ok(Curvature {
            log_posterior: log_posterior + self.own(),
            gradient: gradient.remove_row(self.index),
            metric: metric.remove_row(self.index).remove_column(self.index),
        })
    }

    fn is_cancelled(&self) -> bool {
        self.likelihood.is_cancelled()
    }
}
