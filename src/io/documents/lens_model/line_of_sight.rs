//! The line-of-sight models under lenstronomy's names: `LOS`, `LOS_MINIMAL`, `LOS_FLEXION`, `LOS_FLEXION_MINIMAL`.

use nalgebra::Complex;

use super::arguments::Arguments;
use crate::error::{Error, Result};
use crate::mapping::tidal::{Flexion, FlexionModel, LineOfSightModel, Tidal};

/// Names of the line-of-sight models.
pub(super) const LINES_OF_SIGHT: [&str; 4] = ["LOS", "LOS_MINIMAL", "LOS_FLEXION", "LOS_FLEXION_MINIMAL"];

/// Said of `LOS_MINIMAL` with a rotation of the foreground.
const MINIMAL_WARNING: &str = "LOS_MINIMAL with omega_od ≠ 0: haloray deflects with the transpose of A_od, as the \
                               potential demands; lenstronomy leaves the transpose out and differs";

impl Arguments<'_> {
    /// The line-of-sight model of these arguments; convergences, shears and flexions are required, rotations are not.
    pub fn line_of_sight(&self, warnings: &mut Vec<String>) -> Result<LineOfSightModel> {
        Ok(match self.name {
            "LOS" => {
                self.expect_parts(&["od", "os", "ds"], &["od", "os", "ds"], &[])?;
                LineOfSightModel::Full { od: self.tidal("od"), os: self.tidal("os"), ds: self.tidal("ds") }
            }
            "LOS_MINIMAL" => {
                self.expect_parts(&["od", "los"], &["od", "los"], &[])?;
                let od = self.tidal("od");
                if od.omega != 0.0 {
                    warnings.push(MINIMAL_WARNING.into());
                }
                LineOfSightModel::Minimal { od, los: self.tidal("los") }
            }
            "LOS_FLEXION" => {
                self.expect_parts(&["od", "os", "ds"], &["os"], &["od", "os", "1ds", "2ds"])?;
                LineOfSightModel::Flexion(FlexionModel {
                    od: self.tidal("od"),
                    os: self.tidal("os"),
                    ds: self.tidal("ds"),
                    flexion_od: self.flexion("od"),
                    flexion_os: self.flexion("os"),
                    flexion_1ds: self.flexion("1ds"),
                    flexion_2ds: self.flexion("2ds"),
                })
            }
            "LOS_FLEXION_MINIMAL" => {
                self.expect_parts(&["od", "los"], &["los"], &["od", "los", "1los"])?;
                let (od, los) = (self.tidal("od"), self.tidal("los"));
                let [f_od, f_los, f_one] = ["od", "los", "1los"].map(|part| self.flexion(part));
                LineOfSightModel::Flexion(FlexionModel::minimal(od, los, f_od, f_los, f_one))
            }
            other => return Err(Error::out_of_range("lens_model_list", other, &LINES_OF_SIGHT.join(", "))),
        })
    }

    /// Checks the arguments against κ, γ of the `tidal` parts, F, G of the `flexions` and optional `rotations`.
    fn expect_parts(&self, tidal: &[&str], rotations: &[&str], flexions: &[&str]) -> Result<()> {
        let named = |letters: &[&str], parts: &[&str]| -> Vec<String> {
            parts.iter().flat_map(|part| letters.iter().map(move |q| format!("{q}_{part}"))).collect()
        };
        let required =
            [named(&["kappa", "gamma1", "gamma2"], tidal), named(&["F1", "F2", "G1", "G2"], flexions)]
                .concat();
        let optional = named(&["omega"], rotations);
        let [required, optional] =
            [&required, &optional].map(|names| names.iter().map(String::as_str).collect::<Vec<_>>());
        self.expect(&required, &optional)
    }

    fn tidal(&self, part: &str) -> Tidal {
        let of = |letter: &str| self.value(&format!("{letter}_{part}"));
        Tidal { kappa: of("kappa"), gamma: Complex::new(of("gamma1"), of("gamma2")), omega: of("omega") }
    }

    fn flexion(&self, part: &str) -> Flexion {
        let of = |letter: &str| self.value(&format!("{letter}_{part}"));
        Flexion { f: Complex::new(of("F1"), of("F2")), g: Complex::new(of("G1"), of("G2")) }
    }
}
