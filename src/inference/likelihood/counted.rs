//! A likelihood that counts its evaluations and ends with the work it is part of.

use std::sync::atomic::{AtomicU64, Ordering};

use super::latent::{Curvature, LatentLikelihood, NoCurvature};
use crate::error::Result;
use crate::monitor::Monitor;

/// Evaluations of one or several likelihoods, and who may stop them.
pub struct Counter<'a> {
    evaluations: AtomicU64,
    monitor: &'a dyn Monitor,
}

impl<'a> Counter<'a> {
    /// Nothing counted yet.
    pub fn new(monitor: &'a dyn Monitor) -> Self {
        Self { evaluations: AtomicU64::new(0), monitor }
    }

    /// The same likelihood, its evaluations counted here; once work is to stop it is zero everywhere, at no cost.
    pub fn watch<'b>(&'b self, likelihood: &'b dyn LatentLikelihood) -> CountedLikelihood<'b> {
        CountedLikelihood { likelihood, evaluations: &self.evaluations, monitor: self.monitor }
    }

    /// Evaluations so far: values, values with gradient, curvatures.
    ///
    /// # Errors
    /// [`Error::Cancelled`](crate::Error::Cancelled) once work is to stop: what was computed with zeros is worth nothing.
    pub fn evaluations(&self) -> Result<u64> {
        self.monitor.check()?;
        Ok(self.evaluations.load(Ordering::Relaxed))
    }
}

/// A likelihood under a [`Counter`].
pub struct CountedLikelihood<'a> {
    likelihood: &'a dyn LatentLikelihood,
    evaluations: &'a AtomicU64,
    monitor: &'a dyn Monitor,
}

impl CountedLikelihood<'_> {
    fn inner(&self) -> Option<&dyn LatentLikelihood> {
        self.evaluations.fetch_add(1, Ordering::Relaxed);
        (!self.monitor.is_cancelled()).then_some(self.likelihood)
    }
}

impl LatentLikelihood for CountedLikelihood<'_> {
    fn dimension(&self) -> usize {
        self.likelihood.dimension()
    }

    fn log_likelihood(&self, latent: &[f64]) -> f64 {
        self.inner().map_or(f64::NEG_INFINITY, |inner| inner.log_likelihood(latent))
    }

    fn log_likelihood_gradient(&self, latent: &[f64], gradient: &mut [f64]) -> f64 {
        self.inner().map_or(f64::NEG_INFINITY, |inner| inner.log_likelihood_gradient(latent, gradient))
    }

    fn curvature(&self, latent: &[f64]) -> std::result::Result<Curvature, NoCurvature> {
        self.inner().ok_or(NoCurvature::ZeroLikelihood)?.curvature(latent)
    }

    fn is_cancelled(&self) -> bool {
        self.monitor.is_cancelled()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicBool;

    use super::*;
    use crate::error::Error;

    struct Flat;

    impl LatentLikelihood for Flat {
        fn dimension(&self) -> usize {
            1
        }
        fn log_likelihood(&self, _: &[f64]) -> f64 {
            0.0
        }
        fn log_likelihood_gradient(&self, _: &[f64], gradient: &mut [f64]) -> f64 {
            gradient.fill(0.0);
            0.0
        }
    }

    #[derive(Default)]
    struct Switch(AtomicBool);

    impl Monitor for Switch {
        fn begin(&self, _: &str, _: Option<u64>) {}
        fn advance(&self, _: u64) {}
        fn tell(&self, _: &str) {}
        fn end(&self) {}
        fn is_cancelled(&self) -> bool {
            self.0.load(Ordering::Relaxed)
        }
    }

    #[test]
    fn every_evaluation_counts_until_work_is_stopped() {
        let switch = Switch::default();
        let counter = Counter::new(&switch);
        let (one, two) = (counter.watch(&Flat), counter.watch(&Flat));
        assert_eq!((one.log_likelihood(&[0.0]), two.log_likelihood_gradient(&[0.0], &mut [0.0])), (0.0, 0.0));
        assert_eq!(one.curvature(&[0.0]).unwrap_err(), NoCurvature::Unknown);
        assert_eq!(counter.evaluations().unwrap(), 3);
        switch.0.store(true, Ordering::Relaxed);
        assert_eq!(one.log_likelihood(&[0.0]), f64::NEG_INFINITY);
        assert!(one.is_cancelled() && matches!(counter.evaluations(), Err(Error::Cancelled)));
    }
}
