//! What the rough haloes do to a tile of rays: their deviation from the skeleton, with a bound on its error.

use multiversion::multiversion;

use super::chebyshev::{Field, basis, terms};
use super::skeleton::Skeleton;
use crate::mapping::multiplane::recursion::{Lanes, TILE, radial_functions};

/// Ends of a tile of rays, Mpc·arcsec, and the bounds of their errors.
pub(super) struct Ends {
    pub x: [Lanes; 2],
    pub error: Lanes,
}

/// Terms of the highest degree in use (15).
const TERMS_MAX: usize = terms(15);

#[inline(always)]
fn polynomial(coefficients: &[f64], basis: &[Lanes]) -> Lanes {
    let mut sum = [0.0; TILE];
    for (c, b) in coefficients.iter().zip(basis) {
        for i in 0..TILE {
            sum[i] += c * b[i];
        }
    }
    sum
}

/// y ← y + Δχ v, v ← v − f α(θ_S + y/χ) at rough planes, v ← v − H y − ½T y y at stations; errors beside them.
///
/// Per plane the slope's error grows by at most L times the position's, L = k m(t − e) because no eigenvalue of the
/// Hessian exceeds α/t = k m, which falls with t: m(t − e) ≤ 1.25 m(t) for e < t/10, and below that the
/// difference of two deflections is at most k m(t)(2t + e).
#[allow(unsafe_code, reason = "the dispatcher that `multiversion` generates")]
#[multiversion(targets("x86_64+avx512f+avx512dq", "x86_64+avx2", "aarch64+neon"))]
pub(super) fn trace(skeleton: &Skeleton, field: &Field, theta: &[[f64; 2]]) -> Ends {
    let path_terms = terms(skeleton.degree);
    let mut products = [[0.0; TILE]; TERMS_MAX];
    let last = theta.len() - 1;
    for i in 0..TILE {
        basis(skeleton.degree, field.scaled(theta[i.min(last)]), |k, b| products[k][i] = b);
    }
    let products = &products[..path_terms];
    let (mut y, mut v): ([Lanes; 2], [Lanes; 2]) = ([[0.0; TILE]; 2], [[0.0; TILE]; 2]);
    // Bounds of the errors of y and v.
    let (mut ey, mut ev): (Lanes, Lanes) = ([0.0; TILE], [0.0; TILE]);
    let mut chi = skeleton.chi_start;
    let mut rough = skeleton.rough.iter().zip(skeleton.paths.chunks_exact(2 * path_terms)).peekable();
    let [h_terms, t_terms] = skeleton.tide_terms;
    let borders = skeleton.borders_cmpc.iter().enumerate().skip(1);
    let mut tides = skeleton.tides.chunks_exact(3 * h_terms + 4 * t_terms).skip(1);
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
            ey[i] += before.tide_spread * slope
                + before.flexion * step * step * slope * r
                + before.tide * before.tide * step * step * r;
            ev[i] += before.flexion * step * step * slope * slope * 0.25
                + before.fourth * r * r * r / 6.0
                + before.tide * before.tide * step * r;
            if !(r <= room) {
                ev[i] = f64::INFINITY;
            }
        }
        while let Some((rough, path)) = rough.next_if(|(rough, _)| rough.cell == g) {
            let plane = &rough.plane;
            let qx = polynomial(&path[..path_terms], products);
            let qy = polynomial(&path[path_terms..], products);
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
                let part = rough.kick.at(qx[i], qy[i]);
                v[0][i] -= km * tx[i] - part[0];
                v[1][i] -= km * ty[i] - part[1];
                let t = (u[i] / plane.inv_r_s2).sqrt();
                let e = rough.error_arcsec + ey[i] * inv_chi;
                let far = 1.25 * e;
                let near = 2.0 * t + e;
                ev[i] += km.abs() * if far < near { far } else { near };
            }
        }
        let Some(tides) = tides.next() else { break };
        let (h, t) = tides.split_at(3 * h_terms);
        let [hxx, hxy, hyy] = [0, 1, 2].map(|c| polynomial(&h[c * h_terms..][..h_terms], products));
        let [txxx, txxy, txyy, tyyy] =
            [0, 1, 2, 3].map(|c| polynomial(&t[c * t_terms..][..t_terms], products));
        let [h_error, t_error] = skeleton.tide_errors[g];
        let (tide, flexion) = (before.tide + behind.tide, before.flexion + behind.flexion);
        for i in 0..TILE {
            let (a, b) = (y_here[0][i], y_here[1][i]);
            let r = (a * a + b * b).sqrt();
            v[0][i] -=
                hxx[i] * a + hxy[i] * b + 0.5 * (txxx[i] * a * a + 2.0 * txxy[i] * a * b + txyy[i] * b * b);
            v[1][i] -=
                hxy[i] * a + hyy[i] * b + 0.5 * (txxy[i] * a * a + 2.0 * txyy[i] * a * b + tyyy[i] * b * b);
            ev[i] += (tide + flexion * (r + ey[i])) * ey_before[i] + h_error * r + 0.5 * t_error * r * r;
        }
    }
    let end = &skeleton.paths[skeleton.rough.len() * 2 * path_terms..];
    let mut x = [polynomial(&end[..path_terms], products), polynomial(&end[path_terms..], products)];
    for i in 0..TILE {
        x[0][i] += y[0][i];
        x[1][i] += y[1][i];
        ey[i] += skeleton.end_error;
        if !(ev[i] < f64::INFINITY && ey[i] < f64::INFINITY) {
            ey[i] = f64::INFINITY;
        }
    }
    Ends { x, error: ey }
}
