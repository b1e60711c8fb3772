//! NFW, truncated NFW, power-law lenses and Sérsic light against lenstronomy, and against 30 digits by mpmath.
//!
//! Vectors and tensors are compared as wholes: largest difference over largest component.

use crate::differences::{Differences, scaled_difference};
use crate::oracle_table::{Agreement, Reference};
use haloray::profile::light::{LightProfile, Sersic};
use haloray::profile::mass::{Epl, MassModel, MassProfile, Nfw, TruncatedNfw};
use haloray::profile::registry;

/// NFW of 30 digits: a few rounding errors of the radial functions at every radius, the seam at r_s included.
const NFW_EXACT_TOLERANCE: f64 = 1e-13;
/// lenstronomy's NFW between 0.1 and 1000 r_s, 0.1% away from r_s: both are then free of cancellation.
const NFW_LENSTRONOMY_TOLERANCE: f64 = 1e-12;
/// Truncated NFW of 30 digits.
const TNFW_EXACT_TOLERANCE: f64 = 1e-12;
/// lenstronomy's TNFW between 0.1 and 30 r_s, 0.1% away from r_s.
const TNFW_LENSTRONOMY_TOLERANCE: f64 = 1e-11;
/// The series of ₂F₁ against mpmath's.
const EPL_EXACT_TOLERANCE: f64 = 1e-13;
/// The same against scipy's ₂F₁ in lenstronomy.
const EPL_LENSTRONOMY_TOLERANCE: f64 = 1e-12;
/// β of lenstronomy's power law with boxy or disky contours, arcsec.
const BOXY_BETA_TOLERANCE_ARCSEC: f64 = 1e-9;
/// Amplitude and brightness: rounding of the gamma function and of an exponent of up to 20.
const SERSIC_TOLERANCE: f64 = 1e-12;

/// What a lens can be asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Quantity {
    Potential,
    Deflection,
    Hessian,
    Third,
}

use Quantity::{Deflection, Hessian, Potential, Third};

impl Quantity {
    fn columns(self) -> &'static [&'static str] {
        match self {
            Potential => &["psi"],
            Deflection => &["alpha_x", "alpha_y"],
            Hessian => &["f_xx", "f_xy", "f_yy"],
            Third => &["f_xxx", "f_xxy", "f_xyy", "f_yyy"],
        }
    }

    fn of(self, profile: &MassModel, x: f64, y: f64) -> Vec<f64> {
        match self {
            Potential => vec![profile.potential(x, y)],
            Deflection => profile.deflection(x, y).into(),
            Hessian => profile.hessian(x, y).into(),
            Third => profile.third_derivatives(x, y).into(),
        }
    }

    fn column_values(self, reference: &Reference, oracle: &str, row: usize) -> Vec<f64> {
        self.columns().iter().map(|part| reference.column(&format!("{oracle}_{part}"))[row]).collect()
    }
}

/// A reference table with the lens of each of its rows.
struct Lenses {
    name: &'static str,
    reference: Reference,
    profiles: Vec<MassModel>,
}

impl Lenses {
    fn load(name: &'static str, build: impl Fn(&dyn Fn(&str) -> f64) -> MassModel) -> Self {
        let reference = Reference::load(name);
        let rows = reference.column("x").len();
        let profiles = (0..rows).map(|row| build(&|column| reference.column(column)[row])).collect();
        Self { name, reference, profiles }
    }

    fn nfw() -> Self {
        Self::load("nfw", |at| MassModel::Nfw(Nfw::new(at("r_s"), at("alpha_rs"), [0.0, 0.0]).unwrap()))
    }

    fn truncated() -> Self {
        Self::load("tnfw", |at| {
            let halo = TruncatedNfw::new(at("r_s"), at("alpha_rs"), at("r_trunc"), [0.0, 0.0]);
            MassModel::TruncatedNfw(halo.unwrap())
        })
    }

    fn power_law() -> Self {
        Self::load("epl", |at| {
            MassModel::Epl(Epl::new(1.0, at("slope"), [at("e1"), at("e2")], [0.0, 0.0]).unwrap())
        })
    }

    fn boxy() -> Self {
        let lens = registry::mass("EPL_BOXYDISKY").unwrap();
        Self::load("epl_boxydisky", |at| {
            let value = |name| match name {
                "theta_E" => at("theta_e"),
                "gamma" => at("slope"),
                "center_x" | "center_y" => 0.0,
                other => at(other),
            };
            lens.build(|parameter| value(parameter.name)).unwrap()
        })
    }

    /// Radius over scale radius of a row.
    fn ratio(&self, row: usize) -> f64 {
        let at = |column: &str| self.reference.column(column)[row];
        at("x").hypot(at("y")) / at("r_s")
    }

    fn ours(&self, quantity: Quantity, row: usize) -> Vec<f64> {
        let at = |column: &str| self.reference.column(column)[row];
        quantity.of(&self.profiles[row], at("x"), at("y"))
    }

    /// Our differences from an oracle in the rows that `keep` names.
    fn against(&self, oracle: &str, quantity: Quantity, keep: impl Fn(usize) -> bool) -> Differences {
        let rows = (0..self.profiles.len()).filter(|row| keep(*row));
        Differences::of(
            &format!("{} {quantity:?}, {oracle}", self.name),
            rows.map(|row| {
                let theirs = quantity.column_values(&self.reference, oracle, row);
                scaled_difference(&self.ours(quantity, row), &theirs)
            }),
        )
    }

    /// lenstronomy's own differences from 30 digits in the rows that `keep` names.
    fn lenstronomy_error(&self, quantity: Quantity, keep: impl Fn(usize) -> bool) -> Differences {
        let rows = (0..self.profiles.len()).filter(|row| keep(*row));
        Differences::of(
            &format!("{} {quantity:?}, lenstronomy's own error", self.name),
            rows.map(|row| {
                let values = |oracle| quantity.column_values(&self.reference, oracle, row);
                scaled_difference(&values("lenstronomy"), &values("exact"))
            }),
        )
    }
}

impl Lenses {
    /// lenstronomy subtracts nearly equal numbers towards the centre and, twice in its Hessian, towards r_s.
    fn lenstronomy_is_accurate(&self, quantity: Quantity, row: usize) -> bool {
        let seam = if quantity == Hessian { 0.05 } else { 0.9e-3 };
        self.ratio(row) > 0.1 && (self.ratio(row) - 1.0).abs() > seam
    }
}

#[test]
fn nfw_is_exact_at_every_radius() {
    let lenses = Lenses::nfw();
    for quantity in [Potential, Deflection, Hessian, Third] {
        lenses.against("exact", quantity, |_| true).require_max(NFW_EXACT_TOLERANCE);
    }
}

#[test]
fn nfw_agrees_with_lenstronomy_wherever_lenstronomy_is_accurate() {
    let lenses = Lenses::nfw();
    for quantity in [Potential, Deflection, Hessian] {
        let accurate = |row| lenses.lenstronomy_is_accurate(quantity, row);
        lenses.against("lenstronomy", quantity, accurate).require_max(NFW_LENSTRONOMY_TOLERANCE);
    }
}

#[test]
fn what_remains_of_nfw_is_lenstronomys_loss_of_digits() {
    let lenses = Lenses::nfw();
    for quantity in [Potential, Deflection, Hessian] {
        let centre = lenses.lenstronomy_error(quantity, |row| lenses.ratio(row) < 0.01);
        assert!(centre.max > 1e2 * NFW_EXACT_TOLERANCE, "{quantity:?}: lenstronomy has become exact");
        lenses.lenstronomy_error(quantity, |row| (lenses.ratio(row) - 1.0).abs() < 2e-3);
    }
}

#[test]
fn truncated_nfw_is_exact_at_every_radius() {
    let lenses = Lenses::truncated();
    for quantity in [Potential, Deflection, Hessian, Third] {
        lenses.against("exact", quantity, |_| true).require_max(TNFW_EXACT_TOLERANCE);
    }
}

#[test]
fn truncated_nfw_agrees_with_lenstronomy_wherever_lenstronomy_is_accurate() {
    let lenses = Lenses::truncated();
    for quantity in [Deflection, Hessian] {
        let accurate = |row| lenses.lenstronomy_is_accurate(quantity, row) && lenses.ratio(row) < 30.0;
        lenses.against("lenstronomy", quantity, accurate).require_max(TNFW_LENSTRONOMY_TOLERANCE);
        lenses.lenstronomy_error(quantity, |row| !accurate(row));
    }
    lenses.lenstronomy_error(Potential, |_| true);
}

#[test]
fn power_laws_are_exact() {
    let lenses = Lenses::power_law();
    for quantity in [Potential, Deflection, Hessian, Third] {
        lenses.against("exact", quantity, |_| true).require_max(EPL_EXACT_TOLERANCE);
    }
}

#[test]
fn power_laws_agree_with_lenstronomy() {
    let lenses = Lenses::power_law();
    for quantity in [Potential, Deflection, Hessian] {
        lenses.against("lenstronomy", quantity, |_| true).require_max(EPL_LENSTRONOMY_TOLERANCE);
    }
}

#[test]
fn boxy_and_disky_power_laws_are_exact_and_agree_with_lenstronomy() {
    let lenses = Lenses::boxy();
    for quantity in [Potential, Deflection, Hessian, Third] {
        lenses.against("exact", quantity, |_| true).require_max(EPL_EXACT_TOLERANCE);
    }
    for quantity in [Potential, Deflection, Hessian] {
        lenses.against("lenstronomy", quantity, |_| true).require_max(EPL_LENSTRONOMY_TOLERANCE);
    }
    // β = θ − α.
    for row in 0..lenses.profiles.len() {
        let theirs = Deflection.column_values(&lenses.reference, "lenstronomy", row);
        let ours = lenses.ours(Deflection, row);
        assert!((ours[0] - theirs[0]).hypot(ours[1] - theirs[1]) < BOXY_BETA_TOLERANCE_ARCSEC);
    }
}

#[test]
fn sersic_amplitude_and_brightness_agree_with_lenstronomy() {
    let reference = Reference::load("sersic");
    let at = |column: &str, row: usize| reference.column(column)[row];
    let (amplitudes, brightness): (Vec<f64>, Vec<f64>) = (0..reference.column("x").len())
        .map(|row| {
            let e = [at("e1", row), at("e2", row)];
            let light =
                Sersic::with_flux(at("flux", row), at("radius", row), at("index", row), e, [0.1, -0.2]);
            let light = light.unwrap();
            (light.amplitude(), light.surface_brightness(at("x", row), at("y", row)))
        })
        .unzip();
    for oracle in ["exact", "lenstronomy"] {
        Agreement::of(oracle, &amplitudes, reference.column(&format!("{oracle}_amplitude")))
            .require_max(SERSIC_TOLERANCE);
        Agreement::of(oracle, &brightness, reference.column(&format!("{oracle}_brightness")))
            .require_max(SERSIC_TOLERANCE);
    }
}
