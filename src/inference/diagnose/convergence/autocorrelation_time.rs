//! The integrated autocorrelation time of an ensemble as emcee estimates it, to compare samplers on equal terms.

use super::moments::mean;

/// Window over autocorrelation time at which the sum is cut (Sokal 1989), emcee's default.
const WINDOW: f64 = 5.0;

/// Integrated autocorrelation time in draws, τ = 1 + 2 Σ ρ(t) over t ≤ M with the smallest M ≥ 5 τ(M), where ρ
/// is the mean of the chains' normalised autocorrelations (Sokal 1989; Goodman & Weare 2010; as
/// `emcee.autocorr.integrated_time`).
///
/// Reliable for chains longer than 50 τ. NaN for constant chains or fewer than 2 draws.
pub fn autocorrelation_time<C: AsRef<[f64]>>(chains: &[C]) -> f64 {
    let centred: Vec<Vec<f64>> = chains
        .iter()
        .map(|chain| {
            let mean = mean(chain.as_ref());
            chain.as_ref().iter().map(|value| value - mean).collect()
        })
        .collect();
    let draws = centred.first().map_or(0, Vec::len);
    if draws < 2 {
        return f64::NAN;
    }
    let autocovariance =
        |chain: &[f64], lag: usize| chain.iter().zip(&chain[lag..]).map(|(a, b)| a * b).sum::<f64>();
    let zero_lag: Vec<f64> = centred.iter().map(|chain| autocovariance(chain, 0)).collect();
    let correlation = |lag: usize| {
        let of = |(chain, zero): (&Vec<f64>, &f64)| autocovariance(chain, lag) / zero;
        centred.iter().zip(&zero_lag).map(of).sum::<f64>() / centred.len() as f64
    };
    let mut time = 1.0;
    for lag in 1..draws {
        time += 2.0 * correlation(lag);
        if lag as f64 >= WINDOW * time {
            break;
        }
    }
    time
}
