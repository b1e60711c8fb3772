//! The models of the line of sight as functions of their numbers: names, order, and which numbers stand for which.

use nalgebra::Complex;
use serde::{Deserialize, Serialize};

use super::flexion::{Flexion, FlexionModel};
use super::model::LineOfSightModel;
use super::tensor::Tidal;
use crate::profile::registry::{Guess, Parameter};

/// Which model of the line of sight, without its numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LineOfSightKind {
    /// Nothing on the line of sight.
    None,
    /// Full model: od, os, ds.
    Full,
    /// Minimal model: od, los.
    Minimal,
    /// Flexion model.
    Flexion,
    /// Flexion-minimal model.
    FlexionMinimal,
    /// The haloes of a table, and the minimal model's tidal field beside them.
    Haloes,
}

/// The numbers of tensors and flexions one after the other, each of a place and of how that is raised in a label.
macro_rules! numbers {
    (@ [$($all:expr,)*]) => { &[$($all,)*] };
    (@ [$($all:expr,)*] still($place:literal, $raised:literal) $($rest:tt)*) => {
        numbers!(@ [$($all,)*
            Parameter { name: concat!("kappa_", $place), label: concat!("κ_{", $raised, "}"), ..NUMBER },
            Parameter { name: concat!("gamma1_", $place), label: concat!("γ_{1}^{", $raised, "}"), ..NUMBER },
            Parameter { name: concat!("gamma2_", $place), label: concat!("γ_{2}^{", $raised, "}"), ..NUMBER },
        ] $($rest)*)
    };
    (@ [$($all:expr,)*] omega($place:literal, $raised:literal) $($rest:tt)*) => {
        numbers!(@ [$($all,)*
            Parameter { name: concat!("omega_", $place), label: concat!("ω_{", $raised, "}"), ..NUMBER },
        ] $($rest)*)
    };
    (@ [$($all:expr,)*] flexion($place:literal, $raised:literal) $($rest:tt)*) => {
        numbers!(@ [$($all,)*
            Parameter { name: concat!("F1_", $place), label: concat!("F_{1}^{", $raised, "}"), ..FLEXED },
            Parameter { name: concat!("F2_", $place), label: concat!("F_{2}^{", $raised, "}"), ..FLEXED },
            Parameter { name: concat!("G1_", $place), label: concat!("G_{1}^{", $raised, "}"), ..FLEXED },
            Parameter { name: concat!("G2_", $place), label: concat!("G_{2}^{", $raised, "}"), ..FLEXED },
        ] $($rest)*)
    };
    (@ [$($all:expr,)*] tensor($place:literal, $raised:literal) $($rest:tt)*) => {
        numbers!(@ [$($all,)*] still($place, $raised) omega($place, $raised) $($rest)*)
    };
    ($($rest:tt)*) => { numbers!(@ [] $($rest)*) };
}

/// Numbers of a line of sight that a search for the best fit takes for empty at first.
const NUMBER: Parameter = Parameter { guess: Guess::Fixed(0.0), ..Parameter::FIELD };
const FLEXED: Parameter = Parameter { guess: Guess::Fixed(0.0), ..Parameter::FLEXION };

const FULL: &[Parameter] = numbers![tensor("od", "od") tensor("os", "os") tensor("ds", "ds")];
const MINIMAL: &[Parameter] = numbers![tensor("od", "od") tensor("los", "LOS")];
const FLEXION: &[Parameter] = numbers![
    still("od", "od") tensor("os", "os") still("ds", "ds")
    flexion("od", "od") flexion("os", "os") flexion("1ds", "1ds") flexion("2ds", "2ds")
];
const FLEXION_MINIMAL: &[Parameter] = numbers![
    still("od", "od") tensor("los", "LOS") flexion("od", "od") flexion("los", "LOS") flexion("1los", "1los")
];

impl LineOfSightKind {
    /// The numbers under lenstronomy's names, with omega_od and omega_ds beside them, in the order of [`Self::build`].
    pub fn parameters(self) -> &'static [Parameter] {
        match self {
            Self::None => &[],
            Self::Full => FULL,
            Self::Minimal | Self::Haloes => MINIMAL,
            Self::Flexion => FLEXION,
            Self::FlexionMinimal => FLEXION_MINIMAL,
        }
    }

    /// The model of the numbers `v`, as many as there are names.
    pub fn build(self, v: &[f64]) -> LineOfSightModel {
        let rotating = |i: usize| tidal(v[i], v[i + 1], v[i + 2], v[i + 3]);
        let still = |i: usize| tidal(v[i], v[i + 1], v[i + 2], 0.0);
        let flexion =
            |i: usize| Flexion { f: Complex::new(v[i], v[i + 1]), g: Complex::new(v[i + 2], v[i + 3]) };
        match self {
            Self::None => LineOfSightModel::EMPTY,
            Self::Full => LineOfSightModel::Full { od: rotating(0), os: rotating(4), ds: rotating(8) },
            Self::Minimal | Self::Haloes => LineOfSightModel::Minimal { od: rotating(0), los: rotating(4) },
            Self::Flexion => LineOfSightModel::Flexion(FlexionModel {
                od: still(0),
                os: rotating(3),
                ds: still(7),
                flexion_od: flexion(10),
                flexion_os: flexion(14),
                flexion_1ds: flexion(18),
                flexion_2ds: flexion(22),
            }),
            Self::FlexionMinimal => LineOfSightModel::Flexion(FlexionModel::minimal(
                still(0),
                rotating(3),
                flexion(7),
                flexion(11),
                flexion(15),
            )),
        }
    }

    /// For each number of the full or flexion model, the number of this model that it stands for; see [`Self::turns`].
    pub(super) fn roles(self) -> &'static [usize] {
        /// od, os := los, ds := odᵀ.
        const MINIMAL: [usize; 12] = [0, 1, 2, 3, 4, 5, 6, 7, 0, 1, 2, 3];
        /// od, os := los, ds := od, flexions od, os := los, 1ds := 1los, 2ds := od.
        const FLEXION_MINIMAL: [usize; 26] =
            [0, 1, 2, 3, 4, 5, 6, 0, 1, 2, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 7, 8, 9, 10];
        const OWN: [usize; 26] =
            [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25];
        match self {
            Self::None => &[],
            Self::Full => OWN.split_at(12).0,
            Self::Minimal | Self::Haloes => &MINIMAL,
            Self::Flexion => &OWN,
            Self::FlexionMinimal => &FLEXION_MINIMAL,
        }
    }

    /// Whether that number of the full model stands for the negative of its role: ω_ds := −ω_od in the minimal model.
    #[inline(always)]
    pub(super) fn turns(self, number: usize) -> bool {
        matches!(self, Self::Minimal | Self::Haloes) && number == 11
    }
}

fn tidal(kappa: f64, gamma1: f64, gamma2: f64, omega: f64) -> Tidal {
    Tidal { kappa, gamma: Complex::new(gamma1, gamma2), omega }
}
