//! One sightline of a light cone: where it points and the haloes in its cylinder.

use super::super::catalogue::{HaloCatalogue, HaloMasses};
use super::direction::Direction;
use crate::cosmology::Background;
use crate::error::Result;

/// Name of the column with the row of a halo in its light cone, from 0, counted through all files.
const ROW_COLUMN: &str = "lightcone_row";

/// A halo in front of which a sightline was centred.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LensHalo {
    /// Its row in the light cone, from 0, counted through all files.
    pub row: u64,
    /// Redshift.
    pub z: f64,
    /// Mass.
    pub m200c_msun: f64,
}

/// The haloes of a sightline, by column, in the order of the light cone.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ConeHaloes {
    /// Rows in the light cone, from 0, counted through all files.
    pub row: Vec<u64>,
    /// Redshifts.
    pub z: Vec<f64>,
    /// Positions right of the axis.
    pub theta_x_arcsec: Vec<f64>,
    /// Positions above the axis.
    pub theta_y_arcsec: Vec<f64>,
    /// Masses.
    pub m200c_msun: Vec<f64>,
    /// Concentrations.
    pub c200c: Vec<f64>,
}

/// A sightline and what its cylinder holds.
#[derive(Debug, Clone, PartialEq)]
pub struct ConeSightline {
    /// Its number.
    pub number: u64,
    /// Where it points.
    pub direction: Direction,
    /// The halo that it was centred on, which is none of its haloes; none for a random direction.
    pub lens_halo: Option<LensHalo>,
    /// What its cylinder holds.
    pub haloes: ConeHaloes,
}

impl ConeHaloes {
    /// Bytes that a halo takes.
    pub const BYTES_PER_HALO: u64 = 48;

    /// How many there are.
    pub fn len(&self) -> usize {
        self.z.len()
    }

    /// True without any.
    pub fn is_empty(&self) -> bool {
        self.z.is_empty()
    }

    /// Those in front of a source, as a catalogue that keeps their rows.
    ///
    /// # Errors
    /// A value that no catalogue may have.
    pub fn catalogue(&self, z_source: f64, background: &Background) -> Result<HaloCatalogue> {
        let kept: Vec<usize> = (0..self.len()).filter(|&i| self.z[i] < z_source).collect();
        let pick = |column: &[f64]| -> Vec<f64> { kept.iter().map(|&i| column[i]).collect() };
        let theta = [pick(&self.theta_x_arcsec), pick(&self.theta_y_arcsec)];
        let masses = HaloMasses::Physical { m200c_msun: pick(&self.m200c_msun), c200c: pick(&self.c200c) };
        let mut haloes = HaloCatalogue::new(z_source, background, pick(&self.z), theta, masses)?;
        haloes.extra.push((ROW_COLUMN.into(), kept.iter().map(|&i| self.row[i] as f64).collect()));
        Ok(haloes)
    }
}
