//! Maps of κ, γ1, γ2, ω, F, G and Δ of any mapping on a grid.

use serde::{Deserialize, Serialize};

use super::distortion::Distortion;
use crate::error::Result;
use crate::mapping::{Mapping, Order};
use crate::monitor::Monitor;

/// A square grid of directions centred on the axis: `points`² nodes out to ±`half_width_arcsec`, both ends included.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MapGrid {
    /// Nodes a side.
    pub points: usize,
    /// Largest |θ_x| and |θ_y|, arcsec.
    pub half_width_arcsec: f64,
}

impl MapGrid {
    /// Distance between nodes in arcsec.
    pub fn step_arcsec(&self) -> f64 {
        2.0 * self.half_width_arcsec / (self.points.max(2) - 1) as f64
    }

    /// Directions row by row from the bottom left, x fastest.
    pub fn theta_arcsec(&self) -> Vec<[f64; 2]> {
        let at = |i: usize| -self.half_width_arcsec + self.step_arcsec() * i as f64;
        (0..self.points * self.points).map(|k| [at(k % self.points), at(k / self.points)]).collect()
    }
}

/// Distortions of a mapping on a grid, each map row-major (y, x).
#[derive(Debug, Clone, PartialEq)]
pub struct TidalMaps {
    /// The grid.
    pub grid: MapGrid,
    /// Distortion of the axis ray, with which Δ compares.
    pub on_axis: Distortion,
    /// Convergence.
    pub kappa: Vec<f64>,
    /// Shear, first component.
    pub gamma1: Vec<f64>,
    /// Shear, second component.
    pub gamma2: Vec<f64>,
    /// Rotation.
    pub omega: Vec<f64>,
    /// Modulus of the F-type flexion per arcsec.
    pub f_per_arcsec: Vec<f64>,
    /// Modulus of the G-type flexion per arcsec.
    pub g_per_arcsec: Vec<f64>,
    /// |γ(θ) − γ(0)|/|γ(0)|, whose squares at θ_E x̂ and θ_E ŷ add up to Δ².
    pub delta: Vec<f64>,
}

impl TidalMaps {
    /// Traces the grid with second derivatives.
    ///
    /// # Errors
    /// When `monitor`, which is told of every ray of the grid, cancels.
    pub fn of(mapping: &impl Mapping, grid: MapGrid, monitor: &dyn Monitor) -> Result<Self> {
        let rays = mapping.trace(&grid.theta_arcsec(), Order::SecondDerivatives, monitor)?;
        let nodes = Distortion::of_bundle(&rays);
        let on_axis = Distortion::on_axis(mapping);
        let axis = on_axis.tidal.gamma;
        let map = |value: &dyn Fn(&Distortion) -> f64| nodes.iter().map(value).collect();
        Ok(Self {
            grid,
            on_axis,
            kappa: map(&|d| d.tidal.kappa),
            gamma1: map(&|d| d.tidal.gamma.re),
            gamma2: map(&|d| d.tidal.gamma.im),
            omega: map(&|d| d.tidal.omega),
            f_per_arcsec: map(&|d| d.f_per_arcsec.norm()),
            g_per_arcsec: map(&|d| d.g_per_arcsec.norm()),
            delta: map(&|d| (d.tidal.gamma - axis).norm() / axis.norm()),
        })
    }

    /// Names of the maps, their units and what they are.
    pub const NAMES: [(&str, &str, &str); 7] = [
        ("kappa", "", "convergence"),
        ("gamma1", "", "shear, first component"),
        ("gamma2", "", "shear, second component"),
        ("omega", "", "rotation"),
        ("abs_f", "arcsec^-1", "modulus of the F-type flexion"),
        ("abs_g", "arcsec^-1", "modulus of the G-type flexion"),
        ("delta", "", "|γ(θ) − γ(0)|/|γ(0)|"),
    ];

    /// Every map with its name and unit, as files and figures list them.
    pub fn columns(&self) -> [(&'static str, &'static str, &[f64]); 7] {
        let maps = [
            &self.kappa,
            &self.gamma1,
            &self.gamma2,
            &self.omega,
            &self.f_per_arcsec,
            &self.g_per_arcsec,
            &self.delta,
        ];
        std::array::from_fn(|i| (Self::NAMES[i].0, Self::NAMES[i].1, maps[i].as_slice()))
    }
}
