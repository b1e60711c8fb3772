//! What the rough haloes do to a tile of rays: their deviation from the skeleton, with a bound on its error.

use multiversion::multiversion;

use super::chebyshev::{Field, basis, chebyshev, terms};
use super::skeleton::Skeleton;
use crate::mapping::multiplane::recursion::{Lanes, TILE, radial_functions};

/// Ends of a tile of rays, Mpc·arcsec, and the bounds of their errors.
pub(super) struct Ends {
    pub x: [Lanes; 2],
    pub error: Lanes,
}

/// Terms of the highest degree in use (15).
const TERMS_MAX: usize = terms(15);

/// N polynomials together: each product of the basis is loaded once.
#[inline(always)]
fn evaluate<const N: usize>(polynomials: &[[f64; N]], basis: &[Lanes]) -> [Lanes; N] {
    let mut sums = [[0.0; TILE]; N];
    // So many lanes stay in registers over all terms, in enough independent sums.
    const LANES: usize = 24;
    for first in (0..TILE).step_by(LANES) {
        let mut sum = [[0.0; LANES]; N];
        for (c, b) in polynomials.iter().zip(basis) {
            for n in 0..N {
                for i in 0..LANES {
                    sum[n][i] += c[n] * b[first + i];
                }
            }
        }
        for n in 0..N {
            sums[n][first..first + LANES].copy_from_slice(&sum[n]);
        }
    }
    sums
}

/// y ← y + Δχ v, v ← v − f α(θ_S + y/χ) at rough planes, v ← v − H y − ½T y y at stations; errors beside them.
///
/// Per plane the slope's error grows by at most L times the position's, L = k m(t − e) because no eigenvalue of the
/// Hessian exceeds α/t = k m, which falls with t: m(t − e) ≤ 1.25 m(t) for e < t/10, and below that the
/// difference of two deflections is at most k m(t)(2t + e).
#[allow(unsafe_code, reason = "the dispatcher that `multiversion` generates")]
#[multiversion(targets("x86_64+avx512f+avx512dq", "x86_64+avx2", "aarch64+neon"))]
pub(super) fn trace(skeleton: &Skeleton, field: &Field, theta: &[[f64; 2]]) -> Ends {
    let mask: u32 = std::env::var("MASK").ok().map_or(u32::MAX, |m| m.parse().unwrap());
    let on = |b: u32| if mask >> b & 1 == 1 { 1.0 } else { 0.0 };
    let mut products = [[0.0; TILE]; TERMS_MAX];
    let last = theta.len() - 1;
    for i in 0..TILE {
        basis(skeleton.nodes - 1, field.scaled(theta[i.min(last)]), |k, b| products[k][i] = b);
    }
    let products = &products[..terms(skeleton.nodes - 1)];
    let (mut y, mut v): ([Lanes; 2], [Lanes; 2]) = ([[0.0; TILE]; 2], [[0.0; TILE]; 2]);
    // Bounds of the errors of y and v.
    let (mut ey, mut ev): (Lanes, Lanes) = ([0.0; TILE], [0.0; TILE]);
    let mut chi = skeleton.chi_start;
    let mut rough = skeleton.rough.iter().peekable();
    let borders = skeleton.borders_cmpc.iter().enumerate().skip(1);
    for (g, &border) in borders {
        let step = border - chi;
        chi = border;
        let inv_chi = 1.0 / chi;
        for i in 0..TILE {
            y[0][i] += step * v[0][i];
            y[1][i] += step * v[1][i];
            ey[i] += step * ev[i];
        }
        let (y_here, v_before, ey_before) = (y, v, ey);
        let (before, behind) = (skeleton.cells[g - 1], skeleton.cells.get(g).copied().unwrap_or_default());
        let room = skeleton.room_arcsec * chi;
        // Tides of the cell before act as if at its borders: the position there is off by this.
        for i in 0..TILE {
            let (a, b) = (v_before[0][i], v_before[1][i]);
            let slope = (a * a + b * b).sqrt();
            let (a, b) = (y_here[0][i], y_here[1][i]);
            let r = (a * a + b * b).sqrt() + step * slope;
            ey[i] += on(7)*before.tide_spread * slope
                + on(8)*before.flexion * step * step * slope * r
                + on(4)*before.tide * before.tide * step * step * r;
            ev[i] += on(5)*before.flexion * step * step * slope * slope * 0.25
                + on(6)*before.fourth * r * r * r / 6.0
                + on(1)*before.tide_root * before.tide_root * step * r;
            if !(r <= room) {
                ev[i] = f64::INFINITY;
            }
        }
        while let Some(rough) = rough.next_if(|rough| rough.cell == g) {
            let plane = &rough.plane;
            let [qx, qy] = evaluate(&rough.path, products);
            let [px, py] = rough.kick.at(&qx, &qy);
            let (mut tx, mut ty, mut u) = ([0.0; TILE], [0.0; TILE], [0.0; TILE]);
            for i in 0..TILE {
                tx[i] = qx[i] + y_here[0][i] * inv_chi - plane.centre_arcsec[0];
                ty[i] = qy[i] + y_here[1][i] * inv_chi - plane.centre_arcsec[1];
                u[i] = plane.u(tx[i], ty[i]);
            }
            let (mut m, mut p1, mut p2) = ([0.0; TILE], [0.0; TILE], [0.0; TILE]);
            radial_functions::<0>(plane, &u, &mut m, &mut p1, &mut p2);
            for i in 0..TILE {
                let km = plane.fk * m[i];
                v[0][i] -= km * tx[i] - px[i];
                v[1][i] -= km * ty[i] - py[i];
                let t = (u[i] / plane.inv_r_s2).sqrt();
                let e = on(0)*rough.error_arcsec + ey[i] * inv_chi;
                let far = 1.25 * e;
                let near = 2.0 * t + e;
                ev[i] += km.abs() * if far < near { far } else { near };
            }
        }
        let (h, t) = &skeleton.tides[g];
        let ([hxx, hxy, hyy], [txxx, txxy, txyy, tyyy]) = (evaluate(h, products), evaluate(t, products));
        let [h_error, t_error] = skeleton.tide_errors[g];
        let (tide, flexion) = (before.tide + behind.tide, before.flexion + behind.flexion);
        for i in 0..TILE {
            let (a, b) = (y_here[0][i], y_here[1][i]);
            let r = (a * a + b * b).sqrt();
            v[0][i] -=
                hxx[i] * a + hxy[i] * b + 0.5 * (txxx[i] * a * a + 2.0 * txxy[i] * a * b + txyy[i] * b * b);
            v[1][i] -=
                hxy[i] * a + hyy[i] * b + 0.5 * (txxy[i] * a * a + 2.0 * txyy[i] * a * b + tyyy[i] * b * b);
            ev[i] += (tide + flexion * (r + ey[i])) * ey_before[i] + on(2)*h_error * r + on(3)*0.5 * t_error * r * r;
        }
    }
    let mut x = [[0.0; TILE]; 2];
    for i in 0..TILE {
        let [tx, ty] = field.scaled(theta[i.min(last)]).map(chebyshev);
        let n = skeleton.nodes;
        for (x, end) in x.iter_mut().zip(&skeleton.end) {
            x[i] = (0..n * n).map(|k| end[k] * tx[k / n] * ty[k % n]).sum();
        }
        x[0][i] += y[0][i];
        x[1][i] += y[1][i];
        ey[i] += on(10)*skeleton.end_error;
        if !(ev[i] < f64::INFINITY && ey[i] < f64::INFINITY) {
            ey[i] = f64::INFINITY;
        }
    }
    Ends { x, error: ey }
}
