//! Which columns of a light cone are what, in which units and definitions: stated by the file, or asked for; never guessed.

use std::path::Path;

use crate::config::LightconeConfig;
use crate::error::{Error, Result, shortest};
use crate::halo::MassDefinition;
use crate::io::containers::{ColumnTitle, degrees_in, solar_masses_in};

/// The columns of right ascension, declination, redshift, mass and, if there is one, concentration.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ConeColumns {
    /// Their numbers in the file, in that order.
    pub(super) places: Vec<usize>,
    /// Their names.
    pub(super) names: Vec<String>,
    /// What their numbers are multiplied by to be degrees, pure numbers and solar masses.
    pub(super) factors: Vec<f64>,
    pub(super) mass_definition: MassDefinition,
    pub(super) concentration_definition: MassDefinition,
}

const RA: [&str; 4] = ["ra_deg", "ra", "ra_rad", "right_ascension"];
const DEC: [&str; 4] = ["dec_deg", "dec", "dec_rad", "declination"];
const REDSHIFT: [&str; 2] = ["z", "redshift"];
/// Names of a concentration that do not say of which definition it is.
const CONCENTRATION: [&str; 2] = ["concentration", "conc"];

/// A file's columns, and what the user says of them.
struct Reader<'a> {
    path: &'a Path,
    titles: &'a [ColumnTitle],
}

/// Finds the columns of a file, and says in one line what they were taken for.
pub(super) fn identify(
    path: &Path,
    titles: &[ColumnTitle],
    cone: &LightconeConfig,
) -> Result<(ConeColumns, String)> {
    let reader = Reader { path, titles };
    let named = |names: &'static [&'static str]| move |name: &str| names.contains(&name);
    let ra = reader.required("right ascension", "ra", &cone.ra, named(&RA))?;
    let dec = reader.required("declination", "dec", &cone.dec, named(&DEC))?;
    let z = reader.required("redshift", "redshift", &cone.redshift, named(&REDSHIFT))?;
    let mass = reader.required("mass", "mass", &cone.mass, |name| definition_in(name, 'm').is_some())?;
    let is_concentration = |name: &str| definition_in(name, 'c').is_some() || CONCENTRATION.contains(&name);
    let concentration = reader.found("concentration", &cone.concentration, is_concentration)?;

    let mass_definition =
        reader.definition(mass, 'm', cone.mass_definition, "mass-definition", "mass_definition")?;
    let concentration_definition = match concentration {
        None => MassDefinition::Critical(200.0),
        Some(place) => reader.definition(
            place,
            'c',
            cone.concentration_definition,
            "concentration-definition",
            "concentration_definition",
        )?,
    };
    for place in [Some(z), concentration].into_iter().flatten() {
        reader.no_unit(place)?;
    }
    let (mass_factor, mass_unit) = reader.mass_factor(mass, cone)?;
    let mut factors = vec![reader.degrees(ra, cone)?, reader.degrees(dec, cone)?, 1.0, mass_factor];
    let mut places = vec![ra, dec, z, mass];
    if let Some(place) = concentration {
        places.push(place);
        factors.push(1.0);
    }
    let names: Vec<String> = places.iter().map(|&place| titles[place].name.clone()).collect();
    let in_words = format!(
        "RA in {}, Dec in {}, redshift in {}, M{mass_definition} in {} ({mass_unit}), {}",
        names[0],
        names[1],
        names[2],
        names[3],
        match names.get(4) {
            Some(name) => format!("c{concentration_definition} in {name}"),
            None => "no concentrations: haloes.concentration gives them".into(),
        }
    );
    Ok((ConeColumns { places, names, factors, mass_definition, concentration_definition }, in_words))
}

impl Reader<'_> {
    fn fault(&self, problem: String) -> Error {
        Error::table(self.path, "columns", problem)
    }

    fn present(&self) -> String {
        const LISTED: usize = 40;
        let names: Vec<&str> = self.titles.iter().take(LISTED).map(|title| title.name.as_str()).collect();
        names.join(", ")
    }

    /// The column of that name, or the only one whose name is known.
    fn found(
        &self,
        what: &str,
        given: &Option<String>,
        is_known: impl Fn(&str) -> bool,
    ) -> Result<Option<usize>> {
        if let Some(name) = given {
            let exact = self.titles.iter().position(|title| title.name == *name);
            let place =
                exact.or_else(|| self.titles.iter().position(|title| title.name.eq_ignore_ascii_case(name)));
            let problem = || {
                format!(
                    "there is no column {name} for the {what}; the columns present are {}",
                    self.present()
                )
            };
            return place.map(Some).ok_or_else(|| self.fault(problem()));
        }
        let known: Vec<usize> =
            (0..self.titles.len()).filter(|&i| is_known(&self.titles[i].name.to_ascii_lowercase())).collect();
        match known.as_slice() {
            [] => Ok(None),
            [only] => Ok(Some(*only)),
            several => {
                let names: Vec<&str> = several.iter().map(|&i| self.titles[i].name.as_str()).collect();
                let problem = format!("several may be the {what}: {}; say which", names.join(", "));
                Err(self.fault(format!("{problem} with {}", option_of(what))))
            }
        }
    }

    fn required(
        &self,
        what: &str,
        option: &str,
        given: &Option<String>,
        is_known: impl Fn(&str) -> bool,
    ) -> Result<usize> {
        self.found(what, given, is_known)?.ok_or_else(|| {
            self.fault(format!(
                "none is known as the {what}; the columns present are {}; say which with --{option}",
                self.present()
            ))
        })
    }

    /// The definition in a column's name, or the one that is said; both must agree.
    fn definition(
        &self,
        place: usize,
        letter: char,
        said: Option<MassDefinition>,
        option: &str,
        key: &str,
    ) -> Result<MassDefinition> {
        let name = &self.titles[place].name;
        let of_column = |problem: String| Error::table(self.path, format!("column {name}"), problem);
        match (definition_in(&name.to_ascii_lowercase(), letter), said) {
            (Some(own), Some(said)) if own != said => {
                Err(of_column(format!("is of the definition {own} by its name, but {key} says {said}")))
            }
            (Some(own), _) => Ok(own),
            (None, Some(said)) => Ok(said),
            (None, None) => Err(of_column(format!(
                "does not say of which definition it is; say 200c, 200m, vir, 500c … with --{option} (haloes.lightcone.{key})"
            ))),
        }
    }

    fn no_unit(&self, place: usize) -> Result<()> {
        let ColumnTitle { name, unit } = &self.titles[place];
        const NONE: [&str; 6] = ["", "1", "-", "none", "dimensionless", "redshift"];
        match unit.as_deref().map(|unit| unit.trim().to_ascii_lowercase()) {
            Some(unit) if !NONE.contains(&unit.as_str()) => {
                let problem = format!("has the unit '{unit}', but must be without a unit");
                Err(Error::table(self.path, format!("column {name}"), problem))
            }
            _ => Ok(()),
        }
    }

    fn degrees(&self, place: usize, cone: &LightconeConfig) -> Result<f64> {
        let ColumnTitle { name, unit } = &self.titles[place];
        let lower = name.to_ascii_lowercase();
        let by_name = ["_deg", "_rad"].into_iter().find(|suffix| lower.ends_with(suffix));
        let stated = unit.as_deref().or(by_name.map(|suffix| &suffix[1..]));
        let fault = |problem: String| Error::table(self.path, format!("column {name}"), problem);
        let factor = |unit: &str| degrees_in(unit).map_err(fault);
        match (stated, cone.angle_unit.as_deref()) {
            (Some(stated), Some(said)) if factor(stated)? != factor(said)? => {
                Err(fault(format!("is in {stated}, but angle_unit says {said}")))
            }
            (Some(unit), _) | (None, Some(unit)) => factor(unit),
            (None, None) => Err(fault(
                "states no unit; say deg, rad or hourangle with --angle-unit (haloes.lightcone.angle_unit)"
                    .into(),
            )),
        }
    }

    /// Factor to solar masses, and the unit in words.
    fn mass_factor(&self, place: usize, cone: &LightconeConfig) -> Result<(f64, String)> {
        let ColumnTitle { name, unit } = &self.titles[place];
        let fault = |problem: String| Error::table(self.path, format!("column {name}"), problem);
        let parsed = |unit: &str| solar_masses_in(unit).map_err(fault);
        let stated = unit.as_deref().or(unit_in(&name.to_ascii_lowercase()));
        let unit = match (stated, cone.mass_unit.as_deref()) {
            (Some(stated), Some(said)) if parsed(stated)? != parsed(said)? => {
                return Err(fault(format!("is in {stated}, but mass_unit says {said}")));
            }
            (Some(unit), _) | (None, Some(unit)) => unit,
            (None, None) => {
                return Err(fault(
                    "states no unit; say Msun, Msun/h, 1e10 Msun/h … with --mass-unit (haloes.lightcone.mass_unit)"
                        .into(),
                ));
            }
        };
        match (parsed(unit)?, cone.h) {
            ((factor, true), Some(h)) => Ok((factor / h, format!("{unit}, h = {}", shortest(h)))),
            ((factor, false), None) => Ok((factor, unit.into())),
            ((_, true), None) => Err(fault(format!(
                "is in {unit}; say h = H0/100 of the simulation with --h (haloes.lightcone.h)"
            ))),
            ((_, false), Some(h)) => {
                Err(fault(format!("is in {unit}, without h, but h = {} is said", shortest(h))))
            }
        }
    }
}

fn option_of(what: &str) -> &'static str {
    match what {
        "right ascension" => "--ra",
        "declination" => "--dec",
        "redshift" => "--redshift",
        "mass" => "--mass",
        _ => "--concentration",
    }
}

/// `m200c_msun`, `M_200c`, `Mvir`, `M200b` … and the same with c: the definition in a lower-case name.
fn definition_in(name: &str, letter: char) -> Option<MassDefinition> {
    let rest = name.strip_prefix(letter)?;
    let rest = rest.strip_prefix('_').unwrap_or(rest);
    let word = rest.split('_').next().unwrap_or_default();
    // Rockstar's b is the background, the mean density.
    let mean = word.strip_suffix('b').map(|number| format!("{number}m"));
    let definition: MassDefinition = mean.as_deref().unwrap_or(word).parse().ok()?;
    let unit = rest[word.len()..].trim_start_matches('_');
    let is_complete = unit.is_empty() || letter == 'm' && unit_in(name).is_some();
    (is_complete && definition != MassDefinition::FriendsOfFriends).then_some(definition)
}

/// The unit in which a lower-case name ends.
fn unit_in(name: &str) -> Option<&'static str> {
    const WITH_H: [&str; 3] = ["_msun_h", "_msunh", "_msun_over_h"];
    match () {
        () if WITH_H.iter().any(|suffix| name.ends_with(suffix)) => Some("Msun/h"),
        () if name.ends_with("_msun") => Some("Msun"),
        () => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn titles(text: &str) -> Vec<ColumnTitle> {
        let title = |word: &str| {
            let (name, unit) = word.split_once(':').map_or((word, None), |(name, unit)| (name, Some(unit)));
            ColumnTitle { name: name.into(), unit: unit.map(Into::into) }
        };
        text.split(' ').map(title).collect()
    }

    fn found(text: &str, cone: &LightconeConfig) -> std::result::Result<ConeColumns, String> {
        let found = identify(Path::new("cone.h5"), &titles(text), cone);
        found.map(|(columns, _)| columns).map_err(|error| error.to_string())
    }

    #[test]
    fn files_that_say_what_they_hold_need_no_words() {
        let none = LightconeConfig::default();
        let plain = found("id ra_deg dec_deg z m200c_msun c200c", &none).unwrap();
        assert_eq!((plain.places, plain.factors), (vec![1, 2, 3, 4, 5], vec![1.0; 5]));
        let stated = found("RA:rad DEC:deg redshift Mvir:1e10Msun", &none).unwrap();
        assert_eq!(stated.mass_definition, MassDefinition::Virial);
        assert!((stated.factors[0] - 180.0 / std::f64::consts::PI).abs() < 1e-12);
        assert_eq!(stated.factors[1..], [1.0, 1.0, 1e10]);
        let with_h = LightconeConfig { h: Some(0.5), ..none };
        let rockstar = found("ra_deg dec_deg z m200b_msun_h cvir", &with_h).unwrap();
        assert_eq!((rockstar.mass_definition, rockstar.factors[3]), (MassDefinition::Mean(200.0), 2.0));
        assert_eq!(rockstar.concentration_definition, MassDefinition::Virial);
    }

    #[test]
    fn what_is_not_clear_is_asked_for() {
        let none = LightconeConfig::default();
        let with_h = LightconeConfig { h: Some(0.7), ..none.clone() };
        let rad = LightconeConfig { angle_unit: Some("rad".into()), ..none.clone() };
        let mvir = LightconeConfig { mass: Some("M200c".into()), ..none.clone() };
        for (columns, cone, wanted) in [
            (
                "ra dec z m200c_msun",
                &none,
                "column ra: states no unit; say deg, rad or hourangle with --angle-unit",
            ),
            ("ra_deg dec_deg z m200c", &none, "column m200c: states no unit; say Msun"),
            ("ra_deg dec_deg z m200c_msun_h", &none, "say h = H0/100 of the simulation with --h"),
            ("ra_deg dec_deg z m200c_msun", &with_h, "without h, but h = 0.7 is said"),
            ("ra_deg dec_deg z m200c_msun", &rad, "column ra_deg: is in deg, but angle_unit says rad"),
            (
                "ra_deg dec_deg z mass:Msun",
                &none,
                "none is known as the mass; the columns present are ra_deg",
            ),
            (
                "ra_deg dec_deg z mvir_msun m200c_msun",
                &none,
                "several may be the mass: mvir_msun, m200c_msun; say which with --mass",
            ),
            ("ra_deg dec_deg z redshift m200c_msun", &none, "several may be the redshift"),
            ("ra_deg dec_deg z m200c_msun", &mvir, "there is no column M200c for the mass"),
            ("ra_deg dec_deg z m200c_msun conc", &none, "column conc: does not say of which definition"),
            ("ra_deg dec_deg z:km/s m200c_msun", &none, "must be without a unit"),
            ("ra_deg dec_deg z m200c_msun:kg", &none, "has the unit 'kg'"),
        ] {
            let text = found(columns, cone).unwrap_err();
            assert!(text.contains(wanted), "{columns}: {text}");
        }
    }

    #[test]
    fn names_that_only_look_like_masses_are_none() {
        for name in ["mass", "mag", "m", "mean", "m200c_error", "mfof", "mstar_msun", "merger"] {
            assert_eq!(definition_in(name, 'm'), None, "{name}");
        }
        assert_eq!(definition_in("c_500c", 'c'), Some(MassDefinition::Critical(500.0)));
    }
}
