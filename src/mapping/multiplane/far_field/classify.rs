//! Which haloes are smooth across a field: those that a polynomial of given degree follows within the budget.

use rayon::prelude::*;

use crate::mapping::multiplane::plane::Plane;

/// Where the central ray of the field meets each plane, arcsec: one scalar trace through all planes.
pub(super) fn central_ray(
    planes: &[Plane],
    chi_start: f64,
    x_start: [f64; 2],
    slope: [f64; 2],
) -> Vec<[f64; 2]> {
    let (mut chi, mut x, mut s) = (chi_start, x_start, slope);
    planes
        .iter()
        .map(|plane| {
            let step = plane.chi_cmpc - chi;
            chi = plane.chi_cmpc;
            x = [x[0] + step * s[0], x[1] + step * s[1]];
            let theta = x.map(|x| x * plane.inv_chi);
            let t = [theta[0] - plane.centre_arcsec[0], theta[1] - plane.centre_arcsec[1]];
            let km = plane.fk * plane.radial(plane.u(t[0], t[1]))[0];
            for c in 0..2 {
                s[c] -= km * t[c] - plane.f_sheet * theta[c];
            }
            theta
        })
        .collect()
}

/// What a halo needs to be weighed: its distance from the central ray and the strength of its kick there.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reach {
    /// Distance of the centre from the central ray, arcsec.
    pub distance_arcsec: f64,
    /// Its deflection of the central ray, as it shifts the end of the ray, arcsec.
    shift_arcsec: f64,
}

/// Distances and kicks of all haloes.
pub(super) fn reaches(planes: &[Plane], central: &[[f64; 2]], chi_start: f64, chi_end: f64) -> Vec<Reach> {
    let reach = |(plane, theta): (&Plane, &[f64; 2])| {
        let t = [theta[0] - plane.centre_arcsec[0], theta[1] - plane.centre_arcsec[1]];
        let distance_arcsec = t[0].hypot(t[1]);
        let m = plane.radial(plane.u(t[0], t[1]))[0];
        let lever = (chi_end - plane.chi_cmpc) / (chi_end - chi_start);
        Reach { distance_arcsec, shift_arcsec: lever * plane.fk.abs() * m * distance_arcsec }
    };
    planes.par_iter().zip(central).map(reach).collect()
}

/// Nearer than this many field radii nothing is smooth: the expansion would converge too slowly.
const NEAREST: f64 = 1.25;

/// What a polynomial of total degree `degree` leaves of each halo across a disc of `radius_arcsec`:
/// 2|α|ρ^−(degree+1)/(1 − 1/ρ), ρ = D/R + √(D²/R² − 1) (Bernstein: the nearest singularity is the halo's centre).
pub(super) fn remainders(reaches: &[Reach], radius_arcsec: f64, degree: usize) -> Vec<f64> {
    let remainder = |reach: &Reach| {
        let ratio = reach.distance_arcsec / radius_arcsec;
        if ratio < NEAREST || !ratio.is_finite() {
            return f64::INFINITY;
        }
        let rho = ratio + (ratio * ratio - 1.0).sqrt();
        2.0 * reach.shift_arcsec * rho.powi(-(degree as i32 + 1)) / (1.0 - 1.0 / rho)
    };
    reaches.par_iter().map(remainder).collect()
}

/// The largest power of ½ at or below which all remainders together stay within `budget_arcsec`.
pub(super) fn threshold(remainders: &[f64], budget_arcsec: f64) -> f64 {
    /// Powers of ½ told apart, from 1 down.
    const BINS: usize = 200;
    let mut sums = [0.0; BINS];
    for &r in remainders {
        if r.is_finite() && r > 0.0 && r < 1.0 {
            sums[((-r.log2()) as usize).min(BINS - 1)] += r;
        }
    }
    let mut total = 0.0;
    for bin in (0..BINS).rev() {
        total += sums[bin];
        if total > budget_arcsec {
            return 0.5_f64.powi(bin as i32 + 1);
        }
    }
    1.0
}
