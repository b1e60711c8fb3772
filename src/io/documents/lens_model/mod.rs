//! Lens models in the field's own JSON form: `lens_model_list` and `kwargs_lens` as lenstronomy takes them.

mod arguments;
mod line_of_sight;

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;

use self::arguments::Arguments;
use self::line_of_sight::LINES_OF_SIGHT;
use super::numbers_by_name::NumbersByName;
use crate::cosmology::Background;
use crate::error::{Domain, Error, FileFault, Result};
use crate::io::containers::read_text;
use crate::mapping::Mapping;
use crate::mapping::multiplane::GeneralMultiPlane;
use crate::mapping::tidal::{LineOfSightModel, TidalLens};
use crate::profile::mass::MassModel;
use crate::profile::registry::{mass, mass_names};

/// A model file: one lens plane at `z_lens`, or a redshift for every model in `lens_redshift_list`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct ModelFile {
    z_lens: Option<f64>,
    z_source: f64,
    lens_model_list: Vec<String>,
    kwargs_lens: Vec<NumbersByName>,
    lens_redshift_list: Option<Vec<f64>>,
    cosmology: Option<CosmologyFile>,
}

/// Flat ΛCDM by haloray's or astropy's names.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct CosmologyFile {
    #[serde(alias = "H0")]
    h0_km_s_mpc: f64,
    #[serde(alias = "Om0")]
    omega_m: f64,
    /// Temperature of the radiation today in K; haloray has none.
    #[serde(default, rename = "Tcmb0")]
    tcmb0_k: f64,
}

/// A lens model read from a file, and what is to be said about it.
#[derive(Debug, Clone)]
pub struct LensModelFile {
    /// The model.
    pub lens: LensOfFile,
    /// Where results differ from lenstronomy's on purpose, and what does nothing.
    pub warnings: Vec<String>,
}

/// The two kinds of lens that a file can hold.
#[derive(Debug, Clone)]
pub enum LensOfFile {
    /// One lens plane, with or without a model of the line of sight.
    OnePlane(Box<TidalLens>),
    /// A plane for every redshift.
    ManyPlanes(GeneralMultiPlane),
}

impl LensOfFile {
    /// The lens as a mapping.
    pub fn mapping(&self) -> &dyn Mapping {
        match self {
            Self::OnePlane(lens) => lens.as_ref(),
            Self::ManyPlanes(lens) => lens,
        }
    }

    /// Directions in which rays meet the centre of a lens, as far as they are known.
    pub fn lens_centres_arcsec(&self) -> Vec<[f64; 2]> {
        match self {
            Self::OnePlane(lens) => lens.lens_centres_arcsec(),
            Self::ManyPlanes(lens) => lens.lens_centres_arcsec(),
        }
    }

    /// Fermat potential of every ray at its own β in arcsec²; `None` for many planes, which have no single one.
    pub fn fermat_arcsec2(&self, theta_arcsec: &[[f64; 2]]) -> Option<Vec<f64>> {
        match self {
            Self::OnePlane(lens) => {
                Some(theta_arcsec.iter().map(|&theta| lens.ray_fermat_arcsec2(theta)).collect())
            }
            Self::ManyPlanes(_) => None,
        }
    }
}

/// Reads a lens model; distances of `default_background` unless the file has a cosmology.
///
/// # Errors
/// Text that is not such a model, names that cannot be represented (all of them listed), parameters missing, unknown
/// or outside their domain; every message names the file.
pub fn read_lens_model(path: &Path, default_background: &Background) -> Result<LensModelFile> {
    let text = read_text(path)?;
    let file: ModelFile = serde_json::from_str(text.trim_start_matches('\u{feff}')).map_err(|error| {
        Error::file(FileFault::LensModel, path, format!("not a lens model: {error}{}", cause(&text)))
    })?;
    file.build(default_background).map_err(|error| error.in_file(FileFault::LensModel, path))
}

/// What a text that is no lens model may be, in words to end a sentence with.
fn cause(text: &str) -> &'static str {
    let mut words = text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_');
    match text {
        _ if text.contains("\"lensing_entities\"") => "; it is a COOLEST file, which is not read",
        _ if words.any(|word| ["NaN", "Infinity", "None", "True", "False"].contains(&word)) => {
            "; NaN, Infinity, None, True and False are no JSON"
        }
        _ => "",
    }
}

impl ModelFile {
    fn build(&self, default_background: &Background) -> Result<LensModelFile> {
        let background = match &self.cosmology {
            None => *default_background,
            Some(own) => {
                let own = own.background()?;
                let is_said = *default_background != Background::paper() && *default_background != own;
                if is_said {
                    let allowed = "left out, or that of the options: the file has one of its own";
                    return Err(Error::out_of_range("cosmology", "another than the options'", allowed));
                }
                own
            }
        };
        let redshifts = match (&self.lens_redshift_list, self.z_lens) {
            (Some(_), Some(z_lens)) => {
                return Err(Error::out_of_range("z_lens", z_lens, "left out beside lens_redshift_list"));
            }
            (Some(list), None) => LensRedshifts::ManyPlanes { lenses: list.clone(), source: self.z_source },
            (None, Some(lens)) => LensRedshifts::OnePlane { lens, source: self.z_source },
            (None, None) => {
                let allowed = "a redshift (or lens_redshift_list given)";
                return Err(Error::out_of_range("z_lens", "missing", allowed));
            }
        };
        if self.lens_model_list.is_empty() {
            return Err(Error::out_of_range("lens_model_list", "empty", "a list of at least one model"));
        }
        let kwargs: Vec<BTreeMap<String, f64>> = self.kwargs_lens.iter().map(|own| own.0.clone()).collect();
        let parts = LensModelParts { lens_model_list: &self.lens_model_list, kwargs_lens: &kwargs };
        parts.build(&redshifts, &background)
    }
}

/// Where the planes of a lens model and its source are.
#[derive(Debug, Clone, PartialEq)]
pub enum LensRedshifts {
    /// One lens plane of unknown redshift: no delays.
    Unknown,
    /// One lens plane.
    OnePlane {
        /// Redshift of the lens.
        lens: f64,
        /// Redshift of the source.
        source: f64,
    },
    /// A redshift for every model of the list.
    ManyPlanes {
        /// Redshifts of the models.
        lenses: Vec<f64>,
        /// Redshift of the source.
        source: f64,
    },
}

/// A lens model under lenstronomy's names: a list of profiles, and the arguments of each.
#[derive(Debug, Clone, Copy)]
pub struct LensModelParts<'a> {
    /// Names of the profiles and of at most one model of the line of sight.
    pub lens_model_list: &'a [String],
    /// The keyword arguments of each.
    pub kwargs_lens: &'a [BTreeMap<String, f64>],
}

/// All names that a `lens_model_list` may hold.
pub fn lens_model_names() -> Vec<&'static str> {
    [mass_names().as_slice(), &LINES_OF_SIGHT].concat()
}

/// The unit of an argument of a model, `arcsec`, `1/arcsec`, `rad` or empty; none for a name that the model does not have.
pub fn lens_argument_unit(model: &str, argument: &str) -> Option<&'static str> {
    if LINES_OF_SIGHT.contains(&model) {
        return Some(if argument.starts_with(['F', 'G']) { "1/arcsec" } else { "" });
    }
    mass(model).ok()?.arguments().find(|own| own.name == argument).map(|own| own.unit)
}

impl LensModelParts<'_> {
    /// The lens, with distances of `background`.
    ///
    /// # Errors
    /// Names that cannot be represented (all of them listed), parameters missing, unknown or outside their domain,
    /// redshifts that do not belong together.
    pub fn build(&self, redshifts: &LensRedshifts, background: &Background) -> Result<LensModelFile> {
        self.check_list()?;
        match redshifts {
            LensRedshifts::Unknown => self.one_plane(None),
            LensRedshifts::OnePlane { lens, source } => {
                let allowed = format!("above 0 and below z_source = {source}");
                Domain::inside(0.0, *source).check_in_words("z_lens", *lens, &allowed)?;
                let [lens, source] = [*lens, *source].map(|z| background.comoving_distance_mpc(z));
                self.one_plane(Some(lens * source / (source - lens)))
            }
            LensRedshifts::ManyPlanes { lenses, source } => self.many_planes(lenses, *source, background),
        }
    }

    /// Names that are known, and arguments for each.
    fn check_list(&self) -> Result<()> {
        let (names, kwargs) = (self.lens_model_list, self.kwargs_lens);
        if names.len() != kwargs.len() {
            let allowed = format!("{} as the lens_model_list", names.len());
            return Err(Error::out_of_range("length of kwargs_lens", kwargs.len(), &allowed));
        }
        let known = lens_model_names();
        let unknown: Vec<&str> =
            names.iter().map(String::as_str).filter(|name| !known.contains(name)).collect();
        if unknown.is_empty() {
            return Ok(());
        }
        let allowed = format!("among {}", known.join(", "));
        Err(Error::out_of_range("lens_model_list", unknown.join(", "), &allowed))
    }

    fn arguments(&self) -> impl Iterator<Item = Arguments<'_>> {
        let pairs = self.lens_model_list.iter().zip(self.kwargs_lens).enumerate();
        pairs.map(|(position, (name, values))| Arguments { name, position, values })
    }

    fn one_plane(&self, time_delay_distance_mpc: Option<f64>) -> Result<LensModelFile> {
        let (mut model, mut lenses, mut warnings) = (None, Vec::new(), Vec::new());
        for arguments in self.arguments() {
            if !LINES_OF_SIGHT.contains(&arguments.name) {
                lenses.push(arguments.profile()?);
            } else if model.is_none() {
                model = Some(arguments.line_of_sight(&mut warnings)?);
            } else {
                let allowed = "the only LOS model of the list";
                return Err(Error::out_of_range("lens_model_list", arguments, allowed));
            }
        }
        let model = model.unwrap_or(LineOfSightModel::EMPTY);
        let lens = TidalLens { model, lenses, time_delay_distance_mpc };
        Ok(LensModelFile { lens: LensOfFile::OnePlane(Box::new(lens)), warnings })
    }

    fn many_planes(
        &self,
        redshifts: &[f64],
        z_source: f64,
        background: &Background,
    ) -> Result<LensModelFile> {
        if redshifts.len() != self.lens_model_list.len() {
            let allowed = format!("{} as the lens_model_list", self.lens_model_list.len());
            return Err(Error::out_of_range("length of lens_redshift_list", redshifts.len(), &allowed));
        }
        let mut lenses: Vec<(f64, MassModel)> = Vec::new();
        for (arguments, &z) in self.arguments().zip(redshifts) {
            if LINES_OF_SIGHT.contains(&arguments.name) {
                let allowed =
                    "a mass profile: LOS models stand around one lens plane, without lens_redshift_list";
                return Err(Error::out_of_range("lens_model_list", arguments, allowed));
            }
            lenses.push((z, arguments.profile()?));
        }
        let lens = GeneralMultiPlane::new(background, z_source, &lenses)?;
        let behind = |(name, z): (&String, &f64)| {
            let is_behind = *z >= z_source;
            is_behind.then(|| {
                format!("{name} at z = {z} is not before the source at z = {z_source} and does nothing")
            })
        };
        let warnings = self.lens_model_list.iter().zip(redshifts).filter_map(behind).collect();
        Ok(LensModelFile { lens: LensOfFile::ManyPlanes(lens), warnings })
    }
}

impl CosmologyFile {
    fn background(&self) -> Result<Background> {
        let allowed = "0: haloray's background has no radiation";
        Domain::from_to(0.0, 0.0).check_in_words("Tcmb0", self.tcmb0_k, allowed)?;
        Background::new(self.h0_km_s_mpc, self.omega_m)
    }
}
