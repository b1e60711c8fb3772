//! Dual averaging of the step size (Hoffman & Gelman 2014, JMLR 15, 1593, section 3.2.1).

/// Shrinkage towards the first guess, their γ.
const SHRINKAGE: f64 = 0.05;
/// Iterations that count as already made, their t0.
const OFFSET: f64 = 10.0;
/// Exponent with which old iterations are forgotten, their κ.
const FORGETTING: f64 = 0.75;

/// The state of the search for the step size that gives the wanted acceptance.
pub(super) struct DualAveraging {
    target: f64,
    log_centre: f64,
    iteration: f64,
    mean_error: f64,
    log_step: f64,
    log_averaged: f64,
}

impl DualAveraging {
    /// A search around `first` for the mean acceptance `target`.
    pub fn new(first: f64, target: f64) -> Self {
        let log_step = first.ln();
        // Twice the first guess rather than their ten times: the metric is known, so the guess is near.
        let log_centre = (2.0 * first).ln();
        Self { target, log_centre, iteration: 0.0, mean_error: 0.0, log_step, log_averaged: log_step }
    }

    /// The step to take next.
    pub fn step(&self) -> f64 {
        self.log_step.exp()
    }

    /// The step to keep after the search.
    pub fn averaged(&self) -> f64 {
        self.log_averaged.exp()
    }

    /// Takes in the mean acceptance of one trajectory.
    pub fn update(&mut self, acceptance: f64) {
        self.iteration += 1.0;
        let weight = 1.0 / (self.iteration + OFFSET);
        self.mean_error += weight * (self.target - acceptance - self.mean_error);
        self.log_step = self.log_centre - self.iteration.sqrt() / SHRINKAGE * self.mean_error;
        let weight = self.iteration.powf(-FORGETTING);
        self.log_averaged += weight * (self.log_step - self.log_averaged);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_step_of_the_wanted_acceptance() {
        // An acceptance of 1/(1+ε²) is 0.8 at ε = 0.5.
        let mut search = DualAveraging::new(3.0, 0.8);
        for _ in 0..400 {
            search.update(1.0 / (1.0 + search.step().powi(2)));
        }
        assert!((search.averaged() - 0.5).abs() < 0.03, "{}", search.averaged());
    }
}
