//! Table A1 of the paper remade: the full LOS model is three lens planes, external shears before and behind an EPL.

use haloray::cosmology::Background;
use haloray::mapping::multiplane::GeneralMultiPlane;
use haloray::mapping::tidal::{LineOfSightModel, Tidal, TidalLens};
use haloray::mapping::{Mapping, Order};
use haloray::profile::mass::{Epl, External, MassModel, MassProfile};
use nalgebra::{Matrix2, Vector2};
use rand::{RngExt, SeedableRng};

use crate::differences::Differences;

/// β in arcsec: a few units in the last place of 2″.
const BETA_TOLERANCE_ARCSEC: f64 = 5e-15;
/// Jacobian.
const JACOBIAN_TOLERANCE: f64 = 1e-12;
/// Differences of arrival times at one β, days.
const DELAY_TOLERANCE_DAYS: f64 = 1e-9;
/// β of an image of Newton's method; delays feel it 100 days/arcsec² × 3″ times over.
const IMAGE_TOLERANCE_ARCSEC: f64 = 2e-14;
const CASES: usize = 50;
const SEED: u64 = 5982;
const RAYS: usize = 8;

/// A shear plane: its distance, and the reduced convergence and shear there.
struct Sheet {
    chi: f64,
    profile: External,
}

/// Foreground sheet, lens, background sheet and source.
struct Case {
    near: Sheet,
    chi_lens: f64,
    lens: Epl,
    far: Sheet,
    chi_source: f64,
    tidal: TidalLens,
    planes: GeneralMultiPlane,
}

impl Case {
    fn draw(random: &mut impl RngExt) -> Self {
        let mut within = |low: f64, high: f64| random.random_range(low..high);
        let background = Background::paper();
        let z_lens = within(0.3, 0.8);
        let z_source = within(1.2, 2.5);
        let [z_near, z_far] =
            [within(0.05, 0.95) * z_lens, z_lens + within(0.05, 0.95) * (z_source - z_lens)];
        let chi = |z: f64| background.comoving_distance_mpc(z);
        let (chi_lens, chi_source) = (chi(z_lens), chi(z_source));
        let lens = Epl::new(
            within(0.8, 1.8),
            within(1.7, 2.5),
            [within(-0.15, 0.15), within(-0.15, 0.15)],
            [within(-0.05, 0.05), within(-0.05, 0.05)],
        )
        .unwrap();
        let mut sheet = |z: f64| {
            let [kappa, g1, g2] = [within(-0.05, 0.05), within(-0.05, 0.05), within(-0.05, 0.05)];
            Sheet { chi: chi(z), profile: External::new(kappa, [g1, g2], [0.0; 4], [0.0; 2]).unwrap() }
        };
        let (near, far) = (sheet(z_near), sheet(z_far));
        let profiles = [
            (z_far, MassModel::External(far.profile)),
            (z_lens, MassModel::Epl(lens.clone())),
            (z_near, MassModel::External(near.profile)),
        ];
        let planes = GeneralMultiPlane::new(&background, z_source, &profiles).unwrap();
        let model = tidal_model(&near, chi_lens, &far, chi_source);
        let time_delay_distance_mpc = Some(chi_lens * chi_source / (chi_source - chi_lens));
        let tidal = TidalLens { model, lenses: vec![MassModel::Epl(lens.clone())], time_delay_distance_mpc };
        Self { near, chi_lens, lens, far, chi_source, tidal, planes }
    }

    /// The recursion x ← x + Δχ·s, s ← s − f·α(x/χ) written out, from θ to β.
    fn traced(&self, theta: [f64; 2]) -> [f64; 2] {
        let (mut chi, mut x, mut s) = (0.0, [0.0; 2], theta);
        let on = |x: [f64; 2], s: [f64; 2], step: f64| [x[0] + step * s[0], x[1] + step * s[1]];
        let profiles = [
            (self.near.chi, MassModel::External(self.near.profile)),
            (self.chi_lens, MassModel::Epl(self.lens.clone())),
            (self.far.chi, MassModel::External(self.far.profile)),
        ];
        for (chi_plane, profile) in profiles {
            x = on(x, s, chi_plane - chi);
            chi = chi_plane;
            let f = self.chi_source / (self.chi_source - chi);
            let alpha = profile.deflection(x[0] / chi, x[1] / chi);
            s = [s[0] - f * alpha[0], s[1] - f * alpha[1]];
        }
        on(x, s, self.chi_source - chi).map(|x| x / self.chi_source)
    }

    /// Up to two images of β by Newton's method from rings of starts, at least 0.1″ apart.
    fn images(&self, beta: [f64; 2]) -> Vec<[f64; 2]> {
        let mut found: Vec<[f64; 2]> = Vec::new();
        for k in 0..48 {
            let (radius, angle) = ([0.5, 1.0, 1.6][k % 3], k as f64 * std::f64::consts::TAU / 48.0);
            let mut theta = Vector2::new(radius * angle.cos(), radius * angle.sin());
            for _ in 0..40 {
                let rays = self.planes.map(&[[theta.x, theta.y]], Order::Jacobian);
                let miss = Vector2::from(rays.beta_arcsec[0]) - Vector2::from(beta);
                let Some(inverse) = Matrix2::from_row_slice(&rays.jacobian[0]).try_inverse() else { break };
                let step = inverse * miss;
                theta -= step * (0.3 / step.norm()).min(1.0);
            }
            let reached = self.planes.map(&[[theta.x, theta.y]], Order::Position).beta_arcsec[0];
            let apart = found.iter().all(|t| (t[0] - theta.x).hypot(t[1] - theta.y) > 0.1);
            if apart && (reached[0] - beta[0]).hypot(reached[1] - beta[1]) < IMAGE_TOLERANCE_ARCSEC {
                found.push([theta.x, theta.y]);
            }
        }
        found.truncate(2);
        found
    }
}

/// od, os, ds of the two sheets, exactly: products of 2×2 matrices, X ← X + Δχ·S, S ← S − (f/χ)·H·X.
fn tidal_model(near: &Sheet, chi_lens: f64, far: &Sheet, chi_source: f64) -> LineOfSightModel {
    let kick = |sheet: &Sheet| {
        let [xx, xy, yy] = sheet.profile.hessian(0.0, 0.0);
        Matrix2::new(xx, xy, xy, yy) * (chi_source / (chi_source - sheet.chi) / sheet.chi)
    };
    let one = Matrix2::identity();
    let x_near = one * near.chi;
    let s_near = one - kick(near) * x_near;
    let x_lens = x_near + s_near * (chi_lens - near.chi);
    let x_far = x_lens + s_near * (far.chi - chi_lens);
    let s_far = s_near - kick(far) * x_far;
    let x_source = x_far + s_far * (chi_source - far.chi);
    let y_far = one * (far.chi - chi_lens);
    let y_source = y_far + (one - kick(far) * y_far) * (chi_source - far.chi);
    LineOfSightModel::Full {
        od: Tidal::of_jacobian(&(x_lens / chi_lens)),
        os: Tidal::of_jacobian(&(x_source / chi_source)),
        ds: Tidal::of_jacobian(&(y_source / (chi_source - chi_lens))),
    }
}

#[test]
fn the_full_model_is_three_planes() {
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(SEED);
    let (mut by_hand, mut by_planes, mut jacobian, mut delay) = (vec![], vec![], vec![], vec![]);
    for _ in 0..CASES {
        let case = Case::draw(&mut random);
        let theta: Vec<[f64; 2]> =
            (0..RAYS).map(|_| [random.random_range(-2.0..2.0), random.random_range(-2.0..2.0)]).collect();
        let (tidal, planes) =
            (case.tidal.map(&theta, Order::Jacobian), case.planes.map(&theta, Order::Jacobian));
        let distance = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
        for (i, &theta) in theta.iter().enumerate() {
            by_hand.push(distance(tidal.beta_arcsec[i], case.traced(theta)));
            by_planes.push(distance(tidal.beta_arcsec[i], planes.beta_arcsec[i]));
            jacobian.extend((0..4).map(|c| tidal.jacobian[i][c] - planes.jacobian[i][c]));
        }
        let beta = [random.random_range(-0.06..0.06), random.random_range(-0.06..0.06)];
        let images = case.images(beta);
        assert_eq!(images.len(), 2, "no two images of {beta:?}");
        let [ours, theirs] = [case.tidal.delay_days(&images), case.planes.delay_days(&images)];
        assert!((ours[1] - ours[0]).abs() > 1e-3, "images of one arrival time test nothing");
        delay.push((ours[1] - ours[0]) - (theirs[1] - theirs[0]));
    }
    Differences::of("β of the model and of the recursion by hand (arcsec)", by_hand)
        .require_max(BETA_TOLERANCE_ARCSEC);
    Differences::of("β of the model and of the planes (arcsec)", by_planes)
        .require_max(BETA_TOLERANCE_ARCSEC);
    Differences::of("Jacobian", jacobian).require_max(JACOBIAN_TOLERANCE);
    Differences::of("arrival-time differences (days)", delay).require_max(DELAY_TOLERANCE_DAYS);
}
