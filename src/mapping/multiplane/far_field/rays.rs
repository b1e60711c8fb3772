//! Rays through a bundle: every kick in turn, many rays in SIMD lanes, with as many derivatives as asked for.

use multiversion::multiversion;

use super::bundle::Bundle;
use super::event::{Event, Halo, Kick, Rows, Way};
use crate::mapping::multiplane::recursion::radial_functions;
use crate::profile::mass::{MassProfile, RadialDerivatives};

/// Rays that travel together.
pub(super) const LANES: usize = 32;
type Lanes = [f64; LANES];

/// An event made ready for rays.
struct Stop {
    w: f64,
    rows: Rows,
    kick_ref: [f64; 2],
    linear: [f64; 3],
    kick: StopKick,
}

enum StopKick {
    Halo(Halo),
    /// Degree, and coefficients of x^i y^j in rows of j.
    Polynomial(usize, Vec<[f64; 2]>),
    Lens {
        theta_arcsec: [f64; 2],
        spread_arcsec: f64,
    },
}

/// A bundle made ready for rays.
pub(super) struct Rays<'a> {
    way: &'a Way<'a>,
    stops: Vec<Stop>,
    beta_ref: [f64; 2],
    end_rows: Rows,
}

/// Where a block of rays ends; `escaped` rays left the bundle at the main lens.
pub(super) struct Ends {
    pub beta: [Lanes; 2],
    pub jacobian: [Lanes; 4],
    pub second: [Lanes; 6],
    pub escaped: [bool; LANES],
}

/// State of a block: z and its derivatives with respect to θ.
struct Block {
    z: [Lanes; 4],
    dz: [Lanes; 8],
    d2z: [Lanes; 12],
}

/// Index pairs (j, k) of the second derivatives.
const PAIRS: [(usize, usize); 3] = [(0, 0), (0, 1), (1, 1)];

impl<'a> Rays<'a> {
    pub fn through(bundle: &Bundle, way: &'a Way<'a>) -> Self {
        let stop = |event: &Event| {
            let kick = match &event.kick {
                Kick::Halo(halo) => StopKick::Halo(*halo),
                Kick::Polynomial(p) if p.degree < 2 => return None,
                Kick::Polynomial(p) => StopKick::Polynomial(p.degree, p.real_rows()),
                &Kick::Lens { theta_arcsec, spread_arcsec } => StopKick::Lens { theta_arcsec, spread_arcsec },
            };
            let w = event.chi / way.length();
            Some(Stop { w, rows: event.rows, kick_ref: event.kick_ref, linear: event.linear, kick })
        };
        Self {
            way,
            stops: bundle.events.iter().filter_map(stop).collect(),
            beta_ref: bundle.beta_ref,
            end_rows: bundle.end_rows,
        }
    }

    /// Traces a block of at most [`LANES`] rays, offsets from the central ray in arcsec.
    pub fn trace(&self, offsets: &[[f64; 2]], order: usize) -> Ends {
        match order {
            0 => positions(self, offsets),
            1 => jacobians(self, offsets),
            _ => second_derivatives(self, offsets),
        }
    }
}

#[inline(always)]
fn trace<const ORDER: usize>(rays: &Rays, offsets: &[[f64; 2]]) -> Ends {
    let mut block = Block { z: [[0.0; LANES]; 4], dz: [[0.0; LANES]; 8], d2z: [[0.0; LANES]; 12] };
    let last = offsets.len() - 1;
    for i in 0..LANES {
        [block.z[0][i], block.z[1][i]] = offsets[i.min(last)];
    }
    block.dz[0] = [1.0; LANES];
    block.dz[3] = [1.0; LANES];
    let mut escaped = [false; LANES];
    for stop in &rays.stops {
        let q = &stop.rows;
        let (mut x, mut y) = ([0.0; LANES], [0.0; LANES]);
        for i in 0..LANES {
            let z = [block.z[0][i], block.z[1][i], block.z[2][i], block.z[3][i]];
            x[i] = q[0][0] * z[0] + q[0][1] * z[1] + q[0][2] * z[2] + q[0][3] * z[3];
            y[i] = q[1][0] * z[0] + q[1][1] * z[1] + q[1][2] * z[2] + q[1][3] * z[3];
        }
        let (mut kx, mut ky) = ([0.0; LANES], [0.0; LANES]);
        let (mut h, mut t) = ([[0.0; LANES]; 3], [[0.0; LANES]; 4]);
        match &stop.kick {
            StopKick::Halo(halo) => {
                halo_kick::<ORDER>(halo, stop, [&x, &y], [&mut kx, &mut ky], &mut h, &mut t);
            }
            StopKick::Polynomial(degree, rows) if ORDER == 0 => {
                polynomial_kick(*degree, rows, [&x, &y], [&mut kx, &mut ky]);
            }
            StopKick::Polynomial(degree, rows) => {
                polynomial_kick(*degree, rows, [&x, &y], [&mut kx, &mut ky]);
                for i in 0..LANES {
                    let (hi, ti) = polynomial_derivatives(*degree, rows, x[i], y[i]);
                    for c in 0..3 {
                        h[c][i] = hi[c];
                    }
                    for c in 0..4 {
                        t[c][i] = ti[c];
                    }
                }
            }
            StopKick::Lens { theta_arcsec, spread_arcsec } => {
                for i in 0..offsets.len() {
                    let at = [theta_arcsec[0] + x[i], theta_arcsec[1] + y[i]];
                    let k = rays.way.lens_kick(at);
                    [kx[i], ky[i]] = [k[0] - stop.kick_ref[0], k[1] - stop.kick_ref[1]];
                    // Not a number escapes, too.
                    escaped[i] |= !(kx[i].hypot(ky[i]) <= *spread_arcsec);
                    if let (true, Some((_, f, lens))) = (ORDER >= 1, rays.way.lens) {
                        let (hi, ti) = (lens.hessian(at[0], at[1]), lens.third_derivatives(at[0], at[1]));
                        for c in 0..3 {
                            h[c][i] = f * hi[c];
                        }
                        for c in 0..4 {
                            t[c][i] = f * ti[c];
                        }
                    }
                }
            }
        }
        block.kick::<ORDER>(stop, [&kx, &ky], &h, &t);
    }
    block.ends::<ORDER>(rays, escaped)
}

impl Block {
    /// z ← z + w Ω Qᵀ K; likewise for the derivatives, ∂K = H ∂ϑ and ∂²K = H ∂²ϑ + T(∂ϑ, ∂ϑ).
    #[inline(always)]
    fn kick<const ORDER: usize>(&mut self, stop: &Stop, k: [&Lanes; 2], h: &[Lanes; 3], t: &[Lanes; 4]) {
        let (q, w) = (&stop.rows, stop.w);
        let p: Rows = [q[0].map(|q| w * q), q[1].map(|q| w * q)];
        for i in 0..LANES {
            let (kx, ky) = (k[0][i], k[1][i]);
            self.z[0][i] -= p[0][2] * kx + p[1][2] * ky;
            self.z[1][i] -= p[0][3] * kx + p[1][3] * ky;
            self.z[2][i] += p[0][0] * kx + p[1][0] * ky;
            self.z[3][i] += p[0][1] * kx + p[1][1] * ky;
        }
        if ORDER == 0 {
            return;
        }
        for i in 0..LANES {
            let theta = |d: &[Lanes], columns: usize, j: usize| -> [f64; 2] {
                [0, 1].map(|c| (0..4).map(|n| q[c][n] * d[n * columns + j][i]).sum::<f64>())
            };
            let d = [theta(&self.dz, 2, 0), theta(&self.dz, 2, 1)];
            let push = |d: &mut [Lanes], columns: usize, j: usize, k: [f64; 2]| {
                for n in 0..2 {
                    d[n * columns + j][i] -= p[0][n + 2] * k[0] + p[1][n + 2] * k[1];
                    d[(n + 2) * columns + j][i] += p[0][n] * k[0] + p[1][n] * k[1];
                }
            };
            let linear = |v: [f64; 2]| [h[0][i] * v[0] + h[1][i] * v[1], h[1][i] * v[0] + h[2][i] * v[1]];
            if ORDER >= 2 {
                for (n, (j, k)) in PAIRS.into_iter().enumerate() {
                    let (xx, xy, yy) =
                        (d[j][0] * d[k][0], d[j][0] * d[k][1] + d[j][1] * d[k][0], d[j][1] * d[k][1]);
                    let h2 = linear(theta(&self.d2z, 3, n));
                    let quadratic = |c: usize| t[c][i] * xx + t[c + 1][i] * xy + t[c + 2][i] * yy;
                    push(&mut self.d2z, 3, n, [h2[0] + quadratic(0), h2[1] + quadratic(1)]);
                }
            }
            push(&mut self.dz, 2, 0, linear(d[0]));
            push(&mut self.dz, 2, 1, linear(d[1]));
        }
    }

    #[inline(always)]
    fn ends<const ORDER: usize>(&self, rays: &Rays, escaped: [bool; LANES]) -> Ends {
        let mut ends =
            Ends { beta: [[0.0; LANES]; 2], jacobian: [[0.0; LANES]; 4], second: [[0.0; LANES]; 6], escaped };
        for c in 0..2 {
            let q = &rays.end_rows[c];
            for i in 0..LANES {
                ends.beta[c][i] = rays.beta_ref[c] + (0..4).map(|n| q[n] * self.z[n][i]).sum::<f64>();
                if ORDER >= 1 {
                    for j in 0..2 {
                        ends.jacobian[2 * c + j][i] =
                            (0..4).map(|n| q[n] * self.dz[2 * n + j][i]).sum::<f64>();
                    }
                }
                if ORDER >= 2 {
                    for j in 0..3 {
                        ends.second[3 * c + j][i] =
                            (0..4).map(|n| q[n] * self.d2z[3 * n + j][i]).sum::<f64>();
                    }
                }
            }
        }
        ends
    }
}

#[inline(always)]
fn halo_kick<const ORDER: usize>(
    halo: &Halo,
    stop: &Stop,
    [x, y]: [&Lanes; 2],
    [kx, ky]: [&mut Lanes; 2],
    h: &mut [Lanes; 3],
    t: &mut [Lanes; 4],
) {
    let (mut tx, mut ty, mut u) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    for i in 0..LANES {
        tx[i] = halo.t_arcsec[0] + x[i];
        ty[i] = halo.t_arcsec[1] + y[i];
        u[i] =
            ((tx[i] * tx[i] + ty[i] * ty[i]) * halo.inv_r_s2).max(crate::profile::mass::nfw_radial::U_FLOOR);
    }
    let (mut m, mut p1, mut p2) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    radial_functions::<ORDER, LANES>(halo.tau, &u, &mut m, &mut p1, &mut p2);
    for i in 0..LANES {
        let km = halo.fk * m[i];
        kx[i] = km * tx[i] - stop.kick_ref[0] - stop.linear[0] * x[i] - stop.linear[1] * y[i];
        ky[i] = km * ty[i] - stop.kick_ref[1] - stop.linear[1] * x[i] - stop.linear[2] * y[i];
    }
    if ORDER >= 1 {
        for i in 0..LANES {
            let inv_r = (halo.inv_r_s2 / u[i]).sqrt();
            let n = [tx[i] * inv_r, ty[i] * inv_r];
            let radial = RadialDerivatives { k: halo.fk, m: m[i], p1: p1[i], p2: p2[i] };
            let full = radial.hessian(n);
            for c in 0..3 {
                h[c][i] = full[c] - stop.linear[c];
            }
            if ORDER >= 2 {
                [t[0][i], t[1][i], t[2][i], t[3][i]] = radial.third_derivatives(n, inv_r);
            }
        }
    }
}

/// Horner's rule in x inside Horner's rule in y.
#[inline(always)]
fn polynomial_kick(degree: usize, rows: &[[f64; 2]], [x, y]: [&Lanes; 2], [kx, ky]: [&mut Lanes; 2]) {
    let mut end = rows.len();
    for j in (0..=degree).rev() {
        let row = &rows[end - (degree + 1 - j)..end];
        end -= row.len();
        let (mut px, mut py) = ([row[degree - j][0]; LANES], [row[degree - j][1]; LANES]);
        for c in row[..degree - j].iter().rev() {
            for i in 0..LANES {
                px[i] = px[i] * x[i] + c[0];
                py[i] = py[i] * x[i] + c[1];
            }
        }
        for i in 0..LANES {
            kx[i] = kx[i] * y[i] + px[i];
            ky[i] = ky[i] * y[i] + py[i];
        }
    }
}

/// Hessian (xx, xy, yy) and third derivatives (xxx, xxy, xyy, yyy) of a polynomial kick.
fn polynomial_derivatives(degree: usize, rows: &[[f64; 2]], x: f64, y: f64) -> ([f64; 3], [f64; 4]) {
    // Value and derivatives (1, x, xx) of a row; (1, y, yy, x, xy, xx) of the whole.
    let mut sums = [[0.0; 2]; 6];
    let mut end = rows.len();
    for j in (0..=degree).rev() {
        let row = &rows[end - (degree + 1 - j)..end];
        end -= row.len();
        for c in 0..2 {
            let (mut p, mut p1, mut p2) = (0.0, 0.0, 0.0);
            for coefficient in row.iter().rev() {
                p2 = p2 * x + 2.0 * p1;
                p1 = p1 * x + p;
                p = p * x + coefficient[c];
            }
            sums[2][c] = sums[2][c] * y + 2.0 * sums[1][c];
            sums[1][c] = sums[1][c] * y + sums[0][c];
            sums[0][c] = sums[0][c] * y + p;
            sums[4][c] = sums[4][c] * y + sums[3][c];
            sums[3][c] = sums[3][c] * y + p1;
            sums[5][c] = sums[5][c] * y + p2;
        }
    }
    let [_, dy, dyy, dx, dxy, dxx] = sums;
    ([dx[0], dx[1], dy[1]], [dxx[0], dxx[1], dxy[1], dyy[1]])
}

#[allow(unsafe_code, reason = "the dispatcher that `multiversion` generates")]
#[multiversion(targets("x86_64+avx512f+avx512dq", "x86_64+avx2", "aarch64+neon"))]
fn positions(rays: &Rays, offsets: &[[f64; 2]]) -> Ends {
    trace::<0>(rays, offsets)
}

#[allow(unsafe_code, reason = "the dispatcher that `multiversion` generates")]
#[multiversion(targets("x86_64+avx512f+avx512dq", "x86_64+avx2", "aarch64+neon"))]
fn jacobians(rays: &Rays, offsets: &[[f64; 2]]) -> Ends {
    trace::<1>(rays, offsets)
}

#[allow(unsafe_code, reason = "the dispatcher that `multiversion` generates")]
#[multiversion(targets("x86_64+avx512f+avx512dq", "x86_64+avx2", "aarch64+neon"))]
fn second_derivatives(rays: &Rays, offsets: &[[f64; 2]]) -> Ends {
    trace::<2>(rays, offsets)
}
