//! A bundle of rays about a central ray: how it descends from a wider one, and the bound on its error.
//!
//! A ray is z = (a, b) about the central ray; nothing but a kick changes it. In a narrower bundle z = z_ref + M z′,
//! where M holds the linear part of every halo that is smooth across the bundle; what is left of those haloes is
//! merged into few polynomial kicks. All other haloes stay. docs/ADAPTIVE_TRACING.md derives every bound used here.

use std::borrow::Borrow;

use rayon::prelude::*;

use super::event::{Basis, Event, Halo, IDENTITY, Kick, Rows, Way, apply, kick, product};
use super::polynomial::Polynomial;
use super::taylor::{DEGREE_MAX, Expansion, lowest_degree};
use crate::profile::mass::{MassProfile, nfw_radial};

/// What a bundle may add to the error of β, arcsec.
#[derive(Debug, Clone, Copy)]
pub(super) struct Budget {
    /// By truncating expansions of single haloes.
    pub truncation_arcsec: f64,
    /// By merging kicks.
    pub merging_arcsec: f64,
    /// Errors below this count as if they were as large.
    pub floor_arcsec: f64,
    /// True when what merging costs is measured and taken back; else its estimate counts as an error.
    pub corrected: bool,
}

/// A narrow set of rays and what it meets, in order of distance.
pub(super) struct Bundle {
    pub events: Vec<Event>,
    /// β of the central ray and its rows.
    pub beta_ref: [f64; 2],
    pub end_rows: Rows,
    /// Bound of |β − β_exact| over the bundle, arcsec.
    pub bound_arcsec: f64,
    /// By how much errors grow on the way.
    pub gain: f64,
}

/// Smooth haloes carry a deviation at most this much farther than empty space does.
const PROPAGATION: f64 = 1.1;

/// Below this ratio of bundle radius to distance the Hessian of a kept halo goes into the rows.
const OUTSIDE: f64 = 0.5;

/// A smooth halo or polynomial on its way into a cell.
struct Absorbed {
    cell: usize,
    chi: f64,
    nonlinear: Nonlinear,
}

enum Nonlinear {
    Halo(Expansion),
    Polynomial(Box<Polynomial>),
}

/// Where merged kicks act.
struct Border {
    chi: f64,
    rows: Rows,
    lipschitz: f64,
    error: f64,
    polynomial: Polynomial,
}

impl Border {
    fn at(chi: f64, rows: Rows) -> Self {
        Self { chi, rows, lipschitz: 0.0, error: 0.0, polynomial: Polynomial::default() }
    }
}

/// The state of a descent.
struct Descent<'a> {
    way: &'a Way<'a>,
    budget: Budget,
    radius: f64,
    z: [f64; 4],
    basis: Basis,
    chi: f64,
    /// Majorants of what near haloes and curvature add to the linear bundle: position (Mpc·arcsec) and slope.
    deviation: f64,
    deviation_slope: f64,
    near: Vec<Event>,
    absorbed: Vec<Absorbed>,
    borders: Vec<Border>,
    cell: Cell,
    /// Σ χ H A over what was absorbed: how the linear bundle bends.
    bend: [f64; 4],
    last: (f64, Rows),
}

/// Signed sums over the open cell, to judge its depth.
#[derive(Default, Clone, Copy)]
struct Cell {
    /// Σ of the quadratic coefficients, up to their law of distance.
    flexion: [f64; 4],
    /// Σ H A of the linear parts, and Σ of the squares of near kicks.
    slope: [f64; 4],
    near: f64,
}

/// Part of the largest possible deviation that is expected.
const DEVIATION_SHARE: f64 = 0.3;

impl Cell {
    fn and(&self, other: &Self) -> Self {
        let sum = |a: [f64; 4], b: [f64; 4]| [0, 1, 2, 3].map(|i| a[i] + b[i]);
        Self {
            flexion: sum(self.flexion, other.flexion),
            slope: sum(self.slope, other.slope),
            near: self.near + other.near,
        }
    }
}

/// The largest stretch by the 2×2 matrix (a b; c d).
fn norm([a, b, c, d]: [f64; 4]) -> f64 {
    let root = |x: f64, y: f64| (x * x + y * y).sqrt();
    0.5 * (root(a + d, b - c) + root(a - d, b + c))
}

impl Bundle {
    /// The bundle of radius `radius_arcsec` about the ray `offset_arcsec` from the central ray of `events`.
    ///
    /// `beta_ref` and `end_rows` are those of the wider bundle, `number` is that of its events.
    #[allow(clippy::too_many_arguments, reason = "the wider bundle comes as an iterator beside its ends")]
    pub fn descend<E: Borrow<Event>>(
        way: &Way,
        events: impl Iterator<Item = E>,
        number: usize,
        beta_ref: [f64; 2],
        end_rows: &Rows,
        offset_arcsec: [f64; 2],
        radius_arcsec: f64,
        budget: Budget,
    ) -> Self {
        let mut descent = Descent {
            way,
            budget,
            radius: radius_arcsec,
            z: [offset_arcsec[0], offset_arcsec[1], 0.0, 0.0],
            basis: IDENTITY,
            chi: way.chi_start,
            deviation: 0.0,
            deviation_slope: 0.0,
            near: Vec::new(),
            absorbed: Vec::new(),
            borders: Vec::new(),
            cell: Cell::default(),
            bend: [0.0; 4],
            last: (0.0, [[0.0; 4]; 2]),
        };
        let tolerance = budget.truncation_arcsec / (number.max(1) as f64);
        let t0 = std::time::Instant::now();
        for event in events {
            descent.meet(event.borrow(), tolerance);
        }
        let t1 = t0.elapsed();
        let r = descent.finish(beta_ref, end_rows);
        if std::env::var("FARDBG").is_ok() {
            eprintln!("  pass {t1:?} finish {:?} of {number}", t0.elapsed() - t1);
        }
        r
    }

    /// Σ of the bounds as they reach the end, each grown by the Lipschitz constants behind it (discrete Grönwall).
    fn bound(&mut self, way: &Way, floor: f64) {
        let (mut position, mut slope, mut chi) = (0.0, 0.0, way.chi_start);
        let mut plain = 0.0;
        for event in &self.events {
            position += (event.chi - chi) * slope;
            chi = event.chi;
            let error = (PROPAGATION * position / chi).max(if slope > 0.0 { floor } else { 0.0 });
            slope += event.error + event.lipschitz * error;
            plain += event.error * way.lever(chi);
        }
        position += (way.chi_end - chi) * slope;
        self.bound_arcsec = PROPAGATION * position / way.length();
        self.gain = if plain > 0.0 { self.bound_arcsec / plain } else { 1.0 };
        if !(self.bound_arcsec >= 0.0) {
            self.bound_arcsec = f64::INFINITY;
        }
    }
}

impl Descent<'_> {
    /// How far rays of the bundle meet `rows` from the central ray.
    fn radius_at(&self, rows: &Rows, chi: f64) -> f64 {
        let [[xx, xy, ..], [yx, yy, ..]] = *rows;
        self.radius * norm([xx, xy, yx, yy]) + PROPAGATION * self.deviation / chi
    }

    fn meet(&mut self, event: &Event, tolerance: f64) {
        self.deviation += (event.chi - self.chi) * self.deviation_slope;
        self.chi = event.chi;
        let rows = product(&event.rows, &self.basis);
        let radius = self.radius_at(&rows, event.chi);
        let w = event.chi / self.way.length();
        let theta = apply(&event.rows, &self.z);
        let tolerance = tolerance / self.way.lever(event.chi);
        let mut hessian = event.linear.map(|h| -h);
        let held = event.linear;
        let mut push = [
            -event.kick_ref[0] - held[0] * theta[0] - held[1] * theta[1],
            -event.kick_ref[1] - held[1] * theta[0] - held[2] * theta[1],
        ];
        // Coefficients C_20 and C_02, and the size of all curvature.
        let mut quadratic = [0.0; 4];
        let (mut flexion, mut error) = (0.0, event.error);
        let mut nonlinear = None;
        let mut near_kick = 0.0;
        if let Some((f_sheet, at)) = event.sheet {
            hessian = [hessian[0] - f_sheet, hessian[1], hessian[2] - f_sheet];
            push = [0, 1].map(|c| push[c] - f_sheet * (at[c] + theta[c]));
        }
        match &event.kick {
            Kick::Halo(halo) => {
                let t = [halo.t_arcsec[0] + theta[0], halo.t_arcsec[1] + theta[1]];
                let (u, m, p1) = halo.radial(t);
                let k = t.map(|t| halo.fk * m * t);
                push = [push[0] + k[0], push[1] + k[1]];
                let (fk, d) = (halo.fk.abs(), t[0].hypot(t[1]));
                let x = radius / d;
                let degree = if halo.tau.is_finite() || u <= nfw_radial::U_FLOOR {
                    None
                } else {
                    lowest_degree(fk * m * d, x, tolerance)
                };
                let n = t.map(|t| t / d);
                let (tangential, radial) = (halo.fk * m, 2.0 * halo.fk * p1);
                let at_ray = [
                    tangential + radial * n[0] * n[0],
                    radial * n[0] * n[1],
                    tangential + radial * n[1] * n[1],
                ];
                if x < OUTSIDE {
                    for (sum, h) in hessian.iter_mut().zip(at_ray) {
                        *sum += h;
                    }
                }
                let steepest = 3.0 * fk * m / ((1.0 - x).powi(3) * d);
                if let Some((degree, remainder)) = degree {
                    error += remainder;
                    if degree > 1 {
                        flexion = steepest;
                        // In the direction of the halo; the rest is of the same size.
                        let along = 0.5 * halo.fk * m / d;
                        let thrice = [n[0] * (1.0 - 4.0 * n[1] * n[1]), n[1] * (4.0 * n[0] * n[0] - 1.0)];
                        quadratic = [along * n[0], along * n[1], along * thrice[0], along * thrice[1]];
                        let expansion = Expansion { t_arcsec: t, fk: halo.fk, u, m, degree };
                        nonlinear = Some(Nonlinear::Halo(expansion));
                    }
                } else {
                    let nearest = (d - radius).max(0.0);
                    let reach = |gap: f64| {
                        let r = nearest.max(0.5 * gap);
                        fk * nfw_radial::m((r * r * halo.inv_r_s2).max(nfw_radial::U_FLOOR))
                    };
                    let held = if x < OUTSIDE { at_ray } else { [0.0; 3] };
                    near_kick =
                        if x < OUTSIDE { 0.5 * steepest * radius * radius } else { reach(radius) * radius };
                    self.near.push(Event {
                        rows,
                        kick_ref: k,
                        linear: held,
                        lipschitz: reach(self.budget.floor_arcsec),
                        ..Event::new(event.chi, Kick::Halo(Halo { t_arcsec: t, ..*halo }))
                    });
                }
            }
            Kick::Polynomial(polynomial) => {
                let mut shifted = polynomial.shifted(theta);
                let (k, h) = shifted.take_linear();
                push = [push[0] + k[0], push[1] + k[1]];
                for (sum, h) in hessian.iter_mut().zip(h) {
                    *sum += h;
                }
                let sizes = shifted.sizes(radius);
                error += shifted.truncate(&sizes, 0.1 * tolerance);
                if shifted.degree > 1 && radius > 0.0 {
                    let steep = (2..=shifted.degree).map(|n| (n * (n - 1)) as f64 * sizes[n]).sum::<f64>();
                    flexion = steep / (radius * radius);
                    let [[a, b], _, [c, d]] = [shifted.terms[3], shifted.terms[4], shifted.terms[5]];
                    quadratic = [a, b, c, d];
                    nonlinear = Some(Nonlinear::Polynomial(Box::new(shifted)));
                }
            }
            Kick::Lens { theta_arcsec, spread_arcsec } => {
                let at = [theta_arcsec[0] + theta[0], theta_arcsec[1] + theta[1]];
                let k = self.way.lens_kick(at);
                push = [push[0] + k[0], push[1] + k[1]];
                let (lipschitz, widest) = self.lens_bounds(at, radius);
                let allowed = spread_arcsec - push[0].hypot(push[1]);
                near_kick = if spread_arcsec.is_finite() { widest.min(allowed).max(0.0) } else { widest };
                let lens = Kick::Lens { theta_arcsec: at, spread_arcsec: near_kick };
                self.near.push(Event { rows, kick_ref: k, lipschitz, ..Event::new(event.chi, lens) });
            }
        }
        // H times the columns of Q M.
        let linear = |j: usize| {
            let (x, y) = (rows[0][j], rows[1][j]);
            [hessian[0] * x + hessian[1] * y, hessian[1] * x + hessian[2] * y]
        };
        let columns = [0, 1, 2, 3].map(linear);
        let slope = [columns[0][0], columns[1][0], columns[0][1], columns[1][1]];
        self.enter_cell(
            event.chi,
            rows,
            radius,
            &Cell { flexion: quadratic, slope, near: near_kick * near_kick },
        );
        if let Some(border) = self.borders.last_mut() {
            border.lipschitz += flexion * radius;
            border.error += error;
        }
        if let Some(nonlinear) = nonlinear {
            self.absorbed.push(Absorbed { cell: self.borders.len() - 1, chi: event.chi, nonlinear });
        }
        self.deviation_slope += near_kick + 0.5 * flexion * radius * radius;
        for (sum, s) in self.bend.iter_mut().zip(slope) {
            *sum += event.chi * s;
        }
        kick(&event.rows, w, push, &mut self.z);
        for (j, k) in columns.into_iter().enumerate() {
            // M ← M + w Ω Qᵀ H Q M.
            let mut column = [0, 1, 2, 3].map(|i| self.basis[i][j]);
            kick(&event.rows, w, k, &mut column);
            for i in 0..4 {
                self.basis[i][j] = column[i];
            }
        }
    }

    /// Lipschitz constant of the main lens across the bundle, and how far it kicks rays from the central one.
    ///
    /// Far from the centre both follow from the Hessian and its slope; near it, no constant holds and the bundle is
    /// only a station on the way to narrower ones. That no ray is kicked farther is checked ray by ray.
    fn lens_bounds(&self, at: [f64; 2], radius: f64) -> (f64, f64) {
        let Some((_, f, profile)) = self.way.lens else { return (0.0, 0.0) };
        let centre = profile.centre_arcsec();
        let distance = centre.map_or(f64::INFINITY, |centre| (at[0] - centre[0]).hypot(at[1] - centre[1]));
        if radius <= 0.25 * distance {
            let h: f64 = profile.hessian(at[0], at[1]).iter().map(|h| h.abs()).sum();
            let t: f64 = profile.third_derivatives(at[0], at[1]).iter().map(|t| t.abs()).sum();
            let lipschitz = 1.5 * f * (h + t * radius);
            return (lipschitz, lipschitz * radius);
        }
        let [cx, cy] = centre.unwrap_or(at);
        let around = |i: usize| {
            let (sin, cos) = (std::f64::consts::FRAC_PI_4 * i as f64).sin_cos();
            let alpha = profile.deflection(cx + radius * cos, cy + radius * sin);
            alpha[0].hypot(alpha[1])
        };
        (f64::INFINITY, 3.0 * f * (0..8).map(around).fold(0.0, f64::max))
    }

    /// What merging is expected to cost in a cell that reaches to `chi`, as a kick.
    fn cost_of_merging(&self, chi: f64, radius: f64, cell: &Cell) -> f64 {
        let Some(border) = self.borders.last() else { return 0.0 };
        let q = (chi - border.chi) / border.chi;
        // How much the direction of a ray changes over the way: |s′ − x′/χ|.
        let deviation = self.deviation_slope - self.deviation / self.chi;
        let straight = self.radius * self.way.chi_start / self.chi;
        let bend = norm(self.bend) * self.radius / self.chi + straight + DEVIATION_SHARE * deviation;
        let kicks = norm(cell.slope) * self.radius + cell.near.sqrt();
        let flexion = cell.flexion.iter().map(|v| v * v).sum::<f64>().sqrt();
        flexion * radius * (q * kicks + 0.25 * q * q * bend)
    }

    /// Ends the open cell at the event before when it would become too deep with this one.
    fn enter_cell(&mut self, chi: f64, rows: Rows, radius: f64, of_event: &Cell) {
        let mut cell = self.cell.and(of_event);
        if let Some(border) = self.borders.last() {
            let cost = self.cost_of_merging(chi, radius, &cell);
            let rate = self.budget.merging_arcsec / (self.way.length() * self.way.lever(border.chi));
            if !(cost <= rate * (chi - border.chi)) && self.last.0 > border.chi {
                self.close();
                cell = *of_event;
            }
        } else {
            self.borders.push(Border::at(chi, rows));
        }
        self.cell = cell;
        self.last = (chi, rows);
    }

    /// Ends the open cell at the last event.
    fn close(&mut self) {
        let radius = self.radius_at(&self.last.1, self.last.0);
        let cost = self.cost_of_merging(self.last.0, radius, &self.cell);
        if let (false, Some(border)) = (self.budget.corrected, self.borders.last_mut()) {
            border.error += cost;
        }
        self.borders.push(Border::at(self.last.0, self.last.1));
    }

    fn finish(mut self, beta_ref: [f64; 2], end_rows: &Rows) -> Bundle {
        if !self.borders.is_empty() {
            self.close();
        }
        self.merge();
        let (way, budget) = (self.way, self.budget);
        let allowed = 0.1 * budget.truncation_arcsec / (self.borders.len().max(1) as f64);
        let mut events = Vec::with_capacity(self.near.len() + self.borders.len());
        let mut near = self.near.into_iter().peekable();
        for mut border in self.borders {
            while let Some(event) = near.next_if(|event| event.chi < border.chi) {
                events.push(event);
            }
            let radius = self.radius
                * norm([border.rows[0][0], border.rows[0][1], border.rows[1][0], border.rows[1][1]])
                + PROPAGATION * self.deviation / self.chi;
            let sizes = border.polynomial.sizes(radius);
            border.error += border.polynomial.truncate(&sizes, allowed / way.lever(border.chi));
            events.push(Event {
                rows: border.rows,
                lipschitz: border.lipschitz,
                error: border.error,
                ..Event::new(border.chi, Kick::Polynomial(Box::new(border.polynomial)))
            });
        }
        events.extend(near);
        let end = apply(end_rows, &self.z);
        let mut bundle = Bundle {
            events,
            beta_ref: [beta_ref[0] + end[0], beta_ref[1] + end[1]],
            end_rows: product(end_rows, &self.basis),
            bound_arcsec: 0.0,
            gain: 1.0,
        };
        bundle.bound(way, budget.floor_arcsec);
        if std::env::var("FARDBG").is_ok() {
            let near: Vec<&Event> =
                bundle.events.iter().filter(|e| matches!(e.kick, Kick::Halo(_))).collect();
            let polys: Vec<&Event> =
                bundle.events.iter().filter(|e| matches!(e.kick, Kick::Polynomial(_))).collect();
            let deg: f64 = polys
                .iter()
                .map(|e| if let Kick::Polynomial(p) = &e.kick { p.degree as f64 } else { 0.0 })
                .sum();
            let lip: f64 = bundle.events.iter().map(|e| e.lipschitz * way.lever(e.chi)).sum();
            let lipn: f64 = near.iter().map(|e| e.lipschitz * way.lever(e.chi)).sum();
            let err: f64 = bundle.events.iter().map(|e| e.error * way.lever(e.chi)).sum();
            eprintln!(
                "near {} borders {} mean degree {:.1} lipschitz {lip:.3} (near {lipn:.3}) errors {err:.2e} bound {:.2e} gain {:.2} radius end {:.3} dev {:.3}",
                near.len(),
                polys.len(),
                deg / polys.len() as f64,
                bundle.bound_arcsec,
                bundle.gain,
                self.radius,
                self.deviation / self.chi
            );
        }
        bundle
    }

    /// Splits every absorbed kick between the borders of its cell, in proportion to the distances.
    fn merge(&mut self) {
        /// From this many on the cells are shared among threads.
        const MANY: usize = 4096;
        let cells: Vec<&[Absorbed]> = self.absorbed.chunk_by(|a, b| a.cell == b.cell).collect();
        let borders = &self.borders;
        let merged = |cell: &&[Absorbed]| {
            let k = cell[0].cell;
            let (start, depth) = (borders[k].chi, borders[k + 1].chi - borders[k].chi);
            let (mut left, mut right) = (Polynomial::default(), Polynomial::default());
            for absorbed in *cell {
                let weight = if depth > 0.0 { 1.0 - (absorbed.chi - start) / depth } else { 1.0 };
                match &absorbed.nonlinear {
                    Nonlinear::Halo(expansion) => expansion.add_to(weight, &mut left, &mut right),
                    Nonlinear::Polynomial(polynomial) => {
                        left.add(polynomial, weight);
                        right.add(polynomial, 1.0 - weight);
                    }
                }
            }
            (k, left, right)
        };
        let sums: Vec<_> = if self.absorbed.len() < MANY {
            cells.iter().map(merged).collect()
        } else {
            cells.par_iter().map(merged).collect()
        };
        for (k, left, right) in sums {
            self.borders[k].polynomial.add(&left, 1.0);
            self.borders[k + 1].polynomial.add(&right, 1.0);
        }
        for border in &mut self.borders {
            border.polynomial.complete();
            debug_assert!(border.polynomial.degree <= DEGREE_MAX);
        }
    }
}
