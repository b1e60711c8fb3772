//! Units that columns of tables state, and the factors that turn their numbers into haloray's own units.

use std::f64::consts::PI;

/// What a column measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Dimension {
    Angle,
    Mass,
    Number,
}

/// Names of an angle's units and their size in arcsec.
const ANGLES: [(&[&str], f64); 7] = [
    (&["arcsec", "arcsecs", "arcsecond", "arcseconds", "asec", "\"", "″"], 1.0),
    (&["arcmin", "arcmins", "arcminute", "arcminutes", "amin", "'", "′"], 60.0),
    (&["deg", "degs", "degree", "degrees", "°"], 3600.0),
    (&["rad", "radian", "radians"], 648_000.0 / PI),
    (&["mas", "milliarcsec", "milliarcsecond", "milliarcseconds"], 1e-3),
    (&["uas", "µas", "μas", "microarcsec", "microarcsecond", "microarcseconds"], 1e-6),
    (&["hourangle", "hourangles"], 54_000.0),
];
/// Names of the solar mass without blanks, underscores and TeX.
const SOLAR_MASS: [&str; 8] = ["msun", "msol", "solmass", "solarmass", "solarmasses", "m☉", "m⊙", "modot"];
/// What stands for no unit.
const NO_UNIT: [&str; 8] = ["", "1", "-", "--", "none", "dimensionless", "unitless", "redshift"];

/// The unit that a column of this name has in haloray; empty for pure numbers.
pub(super) fn own_unit(column: &str) -> &'static str {
    match dimension(column) {
        Dimension::Angle => "arcsec",
        Dimension::Mass => "solMass",
        Dimension::Number => "",
    }
}

/// A column's name ends in its unit, or it is a pure number.
fn dimension(column: &str) -> Dimension {
    let name = column.to_ascii_lowercase();
    match () {
        () if name.ends_with("_arcsec") => Dimension::Angle,
        () if name.ends_with("_msun") => Dimension::Mass,
        () => Dimension::Number,
    }
}

/// What numbers in `unit` are multiplied by for a column of this name, or what is wrong with the unit.
pub(super) fn factor(column: &str, unit: &str) -> Result<f64, String> {
    let (number, name) = split_factor(unit.trim());
    let plain: String = name.to_lowercase().chars().filter(|c| !" _$\\{}".contains(*c)).collect();
    let (size, allowed) = match dimension(column) {
        Dimension::Angle => {
            let found = ANGLES.iter().find(|(names, _)| names.contains(&plain.as_str()));
            (found.map(|(_, size)| *size), "arcsec, arcmin, deg, rad, mas, uas or hourangle")
        }
        Dimension::Mass => {
            let allowed = if names_little_h(&plain) {
                "Msun: divide the masses by h = H0/100 first"
            } else {
                "Msun (solMass), with a factor where wanted: 1e10 Msun"
            };
            (SOLAR_MASS.contains(&plain.as_str()).then_some(1.0), allowed)
        }
        Dimension::Number => (NO_UNIT.contains(&plain.as_str()).then_some(1.0), "without a unit"),
    };
    let factor = size.map(|size| size * number).filter(|factor| factor.is_finite() && *factor > 0.0);
    factor.ok_or_else(|| format!("has the unit '{}', but must be {allowed}", unit.trim()))
}

/// Arcsec in a unit of angles.
pub(crate) fn arcsec_in(unit: &str) -> Option<f64> {
    factor("_arcsec", unit).ok()
}

/// Solar masses in a unit of masses, and whether they are per h (`Msun/h`, `1e10 h^-1 Msun`); what is wrong with it otherwise.
pub(crate) fn solar_masses_in(stated: &str) -> Result<(f64, bool), String> {
    /// How people divide by h; the longest come first.
    const PER_H: [&str; 9] =
        ["/littleh", "littleh^-1", "littleh-1", "h^{-1}", "h**-1", "h^-1", "h^(-1)", "h-1", "/h"];
    let plain: String = stated.to_lowercase().chars().filter(|c| !" _$\\".contains(*c)).collect();
    let without = PER_H.iter().find_map(|per_h| plain.split_once(per_h));
    let (size, has_h) = match without {
        Some((before, after)) => (factor("_msun", &format!("{before}{after}")), true),
        None => (factor("_msun", stated), false),
    };
    let refuse = |_| {
        format!("has the unit '{}', but must be Msun or Msun/h, with a factor where wanted", stated.trim())
    };
    size.map(|size| (size, has_h)).map_err(refuse)
}

/// True for masses in units that depend on the Hubble constant.
fn names_little_h(plain: &str) -> bool {
    let rest = SOLAR_MASS.iter().find_map(|mass| plain.strip_prefix(mass).or(plain.strip_suffix(mass)));
    rest.is_some_and(|rest| rest.contains('h'))
}

/// A number in front of a unit (`1e10 Msun`, `10**10 solMass`, `10^10`), else 1, and the unit.
fn split_factor(unit: &str) -> (f64, &str) {
    let end = unit.find(|c: char| !(c.is_ascii_digit() || "+-.^*eE× ".contains(c))).unwrap_or(unit.len());
    let (head, name) = unit.split_at(end);
    let head = head.trim_end_matches([' ', '*', '.', '×']);
    let power = || {
        let (base, exponent) = head.split_once("**").or(head.split_once('^'))?;
        Some(base.trim().parse::<f64>().ok()?.powi(exponent.trim().parse().ok()?))
    };
    match head.parse().ok().or_else(power) {
        Some(number) if !name.is_empty() => (number, name),
        _ => (1.0, unit),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_units_have_their_factor() {
        for (column, unit, expected) in [
            ("theta_x_arcsec", "arcsec", 1.0),
            ("theta_x_arcsec", " DEG ", 3600.0),
            ("THETA_X_ARCSEC", "arcmin", 60.0),
            ("theta_x_arcsec", "rad", 206_264.806_247_096_36),
            ("theta_x_arcsec", "mas", 1e-3),
            ("theta_x_arcsec", "uas", 1e-6),
            ("theta_x_arcsec", "hourangle", 54_000.0),
            ("theta_x_arcsec", "1e-3 deg", 3.6),
            ("m200c_msun", "solMass", 1.0),
            ("m200c_msun", "M_sun", 1.0),
            ("m200c_msun", "$M_\\odot$", 1.0),
            ("m200c_msun", "1e10 Msun", 1e10),
            ("m200c_msun", "10^10 M⊙", 1e10),
            ("m200c_msun", "10**10 * solMass", 1e10),
            ("m200c_msun", "1.0e+10 solMass", 1e10),
            ("z", "redshift", 1.0),
            ("c200c", "", 1.0),
        ] {
            let found = factor(column, unit).unwrap();
            assert!((found / expected - 1.0).abs() < 1e-15, "{column} {unit}: {found}");
        }
    }

    #[test]
    fn masses_per_h_are_told_from_masses() {
        for (unit, expected) in [
            ("Msun", (1.0, false)),
            ("1e10 Msun", (1e10, false)),
            ("Msun/h", (1.0, true)),
            ("1e10 Msun/h", (1e10, true)),
            ("10^10 M_sun h^-1", (1e10, true)),
            ("h-1 Msun", (1.0, true)),
            ("$h^{-1} M_\\odot$", (1.0, true)),
            ("solMass / littleh", (1.0, true)),
        ] {
            assert_eq!(solar_masses_in(unit), Ok(expected), "{unit}");
        }
        for unit in ["kg", "Mpc/h", "h", "", "Msun/h/h"] {
            assert!(solar_masses_in(unit).unwrap_err().contains("must be Msun or Msun/h"), "{unit}");
        }
    }

    #[test]
    fn unknown_units_are_refused_with_what_is_allowed() {
        let fault = |column: &str, unit: &str| factor(column, unit).unwrap_err();
        assert_eq!(
            fault("theta_x_arcsec", "pix"),
            "has the unit 'pix', but must be arcsec, arcmin, deg, rad, mas, uas or hourangle"
        );
        for unit in ["Msun/h", "1e10 Msun/h", "Msun h-1", "h^-1 Msun", "solMass / littleh"] {
            assert!(
                fault("m200c_msun", unit).ends_with("Msun: divide the masses by h = H0/100 first"),
                "{unit}"
            );
        }
        assert!(fault("m200c_msun", "kg").contains("but must be Msun (solMass)"));
        assert!(fault("m200c_msun", "deg").contains("must be Msun"));
        assert_eq!(fault("z", "km/s"), "has the unit 'km/s', but must be without a unit");
        assert!(fault("z", "0 ").contains("without a unit"));
        assert!(factor("theta_x_arcsec", "0 deg").is_err());
        assert!(factor("theta_x_arcsec", "1e999 deg").is_err());
    }
}
