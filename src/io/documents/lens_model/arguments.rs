//! The keyword arguments of one model of a list, read under lenstronomy's names.

use std::collections::BTreeMap;

use crate::error::{Error, Result};
use crate::profile::mass::{Epl, External, MassModel, Nfw, PointMass, SersicMass, TruncatedNfw};

/// Names of the mass profiles.
pub(super) const PROFILES: [&str; 13] = [
    "EPL",
    "SIE",
    "SIS",
    "NFW",
    "NFW_ELLIPSE_POTENTIAL",
    "TNFW",
    "SERSIC",
    "SERSIC_ELLIPSE_POTENTIAL",
    "POINT_MASS",
    "SHEAR",
    "SHEAR_GAMMA_PSI",
    "CONVERGENCE",
    "FLEXION",
];

/// The keyword arguments of one model.
pub(super) struct Arguments<'a> {
    pub name: &'a str,
    /// Place in the list, from 0.
    pub position: usize,
    pub values: &'a BTreeMap<String, f64>,
}

impl Arguments<'_> {
    /// Refuses arguments in neither list, and the lack of a required one.
    pub fn expect(&self, required: &[&str], optional: &[&str]) -> Result<()> {
        let known = [required, optional].concat();
        let unknown: Vec<&str> =
            self.values.keys().map(String::as_str).filter(|key| !known.contains(key)).collect();
        if !unknown.is_empty() {
            let what = format!("argument of {self}");
            return Err(Error::out_of_range(
                &what,
                unknown.join(", "),
                &format!("one of {}", known.join(", ")),
            ));
        }
        let missing: Vec<&str> =
            required.iter().copied().filter(|key| !self.values.contains_key(*key)).collect();
        if missing.is_empty() {
            return Ok(());
        }
        Err(Error::out_of_range(&format!("argument {} of {self}", missing.join(", ")), "missing", "a number"))
    }

    /// The value of an argument, 0 where it is left out (optional ones only, after [`Self::expect`]).
    pub fn value(&self, key: &str) -> f64 {
        self.values.get(key).copied().unwrap_or(0.0)
    }

    /// The required arguments of a profile and its centre, the two `optional` arguments.
    fn about<const N: usize>(
        &self,
        required: [&str; N],
        optional: [&str; 2],
    ) -> Result<([f64; N], [f64; 2])> {
        self.expect(&required, &optional)?;
        Ok((required.map(|key| self.value(key)), optional.map(|key| self.value(key))))
    }

    /// The mass profile of these arguments.
    pub fn profile(&self) -> Result<MassModel> {
        self.checked_profile().map_err(|error| match error {
            Error::OutOfRange { what, value, allowed } if !what.contains(self.name) => {
                Error::out_of_range(&format!("{what} of {self}"), value, &allowed)
            }
            other => other,
        })
    }

    fn checked_profile(&self) -> Result<MassModel> {
        const CENTRE: [&str; 2] = ["center_x", "center_y"];
        const ORIGIN: [&str; 2] = ["ra_0", "dec_0"];
        Ok(match self.name {
            "EPL" => {
                let ([theta_e, slope, e1, e2], centre) =
                    self.about(["theta_E", "gamma", "e1", "e2"], CENTRE)?;
                MassModel::Epl(Epl::new(theta_e, slope, [e1, e2], centre)?)
            }
            "SIE" => {
                let ([theta_e, e1, e2], centre) = self.about(["theta_E", "e1", "e2"], CENTRE)?;
                MassModel::Epl(Epl::new(theta_e, 2.0, [e1, e2], centre)?)
            }
            "SIS" => {
                let ([theta_e], centre) = self.about(["theta_E"], CENTRE)?;
                MassModel::Epl(Epl::new(theta_e, 2.0, [0.0, 0.0], centre)?)
            }
            "NFW" => {
                let ([r_s, alpha], centre) = self.about(["Rs", "alpha_Rs"], CENTRE)?;
                MassModel::Nfw(Nfw::new(r_s, alpha, centre)?)
            }
            "NFW_ELLIPSE_POTENTIAL" => {
                let ([r_s, alpha, e1, e2], centre) = self.about(["Rs", "alpha_Rs", "e1", "e2"], CENTRE)?;
                MassModel::Nfw(Nfw::new(r_s, alpha, centre)?.with_elliptical_potential([e1, e2])?)
            }
            "TNFW" => {
                let ([r_s, alpha, r_trunc], centre) = self.about(["Rs", "alpha_Rs", "r_trunc"], CENTRE)?;
                MassModel::TruncatedNfw(TruncatedNfw::new(r_s, alpha, r_trunc, centre)?)
            }
            "SERSIC" => {
                let ([k_eff, radius, index], centre) =
                    self.about(["k_eff", "R_sersic", "n_sersic"], CENTRE)?;
                MassModel::Sersic(SersicMass::new(k_eff, radius, index, centre)?)
            }
            "SERSIC_ELLIPSE_POTENTIAL" => {
                let names = ["k_eff", "R_sersic", "n_sersic", "e1", "e2"];
                let ([k_eff, radius, index, e1, e2], centre) = self.about(names, CENTRE)?;
                let round = SersicMass::new(k_eff, radius, index, centre)?;
                MassModel::Sersic(round.with_elliptical_potential([e1, e2])?)
            }
            "POINT_MASS" => {
                let ([theta_e], centre) = self.about(["theta_E"], CENTRE)?;
                MassModel::PointMass(PointMass::new(theta_e, centre)?)
            }
            "SHEAR" => {
                let (shear, origin) = self.about(["gamma1", "gamma2"], ORIGIN)?;
                MassModel::External(External::new(0.0, shear, [0.0; 4], origin)?)
            }
            "SHEAR_GAMMA_PSI" => {
                let ([gamma, psi_rad], origin) = self.about(["gamma_ext", "psi_ext"], ORIGIN)?;
                let (sin, cos) = (2.0 * psi_rad).sin_cos();
                MassModel::External(External::new(0.0, [gamma * cos, gamma * sin], [0.0; 4], origin)?)
            }
            "CONVERGENCE" => {
                let ([kappa], origin) = self.about(["kappa"], ORIGIN)?;
                MassModel::External(External::new(kappa, [0.0; 2], [0.0; 4], origin)?)
            }
            "FLEXION" => {
                let (third, origin) = self.about(["g1", "g2", "g3", "g4"], ORIGIN)?;
                MassModel::External(External::new(0.0, [0.0; 2], third, origin)?)
            }
            other => return Err(Error::out_of_range("lens_model_list", other, &PROFILES.join(", "))),
        })
    }
}

impl std::fmt::Display for Arguments<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} (number {} of the list)", self.name, self.position + 1)
    }
}
