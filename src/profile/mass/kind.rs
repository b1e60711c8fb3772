//! The mass profiles as functions of their parameters, under lenstronomy's names.

use super::{Epl, External, MassModel, Nfw, PointMass, SersicMass, TruncatedNfw};
use crate::error::{Error, Result};

/// Which mass profile, without its parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MassKind {
    /// `EPL`, `SIE`.
    Epl,
    /// `NFW_ELLIPSE_POTENTIAL`, `NFW`.
    Nfw,
    /// `TNFW`.
    TruncatedNfw,
    /// `SERSIC_ELLIPSE_POTENTIAL`, `SERSIC`.
    Sersic,
    /// `POINT_MASS`.
    PointMass,
    /// `SHEAR`, `CONVERGENCE`, `FLEXION`.
    External,
}

/// Names a model may use, and what they stand for.
const NAMES: [(&str, MassKind); 11] = [
    ("EPL", MassKind::Epl),
    ("SIE", MassKind::Epl),
    ("NFW", MassKind::Nfw),
    ("NFW_ELLIPSE_POTENTIAL", MassKind::Nfw),
    ("TNFW", MassKind::TruncatedNfw),
    ("SERSIC", MassKind::Sersic),
    ("SERSIC_ELLIPSE_POTENTIAL", MassKind::Sersic),
    ("POINT_MASS", MassKind::PointMass),
    ("SHEAR", MassKind::External),
    ("CONVERGENCE", MassKind::External),
    ("FLEXION", MassKind::External),
];

impl MassKind {
    /// The profile of a name.
    ///
    /// # Errors
    /// A name that is not known, with all that are.
    pub fn named(name: &str) -> Result<Self> {
        let known = NAMES.iter().find(|(own, _)| *own == name).map(|(_, kind)| *kind);
        let names = NAMES.map(|(name, _)| name).join(", ");
        known.ok_or_else(|| Error::out_of_range("profile of a lens", name, &format!("one of {names}")))
    }

    /// Names of the parameters, in the order of [`Self::build`] and of [`super::MassProfile::parameters`].
    pub fn parameters(self) -> &'static [&'static str] {
        match self {
            Self::Epl => &["theta_E", "gamma", "e1", "e2", "center_x", "center_y"],
            Self::Nfw => &["Rs", "alpha_Rs", "e1", "e2", "center_x", "center_y"],
            Self::TruncatedNfw => &["Rs", "alpha_Rs", "r_trunc", "e1", "e2", "center_x", "center_y"],
            Self::Sersic => &["k_eff", "R_sersic", "n_sersic", "e1", "e2", "center_x", "center_y"],
            Self::PointMass => &["theta_E", "e1", "e2", "center_x", "center_y"],
            Self::External => &["kappa", "gamma1", "gamma2", "g1", "g2", "g3", "g4", "ra_0", "dec_0"],
        }
    }

    /// The value of a parameter that a model leaves out, if it may: no ellipticity, centre on the axis, isothermal.
    pub fn default_of(self, name: &str, parameter: &str) -> Option<f64> {
        match parameter {
            "gamma" if name == "SIE" => Some(2.0),
            "e1" | "e2" | "center_x" | "center_y" => Some(0.0),
            _ if self == Self::External => Some(0.0),
            _ => None,
        }
    }

    /// The profile of the parameters `v`, as many as there are names.
    ///
    /// # Errors
    /// When a parameter lies outside its domain.
    pub fn build(self, v: &[f64]) -> Result<MassModel> {
        let pair = |i: usize| [v[i], v[i + 1]];
        Ok(match self {
            Self::Epl => MassModel::Epl(Epl::new(v[0], v[1], pair(2), pair(4))?),
            Self::Nfw => MassModel::Nfw(Nfw::new(v[0], v[1], pair(4))?.with_elliptical_potential(pair(2))?),
            Self::TruncatedNfw => {
                let round = TruncatedNfw::new(v[0], v[1], v[2], pair(5))?;
                MassModel::TruncatedNfw(round.with_elliptical_potential(pair(3))?)
            }
            Self::Sersic => {
                let round = SersicMass::new(v[0], v[1], v[2], pair(5))?;
                MassModel::Sersic(round.with_elliptical_potential(pair(3))?)
            }
            Self::PointMass => {
                MassModel::PointMass(PointMass::new(v[0], pair(3))?.with_elliptical_potential(pair(1))?)
            }
            Self::External => {
                let third = [v[3], v[4], v[5], v[6]];
                MassModel::External(External::new(v[0], pair(1), third, pair(7))?)
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::MassProfile;
    use super::*;

    #[test]
    fn names_and_order_are_those_of_the_profiles() {
        for (name, kind) in NAMES {
            let numbers = vec![0.4; kind.parameters().len()];
            let numbers = if kind == MassKind::Epl { vec![1.0, 2.0, 0.1, 0.1, 0.0, 0.0] } else { numbers };
            let built = kind.build(&numbers).unwrap();
            assert_eq!(built.parameters(), kind.parameters(), "{name}");
        }
        assert!(MassKind::named("EPLX").is_err());
    }
}
