//! What a user of a fit must know before its numbers are believed.

use super::number_text::number_text;
use crate::inference::{Fit, ParameterSummary, UnsampledMaximum, negative_lights};

/// Names of the parameters whose interval reaches an edge of their prior.
pub(super) fn at_edge(fit: &Fit) -> impl Iterator<Item = &str> {
    fit.parameters.iter().filter(|p| !p.bounded).map(|p| p.name.as_str())
}

/// What speaks against image, model or intervals, in words.
pub(super) fn warnings(fit: &Fit) -> Vec<String> {
    let mut warnings = fit.doubts.clone();
    warnings.extend(fit.goodness.doubts(fit.chi2_reduced()));
    warnings.extend(negative_lights(&fit.likelihood, &fit.image));
    if !fit.status.is_converged {
        warnings.push("the chains have not converged: draws do not yet stand for the posterior".into());
    }
    if let Some(UnsampledMaximum { below, outside: (name, value) }) = &fit.unsampled {
        /// Less than this is nothing.
        const LOWER: f64 = 0.05;
        let at = format!("{name} = {}", number_text(*value, 4));
        warnings.push(match *below {
            below if below < LOWER => format!(
                "the highest maximum lies where no draw comes, at {at}: it is narrow, or the chains have missed it; fit again with \
                 another --seed, or with a narrower prior, to see it"
            ),
            below => format!(
                "another maximum is only {below:.1} lower in ln p, at {at}, where no draw comes: intervals describe one of the \
                 two; fit again with another --seed, or with a narrower prior, to see it"
            ),
        });
    }
    if fit.status.is_converged {
        warnings.extend(volume_doubt(&fit.parameters));
    }
    let at_edge: Vec<&str> = at_edge(fit).collect();
    if !at_edge.is_empty() {
        let names = at_edge.join(", ");
        warnings.push(format!("at the edge of their priors, which decide there and not the image: {names}"));
    }
    warnings
}

/// Where draws are far from the highest maximum they are many for the room that other parameters have there, and not for what
/// the image says.
fn volume_doubt(parameters: &[ParameterSummary]) -> Option<String> {
    /// Standard deviations. Half a normal distribution at an edge lies 1.3 from its maximum, an exponential one 1.
    const FAR: f64 = 2.0;
    let mut far: Vec<(f64, &str)> = parameters
        .iter()
        .filter(|p| !p.derived)
        .map(|p| ((p.mean - p.best_fit).abs() / p.standard_deviation, p.name.as_str()))
        .filter(|(deviations, _)| *deviations > FAR)
        .collect();
    far.sort_by(|a, b| b.0.total_cmp(&a.0));
    let names: Vec<String> =
        far.iter().map(|(deviations, name)| format!("{name} ({deviations:.1})")).collect();
    let [(_, farthest), ..] = far[..] else { return None };
    Some(format!(
        "draws lie more than {FAR} of their standard deviations from the best fit in {}: not the image alone but the room that \
         other parameters have under their priors decides where; --profile {farthest} shows what the image says",
        names.join(", ")
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_far_from_the_best_fit_are_doubted_the_farthest_first() {
        let parameter = |name: &str, best_fit: f64, derived: bool| ParameterSummary {
            name: name.into(),
            unit: "",
            label: name.into(),
            derived,
            mean: 0.5,
            median: 0.5,
            standard_deviation: 0.1,
            best_fit,
            hpd68_low: 0.4,
            hpd68_high: 0.6,
            bounded: true,
            r_hat: 1.0,
            ess_bulk: 1000.0,
            ess_tail: 1000.0,
        };
        assert_eq!(volume_doubt(&[parameter("a", 0.31, false), parameter("c", 0.0, true)]), None);
        let far = [parameter("a", 0.29, false), parameter("b", 0.8, false), parameter("c", 0.5, false)];
        let doubt = volume_doubt(&far).unwrap();
        assert!(doubt.contains("in b (3.0), a (2.1): not the image alone"), "{doubt}");
        assert!(doubt.ends_with("--profile b shows what the image says"), "{doubt}");
    }
}
