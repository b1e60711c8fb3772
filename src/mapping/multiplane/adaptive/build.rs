//! From a survey to a tile, and from a tile to the survey of a narrower one.

use multiversion::multiversion;

use super::chebyshev::{Basis, Jet, LANES, Series};
use super::field::Field;
use super::kick::{Kick, Line};
use super::survey::{FINE_NODES, ROW_NODES, Rough, Spot, Survey, rays};
use super::tile::{Event, Met, Tile};
use super::way::{Linear, Rows, Way, apply, kick};
use crate::mapping::Order;

/// Paths and rows are summed to this part of the accuracy.
const SERIES_SHARE: f64 = 1e-3;
/// The deviation that an error of rows multiplies is taken to be at most this, arcsec.
const DEVIATION_ARCSEC: f64 = 0.1;
/// By how much the largest error over a tile may exceed that of the rays compared.
const SAFETY: f64 = 4.0;

impl<'a> Tile<'a> {
    /// Makes a tile from a survey; `inherited_arcsec` bounds the error of the survey itself.
    pub fn new(survey: &Survey<'a>, way: Way, accuracy_arcsec: f64, inherited_arcsec: f64) -> Self {
        let mut tile = build(survey, way, SERIES_SHARE * accuracy_arcsec);
        let first = FINE_NODES + ROW_NODES;
        let ours = tile.trace(&survey.theta_arcsec[first..], Order::Position).beta_arcsec;
        let gaps = ours.iter().zip(&survey.beta_arcsec[first..]);
        let worst = gaps.map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]));
        // Not a number must not pass.
        let worst = worst.fold(0.0, |most, gap| if gap > most || gap.is_nan() { gap } else { most });
        tile.bound_arcsec = inherited_arcsec + SAFETY * worst;
        tile
    }

    /// Surveys a square inside this tile.
    pub fn survey(&self, square: Field, tolerance_arcsec: f64) -> Survey<'a> {
        let images: Vec<[f64; 2]> = self.events.iter().map(|event| event.image_arcsec).collect();
        let theta_arcsec = rays(&square, &images);
        let (bundle, met) = self.record(&theta_arcsec);
        let is_rough = |event: &Event, met: &Met| match &event.kick {
            Kick::Lens(..) => true,
            Kick::Halo(plane) => {
                let spot = Spot::of(met.theta_arcsec.iter().copied());
                let halo = |(t, k): (&[f64; 2], &[f64; 2])| {
                    [0, 1].map(|c| k[c] + plane.f_sheet * t[c]).iter().map(|k| k * k).sum::<f64>()
                };
                let alpha = met.theta_arcsec.iter().zip(&met.kick_arcsec).map(halo).fold(0.0, f64::max).sqrt();
                spot.is_rough(plane, alpha, tolerance_arcsec)
            }
        };
        let keep: Vec<bool> = self.events.iter().zip(&met).map(|(event, met)| is_rough(event, met)).collect();
        let (rows, end_rows) = narrower_rows(self, &theta_arcsec[FINE_NODES..FINE_NODES + ROW_NODES], &met, &keep);
        let kept = self.events.iter().zip(met).zip(keep).filter(|(_, keep)| *keep);
        let rough = kept.zip(rows).map(|(((event, met), _), rows)| Rough { kick: event.kick, met, rows });
        Survey { square, theta_arcsec, rough: rough.collect(), beta_arcsec: bundle.beta_arcsec, end_rows }
    }
}

/// Rows of the events kept and at the end at the coarse nodes, with the Hessians of those that are not.
#[allow(unsafe_code, reason = "the dispatcher that `multiversion` generates")]
#[multiversion(targets("x86_64+avx512f+avx512dq", "x86_64+avx2", "aarch64+neon"))]
fn narrower_rows(
    tile: &Tile,
    theta: &[[f64; 2]],
    met: &[Met],
    keep: &[bool],
) -> (Vec<[Rows; ROW_NODES]>, [Rows; ROW_NODES]) {
    let basis = Basis::at::<0>(&tile.square, theta);
    let mut jet = Jet::<8>::zero();
    let mut linear = [Linear::identity(); ROW_NODES];
    let mut all = Vec::new();
    for ((event, met), keep) in tile.events.iter().zip(met).zip(keep) {
        event.rows.at::<0>(&basis, &mut jet);
        if *keep {
            all.push(std::array::from_fn(|i| linear[i].rows(&rows_of(&jet, i))));
        }
        let w = tile.way.weight(event.kick.chi_cmpc());
        for (i, linear) in linear.iter_mut().enumerate() {
            let held = event.line.hessian;
            let own = if *keep { [0.0; 3] } else { event.kick.hessian(met.theta_arcsec[FINE_NODES + i]) };
            linear.kick(&rows_of(&jet, i), w, [0, 1, 2].map(|c| own[c] - held[c]));
        }
    }
    tile.end_rows.at::<0>(&basis, &mut jet);
    (all, std::array::from_fn(|i| linear[i].rows(&rows_of(&jet, i))))
}

#[inline(always)]
fn rows_of(jet: &Jet<8>, i: usize) -> Rows {
    [0, 1].map(|c| std::array::from_fn(|n| jet.value[4 * c + n][i]))
}

/// Fits a line to every kick, puts it into the rows, and interpolates rows and what kicks leave of the paths.
#[allow(unsafe_code, reason = "the dispatcher that `multiversion` generates")]
#[multiversion(targets("x86_64+avx512f+avx512dq", "x86_64+avx2", "aarch64+neon"))]
fn build<'a>(survey: &Survey<'a>, way: Way, tolerance: f64) -> Tile<'a> {
    let nodes = &survey.theta_arcsec[..FINE_NODES];
    let bases: Vec<Basis> = nodes.chunks(LANES).map(|block| Basis::at::<0>(&survey.square, block)).collect();
    let mut jet = Jet::<8>::zero();
    let mut linear = [Linear::identity(); ROW_NODES];
    let mut z = [[0.0; 4]; FINE_NODES];
    let mut values = [[0.0; 2]; FINE_NODES];
    // Interpolated rows, and S = θ − Qz at the nodes.
    let mut follow = |rows: [Rows; ROW_NODES], at: &[[f64; 2]], z: &[[f64; 4]; FINE_NODES], w: f64| {
        let flat = rows.map(|[x, y]| std::array::from_fn(|q| if q < 4 { x[q] } else { y[q - 4] }));
        let scale = std::array::from_fn(|q| if q % 4 < 2 { 1.0 } else { w });
        let series = Series::coarse(&flat, scale, tolerance / DEVIATION_ARCSEC);
        let mut at_nodes = [[[0.0; 4]; 2]; FINE_NODES];
        for (block, basis) in bases.iter().enumerate() {
            series.at::<0>(basis, &mut jet);
            for i in 0..LANES {
                at_nodes[block * LANES + i] = rows_of(&jet, i);
            }
        }
        for (i, value) in values.iter_mut().enumerate() {
            let moved = apply(&at_nodes[i], &z[i]);
            *value = [at[i][0] - moved[0], at[i][1] - moved[1]];
        }
        (series, Series::fine(&values, [1.0; 2], tolerance), at_nodes)
    };
    let mut events = Vec::with_capacity(survey.rough.len());
    for rough in &survey.rough {
        let chi = rough.kick.chi_cmpc();
        let (theta, kicks) = (&rough.met.theta_arcsec, &rough.met.kick_arcsec);
        let line = Line::through(theta, kicks);
        let w = way.weight(chi);
        let here: [Rows; ROW_NODES] = std::array::from_fn(|i| linear[i].rows(&rough.rows[i]));
        let (rows, path, at_nodes) = follow(here, theta, &z, w);
        for (i, z) in z.iter_mut().enumerate() {
            let [x, y] = [0, 1].map(|c| theta[i][c] - line.mean_arcsec[c]);
            let [xx, xy, yy] = line.hessian;
            let [p, q] = [0, 1].map(|c| kicks[i][c] - line.push_arcsec[c]);
            kick(&at_nodes[i], w, [p - xx * x - xy * y, q - xy * x - yy * y], z);
        }
        for (linear, rows) in linear.iter_mut().zip(&rough.rows) {
            linear.kick(rows, w, line.hessian);
        }
        let image_arcsec = image(&survey.square, &rough.kick, theta);
        events.push(Event { kick: rough.kick, line, path, rows, image_arcsec });
    }
    let ends: [Rows; ROW_NODES] = std::array::from_fn(|i| linear[i].rows(&survey.end_rows[i]));
    let (end_rows, end, _) = follow(ends, &survey.beta_arcsec, &z, 1.0);
    Tile { square: survey.square, way, events, end, end_rows, bound_arcsec: 0.0 }
}

/// The direction in which a halo's centre is seen, to first order from the corners of the square.
fn image(square: &Field, kick: &Kick, theta: &[[f64; 2]]) -> [f64; 2] {
    let Kick::Halo(plane) = kick else { return [f64::NAN; 2] };
    let side = super::chebyshev::SIDE;
    let corner = |x: usize, y: usize| theta[(1 - x) * (side - 1) + (1 - y) * side * (side - 1)];
    let [ll, hl, lh, hh] = [corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)];
    let [[xx, xy], [yx, yy]] = [0, 1].map(|c| {
        [0.25 * (hl[c] + hh[c] - ll[c] - lh[c]), 0.25 * (lh[c] + hh[c] - ll[c] - hl[c])]
    });
    let [u, v] = [0, 1].map(|c| plane.centre_arcsec[c] - 0.25 * (ll[c] + hl[c] + lh[c] + hh[c]));
    let determinant = xx * yy - xy * yx;
    let place = [(yy * u - xy * v) / determinant, (xx * v - yx * u) / determinant];
    [0, 1].map(|c| square.centre_arcsec[c] + square.half_arcsec[c] * place[c])
}
