//! R-hat and effective sizes against ArviZ, autocorrelation times against emcee.

use crate::oracle_table::{Agreement, Reference};
use haloray::inference::diagnose::{Convergence, autocorrelation_time};

/// Φ⁻¹ of two libraries, and sums of up to 8000 terms in another order.
const TOLERANCE: f64 = 1e-9;
/// emcee sums by fast Fourier transform.
const FOURIER_TOLERANCE: f64 = 1e-9;

/// The chains of `data/reference/make_convergence.py`.
fn chains(count: usize, draws: usize, rho: f64, kind: usize, seed: u64) -> Vec<Vec<f64>> {
    let mut state = seed;
    let chain = |number: usize| {
        let mut x = 0.0;
        let mut next = || {
            state = (1_664_525 * state + 1_013_904_223) % (1 << 32);
            x = rho * x + ((state as f64 + 0.5) / 4_294_967_296.0 - 0.5);
            match (kind, number) {
                (1, _) => x / (1e-3 + x * x),
                (2, _) => (4.0 * x).floor(),
                (3, 0) => x + 0.25,
                (4, 0) => 2.0 * x,
                _ => x,
            }
        };
        (0..draws).map(|_| next()).collect()
    };
    (0..count).map(chain).collect()
}

#[test]
fn diagnostics_agree_with_arviz_and_emcee() {
    let table = Reference::load("convergence");
    let column = |name: &str| table.column(name);
    let mut ours = vec![Vec::new(); 4];
    for row in 0..column("seed").len() {
        let at = |name: &str| column(name)[row];
        let chains = chains(
            at("chains") as usize,
            at("draws") as usize,
            at("rho"),
            at("kind") as usize,
            at("seed") as u64,
        );
        let convergence = Convergence::of(&chains, 1);
        ours[0].push(convergence.r_hat);
        ours[1].push(convergence.ess_bulk);
        ours[2].push(convergence.ess_tail);
        ours[3].push(autocorrelation_time(&chains));
    }
    for (name, ours) in ["r_hat", "ess_bulk", "ess_tail"].into_iter().zip(&ours) {
        Agreement::of(name, ours, column(name)).require_max(TOLERANCE);
    }
    Agreement::of("tau", &ours[3], column("tau")).require_max(FOURIER_TOLERANCE);
}
