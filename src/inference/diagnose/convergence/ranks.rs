//! Ranks of all draws together, turned into normal scores: what makes R-hat blind to heavy tails.

use statrs::distribution::{ContinuousCDF, Normal};

/// Normal scores Φ⁻¹((r − 3/8)/(S + 1/4)) of the ranks r among all S draws (Vehtari et al. 2021, equation 14);
/// ties share their mean rank.
pub(super) fn normal_scores<C: AsRef<[f64]>>(chains: &[C]) -> Vec<Vec<f64>> {
    let pooled: Vec<f64> = chains.iter().flat_map(|chain| chain.as_ref()).copied().collect();
    let mut order: Vec<usize> = (0..pooled.len()).collect();
    order.sort_unstable_by(|&a, &b| pooled[a].total_cmp(&pooled[b]));
    let mut scores = vec![0.0; pooled.len()];
    let normal = Normal::standard();
    let mut first = 0;
    for tie in order.chunk_by(|&a, &b| pooled[a] == pooled[b]) {
        let rank = first as f64 + 0.5 * (tie.len() + 1) as f64;
        let score = normal.inverse_cdf((rank - 0.375) / (pooled.len() as f64 + 0.25));
        tie.iter().for_each(|&index| scores[index] = score);
        first += tie.len();
    }
    let mut rest = scores.as_slice();
    let mut take = |length| {
        let (chain, after) = rest.split_at(length);
        rest = after;
        chain.to_vec()
    };
    chains.iter().map(|chain| take(chain.as_ref().len())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scores_follow_the_order_and_ties_share_theirs() {
        let scores = normal_scores(&[vec![1.0, 5.0, 5.0], vec![-2.0, 1e300, 5.0]]);
        // Ranks 2, 4, 4 and 1, 6, 4.
        assert!(scores[0][0] < 0.0 && scores[1][1] > 1.0 && (scores[1][1] + scores[1][0]).abs() < 1e-12);
        assert!(scores[0][1] == scores[0][2] && scores[0][1] == scores[1][2]);
        // Φ⁻¹(3.625/6.25), by scipy.stats.norm.ppf 1.17.
        assert!((scores[0][1] - 0.201_893_479_141_850_77).abs() < 1e-9, "{}", scores[0][1]);
    }
}
