//! Lens models in the field's own JSON form: `lens_model_list` and `kwargs_lens` as lenstronomy takes them.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::Complex;
use serde::Deserialize;

use crate::cosmology::Background;
use crate::error::{Error, Result};
use crate::mapping::tidal::{Flexion, FlexionModel, LineOfSightModel, Tidal, TidalLens};
use crate::profile::mass::{Epl, External, MassModel, Nfw, PointMass, SersicMass, TruncatedNfw};

/// A model file: `{"z_lens", "z_source", "lens_model_list": […], "kwargs_lens": [{…}, …], "cosmology": {"H0", "Om0"}}`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct ModelFile {
    z_lens: f64,
    z_source: f64,
    lens_model_list: Vec<String>,
    kwargs_lens: Vec<BTreeMap<String, f64>>,
    #[serde(default)]
    cosmology: Option<CosmologyFile>,
}

/// Flat ΛCDM by lenstronomy's or haloray's names.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct CosmologyFile {
    #[serde(alias = "H0")]
    h0_km_s_mpc: f64,
    #[serde(alias = "Om0")]
    omega_m: f64,
}

/// Names this version can represent.
const KNOWN: &str = "EPL, SIE, SIS, NFW, NFW_ELLIPSE_POTENTIAL, TNFW, SERSIC, SERSIC_ELLIPSE_POTENTIAL, POINT_MASS, \
                     SHEAR, SHEAR_GAMMA_PSI, CONVERGENCE, FLEXION, LOS, LOS_MINIMAL, LOS_FLEXION, LOS_FLEXION_MINIMAL";

/// A lens model read from a file, and what is to be said about it.
#[derive(Debug, Clone)]
pub struct LensModelFile {
    /// The model.
    pub lens: TidalLens,
    /// Where results differ from lenstronomy's on purpose.
    pub warnings: Vec<String>,
}

/// Reads a lens model; distances of `default_background` unless the file has a cosmology.
///
/// # Errors
/// Text that is not such a model, names that cannot be represented (all of them listed), parameters missing, unknown
/// or outside their domain.
pub fn read_lens_model(path: &Path, default_background: &Background) -> Result<LensModelFile> {
    let text = std::fs::read_to_string(path).map_err(|source| Error::Read { path: path.into(), source })?;
    let file: ModelFile =
        serde_json::from_str(&text).map_err(|e| Error::format(path, format!("not a lens model: {e}")))?;
    build(&file, default_background).map_err(|error| match error {
        Error::OutOfRange { .. } => Error::format(path, error.to_string()),
        other => other,
    })
}

fn build(file: &ModelFile, default_background: &Background) -> Result<LensModelFile> {
    let background = match &file.cosmology {
        None => *default_background,
        Some(own) => Background::new(own.h0_km_s_mpc, own.omega_m)?,
    };
    let (names, kwargs) = (&file.lens_model_list, &file.kwargs_lens);
    if names.len() != kwargs.len() || names.is_empty() {
        let allowed = format!("{} as the lens_model_list, and at least one", names.len());
        return Err(Error::out_of_range("length of kwargs_lens", kwargs.len(), &allowed));
    }
    if !(file.z_lens > 0.0 && file.z_source > file.z_lens) {
        let allowed = format!("above 0 and below z_source = {}", file.z_source);
        return Err(Error::out_of_range("z_lens", file.z_lens, &allowed));
    }
    let unknown: Vec<&str> =
        names.iter().map(String::as_str).filter(|name| !KNOWN.split(", ").any(|k| k == *name)).collect();
    if !unknown.is_empty() {
        return Err(Error::out_of_range("lens_model_list", unknown.join(", "), &format!("among {KNOWN}")));
    }
    let (mut model, mut lenses, mut warnings) = (None, Vec::new(), Vec::new());
    for (position, (name, values)) in names.iter().zip(kwargs).enumerate() {
        let arguments = Arguments { name, position, values };
        if !name.starts_with("LOS") {
            lenses.push(arguments.profile()?);
        } else if model.is_none() {
            model = Some(arguments.line_of_sight(&mut warnings)?);
        } else {
            return Err(Error::out_of_range("lens_model_list", name, "with one LOS model at most"));
        }
    }
    let (lens, source) =
        (background.comoving_distance_mpc(file.z_lens), background.comoving_distance_mpc(file.z_source));
    let model = model.unwrap_or(LineOfSightModel::EMPTY);
    let lens = TidalLens { model, lenses, time_delay_distance_mpc: lens * source / (source - lens) };
    Ok(LensModelFile { lens, warnings })
}

/// The keyword arguments of one model of the list.
struct Arguments<'a> {
    name: &'a str,
    position: usize,
    values: &'a BTreeMap<String, f64>,
}

impl Arguments<'_> {
    /// Refuses arguments not in `required` or `optional`.
    fn only(&self, required: &[&str], optional: &[&str]) -> Result<()> {
        for key in self.values.keys() {
            if !required.iter().chain(optional).any(|k| k == key) {
                let what = format!("argument of {} (number {} of the list)", self.name, self.position + 1);
                let allowed = format!("one of {}", [required, optional].concat().join(", "));
                return Err(Error::out_of_range(&what, key, &allowed));
            }
        }
        required.iter().try_for_each(|key| self.number(key).map(drop))
    }

    fn number(&self, key: &str) -> Result<f64> {
        self.values.get(key).copied().ok_or_else(|| {
            let what = format!("argument {key} of {} (number {} of the list)", self.name, self.position + 1);
            Error::out_of_range(&what, "missing", "a number")
        })
    }

    fn or_zero(&self, key: &str) -> f64 {
        self.values.get(key).copied().unwrap_or(0.0)
    }

    fn profile(&self) -> Result<MassModel> {
        let centre = [self.or_zero("center_x"), self.or_zero("center_y")];
        let origin = [self.or_zero("ra_0"), self.or_zero("dec_0")];
        let about = |required: &[&str]| self.only(required, &["center_x", "center_y"]);
        let external = |required: &[&str]| self.only(required, &["ra_0", "dec_0"]);
        let n = |key: &str| self.number(key);
        Ok(match self.name {
            "EPL" => {
                about(&["theta_E", "gamma", "e1", "e2"])?;
                MassModel::Epl(Epl::new(n("theta_E")?, n("gamma")?, [n("e1")?, n("e2")?], centre)?)
            }
            "SIE" => {
                about(&["theta_E", "e1", "e2"])?;
                MassModel::Epl(Epl::new(n("theta_E")?, 2.0, [n("e1")?, n("e2")?], centre)?)
            }
            "SIS" => {
                about(&["theta_E"])?;
                MassModel::Epl(Epl::new(n("theta_E")?, 2.0, [0.0, 0.0], centre)?)
            }
            "NFW" => {
                about(&["Rs", "alpha_Rs"])?;
                MassModel::Nfw(Nfw::new(n("Rs")?, n("alpha_Rs")?, centre)?)
            }
            "NFW_ELLIPSE_POTENTIAL" => {
                about(&["Rs", "alpha_Rs", "e1", "e2"])?;
                let round = Nfw::new(n("Rs")?, n("alpha_Rs")?, centre)?;
                MassModel::Nfw(round.with_elliptical_potential([n("e1")?, n("e2")?])?)
            }
            "TNFW" => {
                about(&["Rs", "alpha_Rs", "r_trunc"])?;
                MassModel::TruncatedNfw(TruncatedNfw::new(n("Rs")?, n("alpha_Rs")?, n("r_trunc")?, centre)?)
            }
            "SERSIC" => {
                about(&["k_eff", "R_sersic", "n_sersic"])?;
                MassModel::Sersic(SersicMass::new(n("k_eff")?, n("R_sersic")?, n("n_sersic")?, centre)?)
            }
            "SERSIC_ELLIPSE_POTENTIAL" => {
                about(&["k_eff", "R_sersic", "n_sersic", "e1", "e2"])?;
                let round = SersicMass::new(n("k_eff")?, n("R_sersic")?, n("n_sersic")?, centre)?;
                MassModel::Sersic(round.with_elliptical_potential([n("e1")?, n("e2")?])?)
            }
            "POINT_MASS" => {
                about(&["theta_E"])?;
                MassModel::PointMass(PointMass::new(n("theta_E")?, centre)?)
            }
            "SHEAR" => {
                external(&["gamma1", "gamma2"])?;
                MassModel::External(External::new(0.0, [n("gamma1")?, n("gamma2")?], [0.0; 4], origin)?)
            }
            "SHEAR_GAMMA_PSI" => {
                external(&["gamma_ext", "psi_ext"])?;
                let (sin, cos) = (2.0 * n("psi_ext")?).sin_cos();
                let gamma = n("gamma_ext")?;
                MassModel::External(External::new(0.0, [gamma * cos, gamma * sin], [0.0; 4], origin)?)
            }
            "CONVERGENCE" => {
                external(&["kappa"])?;
                MassModel::External(External::new(n("kappa")?, [0.0; 2], [0.0; 4], origin)?)
            }
            "FLEXION" => {
                external(&["g1", "g2", "g3", "g4"])?;
                let third = [n("g1")?, n("g2")?, n("g3")?, n("g4")?];
                MassModel::External(External::new(0.0, [0.0; 2], third, origin)?)
            }
            other => return Err(Error::out_of_range("lens_model_list", other, &format!("among {KNOWN}"))),
        })
    }

    fn tidal(&self, part: &str) -> Result<Tidal> {
        Ok(Tidal {
            kappa: self.number(&format!("kappa_{part}"))?,
            gamma: Complex::new(
                self.number(&format!("gamma1_{part}"))?,
                self.number(&format!("gamma2_{part}"))?,
            ),
            omega: self.or_zero(&format!("omega_{part}")),
        })
    }

    fn flexion(&self, part: &str) -> Result<Flexion> {
        let complex = |letter: &str| -> Result<Complex<f64>> {
            let component = |i: u8| self.number(&format!("{letter}{i}_{part}"));
            Ok(Complex::new(component(1)?, component(2)?))
        };
        Ok(Flexion { f: complex("F")?, g: complex("G")? })
    }

    /// Refuses arguments that belong to no part of the model.
    fn only_parts(&self, tidal: &[&str], rotations: &[&str], flexions: &[&str]) -> Result<()> {
        let mut names: Vec<String> = Vec::new();
        tidal.iter().for_each(|p| names.extend(["kappa", "gamma1", "gamma2"].map(|q| format!("{q}_{p}"))));
        flexions.iter().for_each(|p| names.extend(["F1", "F2", "G1", "G2"].map(|q| format!("{q}_{p}"))));
        let rotations: Vec<String> = rotations.iter().map(|p| format!("omega_{p}")).collect();
        let required: Vec<&str> = names.iter().map(String::as_str).collect();
        let optional: Vec<&str> = rotations.iter().map(String::as_str).collect();
        self.only(&required, &optional)
    }

    fn line_of_sight(&self, warnings: &mut Vec<String>) -> Result<LineOfSightModel> {
        Ok(match self.name {
            "LOS" => {
                self.only_parts(&["od", "os", "ds"], &["od", "os", "ds"], &[])?;
                LineOfSightModel::Full { od: self.tidal("od")?, os: self.tidal("os")?, ds: self.tidal("ds")? }
            }
            "LOS_MINIMAL" => {
                self.only_parts(&["od", "los"], &["od", "los"], &[])?;
                let od = self.tidal("od")?;
                if od.omega != 0.0 {
                    warnings.push(
                        "LOS_MINIMAL with omega_od ≠ 0: haloray deflects with the transpose of A_od, as the potential \
                         demands; lenstronomy leaves the transpose out and differs"
                            .into(),
                    );
                }
                LineOfSightModel::Minimal { od, los: self.tidal("los")? }
            }
            "LOS_FLEXION" => {
                self.only_parts(&["od", "os", "ds"], &["os"], &["od", "os", "1ds", "2ds"])?;
                LineOfSightModel::Flexion(FlexionModel {
                    od: self.tidal("od")?,
                    os: self.tidal("os")?,
                    ds: self.tidal("ds")?,
                    flexion_od: self.flexion("od")?,
                    flexion_os: self.flexion("os")?,
                    flexion_1ds: self.flexion("1ds")?,
                    flexion_2ds: self.flexion("2ds")?,
                })
            }
            "LOS_FLEXION_MINIMAL" => {
                self.only_parts(&["od", "los"], &["los"], &["od", "los", "1los"])?;
                let (od, los) = (self.tidal("od")?, self.tidal("los")?);
                let (f_od, f_los, f_one) = (self.flexion("od")?, self.flexion("los")?, self.flexion("1los")?);
                LineOfSightModel::Flexion(FlexionModel::minimal(od, los, f_od, f_los, f_one))
            }
            other => return Err(Error::out_of_range("lens_model_list", other, &format!("among {KNOWN}"))),
        })
    }
}
