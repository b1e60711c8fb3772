//! Which sheets of negative convergence balance the haloes, and whether one halo decides them.

use haloray::Result;
use haloray::config::{Config, SheetModel};
use haloray::pipeline::Haloes;
use haloray::report::decimals_text;

use crate::bars::Bars;
use crate::terminal::{print, warn};

/// A halo of so much convergence makes a sheet that bends rays all over the image.
const LARGE: f64 = 0.5;
/// One that has this much and more than half of all decides the sheets alone.
const DECISIVE: f64 = 0.2;

/// Says which sheets were used; `kappa` is what each halo has where its sheet is taken.
pub fn tell(sheets: &str, kappa: &[f64], bars: &Bars) {
    let total: f64 = kappa.iter().sum();
    if !bars.is_quiet() {
        print(&format!("sheets: {sheets}, κ = {} in all\n", decimals_text(-total, 4)));
    }
    let largest = kappa.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
    let decides = |k: f64| k > LARGE || (k > DECISIVE && k > 0.5 * total);
    if let Some((number, kappa)) = largest.filter(|&(_, kappa)| decides(kappa)) {
        warn(format_args!(
            "halo {number} (counted from 0) has a convergence of {kappa:.3} where its sheet is taken, of {total:.3} of all: \
             towards the centre of an NFW halo κ has no bound, and a sheet of −κ bends every ray; consider no sheets, or leave \
             the halo out (haloes.max_kappa)"
        ));
    }
}

/// The convergence of each halo where its sheet is taken, on a configured line of sight with sheets on the axis; none else.
pub fn kappa_of_sheets(config: &Config, haloes: &Haloes) -> Result<Vec<f64>> {
    match config.line_of_sight.sheets {
        SheetModel::OnAxis => Ok(haloes.effects(config)?.decisive(config).kappa.clone()),
        _ => Ok(Vec::new()),
    }
}

/// The sheets of a configured line of sight, with [`kappa_of_sheets`].
pub fn tell_sheets(config: &Config, kappa: &[f64], bars: &Bars) {
    match config.line_of_sight.sheets {
        SheetModel::OnAxis => tell("on-axis", kappa, bars),
        SheetModel::None => tell("none", kappa, bars),
        _ if !bars.is_quiet() => print("sheets: mean-density\n"),
        _ => {}
    }
}
