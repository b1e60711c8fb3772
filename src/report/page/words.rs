//! How the names of files are shown: `gamma1_los_best_tidal` as γ₁ with LOS, best tidal below it, and its unit.

use super::glossary::anchor_of;
use super::model::Label;

/// Ends of names that are units.
const UNITS: [(&str, &str); 10] = [
    ("_per_arcsec", "arcsec⁻¹"),
    ("_per_cmpc3", "Mpc⁻³"),
    ("_arcsec2", "arcsec²"),
    ("_arcsec", "arcsec"),
    ("_cmpc3", "Mpc³"),
    ("_cmpc", "Mpc"),
    ("_msun", "M☉"),
    ("_e_s", "e⁻/s"),
    ("_days", "days"),
    ("_sigma", "σ"),
];

/// First words that are signs.
const SIGNS: [(&str, &str, &str); 19] = [
    ("kappa", "κ", "κ"),
    ("gamma1", "γ₁", "γ"),
    ("gamma2", "γ₂", "γ"),
    ("gamma", "γ", "γ"),
    ("omega", "ω", "ω"),
    ("F1", "F₁", "F"),
    ("F2", "F₂", "F"),
    ("f", "F", "F"),
    ("G1", "G₁", "G"),
    ("G2", "G₂", "G"),
    ("g", "G", "G"),
    ("delta", "Δ", "Δ"),
    ("beta", "β", "β"),
    ("theta", "θ", ""),
    ("e1", "e₁", "e₁"),
    ("e2", "e₂", "e₂"),
    ("chi", "χ", ""),
    ("a", "A", ""),
    ("abs", "", ""),
];

/// Whole names that are called otherwise.
const NAMES: [(&str, &str, &str); 29] = [
    ("largest_kappa_h", "largest κ_h", "κ"),
    ("rms_gamma_los", "√⟨|γ_LOS|²⟩", "LOS"),
    ("rms_gamma_los_ring", "√⟨|γ_LOS|²⟩ along the ring", "ring"),
    ("number_of_sightlines", "sightlines", ""),
    ("number_failed", "sightlines that failed", ""),
    ("chi2", "χ²", "χ²/dof"),
    ("chi2_reduced", "χ²/dof", "χ²/dof"),
    ("p_value", "p-value", "p-value"),
    ("worst_r_hat", "worst R-hat", "R-hat"),
    ("r_hat", "R-hat", "R-hat"),
    ("worst_ess", "worst ESS", "ESS"),
    ("ess", "ESS", "ESS"),
    ("log_evidence", "ln Z", ""),
    ("log_evidence_error", "error of ln Z", ""),
    ("log_likelihood", "ln L", ""),
    ("quality", "Q", "Q"),
    ("productive", "productive", "productive"),
    ("coverage", "coverage", "coverage"),
    ("median", "median", "median"),
    ("hpd68", "68% interval", "68% interval"),
    ("hpd68_low", "68% from", "68% interval"),
    ("hpd68_high", "68% to", "68% interval"),
    ("ess_bulk", "ESS, bulk", "ESS"),
    ("ess_tail", "ESS, tails", "ESS"),
    ("bounded", "inside its prior", "at the edge"),
    ("min_point_shear", "shear cut", "shear cut"),
    ("m200c_msun", "M200c", "M200c"),
    ("number_beyond_tidal", "haloes beyond the tidal regime", "tidal regime"),
    ("number_kept", "haloes on the line of sight", "LOS"),
];

/// How a name is shown.
pub(super) fn label(name: &str) -> Label {
    let (stem, unit) =
        UNITS.iter().find_map(|(end, unit)| Some((name.strip_suffix(end)?, *unit))).unwrap_or((name, ""));
    let made =
        |text: &str, sub: String, term: String| Label { text: text.into(), sub, unit: unit.into(), term };
    if let Some((_, text, term)) = NAMES.iter().find(|(own, _, _)| *own == name) {
        return made(text, String::new(), anchor_of(&[term]));
    }
    // Names of parameters of a model stay as they are written in models.
    if name.contains('.') {
        let last = name.rsplit('.').next().unwrap_or(name);
        let term = match last {
            "theta_E" => "θ_E",
            "e1" => "e₁",
            "e2" => "e₂",
            _ => "",
        };
        return Label { text: name.into(), term: anchor_of(&[term]), ..Label::default() };
    }
    if let Some(inner) = stem.strip_prefix("abs_") {
        let inner = label(inner);
        return made(&format!("|{}|", inner.text), inner.sub, inner.term);
    }
    let (first, rest) = stem.split_once('_').unwrap_or((stem, ""));
    let Some((_, sign, term)) = SIGNS.iter().find(|(word, _, _)| *word == first) else {
        return made(&spoken(stem), String::new(), anchor_of(&[&spoken(stem)]));
    };
    let spaced = lowered(rest);
    let own = format!("{sign}_{spaced}");
    let place = spaced.split(", ").next().unwrap_or_default();
    let term = if first == "delta" { [own.as_str(), term, place] } else { [own.as_str(), place, term] };
    made(sign, spaced.clone(), anchor_of(&term))
}

/// A map's or image's name in one line of text.
pub(super) fn flat(label: &Label) -> String {
    if label.sub.is_empty() { label.text.clone() } else { format!("{} {}", label.text, label.sub) }
}

/// Words of a name, as spoken.
fn spoken(name: &str) -> String {
    name.replace('_', " ")
}

/// What stands below the line: the place first, then where it is averaged or what it is of.
fn lowered(rest: &str) -> String {
    let words = rest.replace("los", "LOS").replace('_', " ");
    let Some((place, more)) = words.split_once(' ') else { return words };
    match place {
        "od" | "os" | "ds" | "LOS" | "tot" | "h" => format!("{place}, {more}"),
        _ => words,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_become_signs_with_units_and_terms() {
        let shown = |name: &str| {
            let label = label(name);
            format!("{}|{}|{}|{}", label.text, label.sub, label.unit, label.term)
        };
        assert_eq!(shown("gamma1_los_best_tidal"), "γ₁|LOS, best tidal||term-LOS");
        assert_eq!(shown("F2_os_disc_per_arcsec"), "F₂|os, disc|arcsec⁻¹|term-os");
        assert_eq!(shown("delta_tot"), "Δ|tot||term-Δ-tot");
        assert_eq!(shown("a_xy"), "A|xy||");
        assert_eq!(shown("abs_f"), "|F||||term-F");
        assert_eq!(shown("rms_gamma_los"), "√⟨|γ_LOS|²⟩|||term-LOS");
        assert_eq!(shown("lens.theta_E"), "lens.theta_E|||term-θ-E");
        assert_eq!(shown("residual_best_tidal_arcsec"), "residual best tidal||arcsec|");
        assert_eq!(shown("number_kept"), "haloes on the line of sight|||term-LOS");
    }
}
