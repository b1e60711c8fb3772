//! The line of sight: haloes as sorted planes, ready to be traced between any two redshifts.

use rayon::prelude::*;

use super::plane::{Plane, Sheets, sorted_planes};
use super::segment::Segment;
use crate::cosmology::Background;
use crate::error::{Error, Result, require};
use crate::halo::HaloCatalogue;
use crate::profile::mass::MassModel;

/// All haloes between observer and source as lens planes, sorted once, each with its sheet.
#[derive(Debug, Clone)]
pub struct LineOfSight {
    background: Background,
    z_source: f64,
    pub(super) chi_source_cmpc: f64,
    pub(super) planes: Vec<Plane>,
}

/// The main lens, a plane of its own; its deflection is reduced to the source.
#[derive(Debug, Clone)]
pub struct MainLens {
    /// Redshift.
    pub z: f64,
    /// Mass profile.
    pub profile: MassModel,
}

impl LineOfSight {
    /// Sorts the haloes into planes and gives each its sheet.
    ///
    /// # Errors
    /// When an expected sheet is missing or the source lies at z ≤ 0; haloes were checked by the catalogue.
    pub fn new(haloes: &HaloCatalogue, background: Background, sheets: &Sheets) -> Result<Self> {
        if let Sheets::Expected(kappa) = sheets
            && kappa.len() != haloes.len()
        {
            return Err(Error::out_of_range(
                "number of expected sheets",
                kappa.len(),
                &format!("one a halo ({})", haloes.len()),
            ));
        }
        let z_source = haloes.z_source();
        let chi_source_cmpc = background.comoving_distance_mpc(z_source);
        let chi: Vec<f64> = haloes.z.par_iter().map(|&z| background.comoving_distance_mpc(z)).collect();
        Ok(Self {
            background,
            z_source,
            chi_source_cmpc,
            planes: sorted_planes(haloes, &chi, chi_source_cmpc, sheets),
        })
    }

    /// Number of halo planes.
    pub fn len(&self) -> usize {
        self.planes.len()
    }

    /// True when no halo lies on the line of sight.
    pub fn is_empty(&self) -> bool {
        self.planes.is_empty()
    }

    /// Observer to source through the haloes alone (os).
    pub fn observer_to_source(&self) -> Segment<'_> {
        Segment::from_observer(self, self.chi_source_cmpc)
    }

    /// Observer to redshift `z` through the haloes alone (od for z = z_d).
    ///
    /// # Errors
    /// When z is not between 0 and the source.
    pub fn observer_to(&self, z: f64) -> Result<Segment<'_>> {
        Ok(Segment::from_observer(self, self.distance(z)?))
    }

    /// Redshift `z` to source, about the ray that the observer sees on the axis (ds for z = z_d).
    ///
    /// # Errors
    /// When z is not between 0 and the source.
    pub fn to_source_from(&self, z: f64) -> Result<Segment<'_>> {
        self.between(z, self.z_source)
    }

    /// From redshift `z_near` to `z_far`, about the ray that the observer sees on the axis.
    ///
    /// # Errors
    /// Unless 0 < z_near < z_far ≤ z_source.
    pub fn between(&self, z_near: f64, z_far: f64) -> Result<Segment<'_>> {
        require(z_far > z_near, "the far redshift", z_far, &format!("above the near redshift {z_near}"))?;
        Ok(Segment::between(self, self.distance(z_near)?, self.distance(z_far)?))
    }

    /// ∂²β/∂θ_j∂σ_k of the axis ray, symmetrised, for a change σ of its slope at redshift `z`; per arcsec, as b_ijk.
    ///
    /// # Errors
    /// When z is not between 0 and the source.
    pub fn mixed_second_derivatives(&self, z: f64) -> Result<[f64; 6]> {
        Ok(self.observer_to_source().mixed_second_derivatives(self.distance(z)?))
    }

    /// f = χ_s/(χ_s − χ(z)): by how much a reduced deflection at redshift `z` changes the slope.
    ///
    /// # Errors
    /// When z is not between 0 and the source.
    pub fn slope_per_reduced_deflection(&self, z: f64) -> Result<f64> {
        Ok(self.chi_source_cmpc / (self.chi_source_cmpc - self.distance(z)?))
    }

    /// Observer to source through haloes and main lens: the whole lens mapping.
    ///
    /// # Errors
    /// When the lens does not lie between observer and source.
    pub fn through_lens<'a>(&'a self, lens: &'a MainLens) -> Result<Segment<'a>> {
        require(lens.z < self.z_source, "z_lens", lens.z, &format!("below z_source = {}", self.z_source))?;
        Ok(self.observer_to_source().with_lens(self.distance(lens.z)?, &lens.profile))
    }

    fn distance(&self, z: f64) -> Result<f64> {
        require(
            z > 0.0 && z <= self.z_source,
            "redshift on the line of sight",
            z,
            &format!("above 0 and at most z_source = {}", self.z_source),
        )?;
        if z == self.z_source {
            return Ok(self.chi_source_cmpc);
        }
        Ok(self.background.comoving_distance_mpc(z))
    }
}
