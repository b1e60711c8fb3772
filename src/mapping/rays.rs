//! Rays of fixed directions in SIMD lanes, with what haloes make of them: where a fit evaluates its mapping.

use super::RayBundle;
use super::multiplane::RaysAtPlane;
use crate::numerics::complex::Cx;
use crate::numerics::real::{LANES, Lanes};

type C = Cx<Lanes>;

/// Directions of rays in columns that are filled up to whole lanes with the last ray.
#[derive(Debug, Clone)]
pub(crate) struct Rays {
    count: usize,
    x_arcsec: Vec<f64>,
    y_arcsec: Vec<f64>,
    /// Where the line of sight is made of haloes: what these do to the rays.
    pub haloes: Option<HaloExpansion>,
}

impl Rays {
    pub fn new(theta_arcsec: &[[f64; 2]]) -> Self {
        let [x_arcsec, y_arcsec] = [0, 1].map(|c| column(theta_arcsec, |theta| theta[c]));
        Self { count: theta_arcsec.len(), x_arcsec, y_arcsec, haloes: None }
    }

    /// Number of rays.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Number of rays with those that fill the last lanes.
    pub fn padded(&self) -> usize {
        self.x_arcsec.len()
    }

    /// Where each block of [`LANES`] rays starts.
    pub fn blocks(&self) -> impl Iterator<Item = usize> + use<> {
        (0..self.padded()).step_by(LANES)
    }

    /// The directions, without filling.
    pub fn theta_arcsec(&self) -> Vec<[f64; 2]> {
        (0..self.count).map(|i| [self.x_arcsec[i], self.y_arcsec[i]]).collect()
    }

    /// The directions of the block that starts there, as x + iy.
    #[inline(always)]
    pub fn block(&self, start: usize) -> C {
        load(&[&self.x_arcsec, &self.y_arcsec], start)
    }
}

/// Rays through a given set of haloes as functions of what the main lens does to them.
///
/// In front of the lens the haloes carry ray i to the point t_i of the lens plane, whatever the lens. Behind it
/// β_i = B_i(α), α the deflection at the lens: a function of two numbers, expanded to second order about α_i⁰:
/// β_i = B⁰ + B′(α − α⁰) + ½(α − α⁰)ᵀB″(α − α⁰).
#[derive(Debug, Clone)]
pub(crate) struct HaloExpansion {
    /// t and α⁰ in arcsec.
    at_lens: [Vec<f64>; 2],
    deflection: [Vec<f64>; 2],
    /// B⁰; ∂B_i/∂α_j as (xx, xy, yx, yy); ∂²B_i/∂α_j∂α_k as (xxx, xxy, xyy, yxx, yxy, yyy).
    beta: [Vec<f64>; 2],
    first: [Vec<f64>; 4],
    second: [Vec<f64>; 6],
    /// The rays in the lens plane, to be expanded again.
    pub foreground: RaysAtPlane,
}

impl HaloExpansion {
    /// From points `at_lens`, deflections there and β with its derivatives by them, one of each a ray.
    pub fn new(
        foreground: RaysAtPlane,
        at_lens: &[[f64; 2]],
        deflection: &[[f64; 2]],
        behind: &RayBundle,
    ) -> Self {
        Self {
            foreground,
            at_lens: [0, 1].map(|c| column(at_lens, |t| t[c])),
            deflection: [0, 1].map(|c| column(deflection, |alpha| alpha[c])),
            beta: [0, 1].map(|c| column(&behind.beta_arcsec, |beta| beta[c])),
            first: [0, 1, 2, 3].map(|c| column(&behind.jacobian, |first| first[c])),
            second: [0, 1, 2, 3, 4, 5].map(|c| column(&behind.second_per_arcsec, |second| second[c])),
        }
    }

    /// t of every ray.
    pub fn at_lens_arcsec(&self) -> Vec<[f64; 2]> {
        let [x, y] = &self.at_lens;
        (0..self.foreground.x_cmpc_arcsec.len()).map(|i| [x[i], y[i]]).collect()
    }

    /// β at deflections of one a ray.
    pub fn beta_arcsec(&self, deflection: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let alpha = [0, 1].map(|c| column(deflection, |alpha| alpha[c]));
        let blocks = (0..alpha[0].len()).step_by(LANES).flat_map(|start| {
            let (block, alpha) = (self.block(start), load(&[&alpha[0], &alpha[1]], start));
            (0..LANES).map(move |i| block.beta(i, alpha.lane(i))).map(|beta| [beta.re, beta.im])
        });
        blocks.take(deflection.len()).collect()
    }

    #[inline(always)]
    pub fn block(&self, start: usize) -> HaloBlock {
        HaloBlock {
            at_lens: load(&[&self.at_lens[0], &self.at_lens[1]], start),
            deflection: load(&[&self.deflection[0], &self.deflection[1]], start),
            beta: load(&[&self.beta[0], &self.beta[1]], start),
            first: [0, 1, 2, 3].map(|c| Lanes::load(&self.first[c], start)),
            second: [0, 1, 2, 3, 4, 5].map(|c| Lanes::load(&self.second[c], start)),
        }
    }
}

/// [`LANES`] rays of a [`HaloExpansion`].
pub(crate) struct HaloBlock {
    /// t.
    pub at_lens: C,
    deflection: C,
    beta: C,
    first: [Lanes; 4],
    second: [Lanes; 6],
}

impl HaloBlock {
    /// B(α) of ray `i`.
    #[inline(always)]
    pub fn beta(&self, i: usize, alpha: Cx<f64>) -> Cx<f64> {
        let d = alpha - self.deflection.lane(i);
        let [xx, xy, yx, yy] = self.slopes(i, d * 0.5);
        self.beta.lane(i) + Cx::new(xx * d.re + xy * d.im, yx * d.re + yy * d.im)
    }

    /// What a change of α does to B of ray `i`: the factors of dα and of dᾱ.
    #[inline(always)]
    pub fn along(&self, i: usize, alpha: Cx<f64>) -> [Cx<f64>; 2] {
        let [xx, xy, yx, yy] = self.slopes(i, alpha - self.deflection.lane(i));
        [Cx::new(xx + yy, yx - xy) * 0.5, Cx::new(xx - yy, yx + xy) * 0.5]
    }

    /// B′_ij + Σ_k B″_ijk d_k.
    #[inline(always)]
    fn slopes(&self, i: usize, d: Cx<f64>) -> [f64; 4] {
        let (a, b) = (&self.first, &self.second);
        [
            a[0].0[i] + b[0].0[i] * d.re + b[1].0[i] * d.im,
            a[1].0[i] + b[1].0[i] * d.re + b[2].0[i] * d.im,
            a[2].0[i] + b[3].0[i] * d.re + b[4].0[i] * d.im,
            a[3].0[i] + b[4].0[i] * d.re + b[5].0[i] * d.im,
        ]
    }
}

#[inline(always)]
fn load(columns: &[&Vec<f64>; 2], start: usize) -> C {
    Cx::new(Lanes::load(columns[0], start), Lanes::load(columns[1], start))
}

/// One number a ray, filled up to whole lanes with the last.
fn column<T>(rays: &[T], number: impl Fn(&T) -> f64) -> Vec<f64> {
    let mut column: Vec<f64> = rays.iter().map(number).collect();
    let last = column.last().copied().unwrap_or(0.0);
    column.resize(column.len().next_multiple_of(LANES), last);
    column
}
