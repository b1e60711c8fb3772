//! The draws of a fit, from which a reader of its page chooses the parameters whose panels are drawn.

use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::model::PosteriorParameter;
use crate::inference::DrawStatistics;
use crate::io::{PosteriorVariable, read_posterior};
use crate::report::interval_text;

/// Name of the file.
const POSTERIOR_FILE: &str = "posterior.nc";
/// Draws in a page, evenly chosen among all.
const MOST_DRAWS: usize = 1200;
/// Parameters that are shown before a choice is made.
const SHOWN_FIRST: usize = 3;

/// The parameters of the posterior in `folder`; none where there is no posterior, or but one parameter.
pub(super) fn posterior(folder: &Path) -> Vec<PosteriorParameter> {
    let Ok(variables) = read_posterior(&folder.join(POSTERIOR_FILE)) else { return Vec::new() };
    let mut parameters: Vec<PosteriorParameter> = variables.iter().filter_map(parameter).collect();
    if parameters.len() < 2 {
        return Vec::new();
    }
    // Shears of the line of sight and the Einstein radius, and whatever comes first.
    let rank = |name: &str| match name {
        "gamma1_los" | "gamma2_los" => 0,
        "lens.theta_E" => 1,
        _ if name.starts_with("gamma") => 2,
        _ => 3,
    };
    let mut order: Vec<usize> = (0..parameters.len()).collect();
    order.sort_by_key(|&i| (rank(&parameters[i].name), i));
    order.into_iter().take(SHOWN_FIRST).for_each(|i| parameters[i].is_shown = true);
    parameters
}

fn parameter(variable: &PosteriorVariable) -> Option<PosteriorParameter> {
    let draws = variable.draws.concat();
    let DrawStatistics { median, hpd68_low, hpd68_high, .. } = DrawStatistics::of(&draws)?;
    let every = draws.len().div_ceil(MOST_DRAWS).max(1);
    // About the median, so that four bytes keep the digits of a narrow posterior.
    let about = draws.iter().step_by(every).map(|draw| (draw - median) as f32);
    let bytes: Vec<u8> = about.flat_map(f32::to_le_bytes).collect();
    Some(PosteriorParameter {
        name: variable.name.clone(),
        label: if variable.label.is_empty() { variable.name.clone() } else { variable.label.clone() },
        unit: variable.unit.clone(),
        interval_text: interval_text(median, [hpd68_low, hpd68_high]),
        median,
        interval: [hpd68_low, hpd68_high],
        draws: STANDARD.encode(bytes),
        number_of_draws: draws.len(),
        is_shown: false,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_are_thinned_about_their_median_and_keep_the_digits_of_a_narrow_posterior() {
        let draws: Vec<f64> = (0..5001).map(|i| 1.2 + 1e-9 * f64::from(i * 7919 % 5001 - 2500)).collect();
        let variable = PosteriorVariable {
            name: "lens.theta_E".into(),
            unit: "arcsec".into(),
            label: "θ_{E}".into(),
            draws: vec![draws],
        };
        let shown = parameter(&variable).unwrap();
        assert_eq!((shown.number_of_draws, shown.median), (5001, 1.2));
        assert!(shown.interval_text.starts_with("1.2000000 ["), "{}", shown.interval_text);
        let bytes = STANDARD.decode(&shown.draws).unwrap();
        assert_eq!(bytes.len() / 4, 1001);
        let first = f32::from_le_bytes(bytes[..4].try_into().unwrap());
        assert!((f64::from(first) + 2.5e-6).abs() < 1e-11, "{first}");
        assert!(posterior(Path::new("/nowhere")).is_empty());
    }
}
