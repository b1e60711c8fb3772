//! What a line of sight does on its axis and on the ring, before any image is made.

use nalgebra::Complex;

use super::los_shears::BeamAverage;
use crate::config::Config;
use crate::diagnostics::{Averaged, Distortion, EffectiveLineOfSight, RingAndDisc, ShearVariation};
use crate::error::Result;
use crate::mapping::multiplane::LineOfSight;
use crate::mapping::tidal::Tidal;
use crate::mapping::{Mapping, Order};

/// Tensors, flexions, Δ and positions of one line of sight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SightScalars {
    /// Haloes on this line of sight.
    pub number_of_haloes: usize,
    /// Of these, haloes at the redshift of the lens: part of it, and of none of the tensors.
    pub number_in_lens_plane: usize,
    /// od, os, ds and LOS tensors on the axis.
    pub effective: EffectiveLineOfSight,
    /// The tensors averaged along the beam of the Einstein ring: rays at θ_E that the lens turns towards the axis at the source.
    pub ring: Option<BeamAverage>,
    /// Total (os) shear and its relative variation.
    pub variation: ShearVariation,
    /// Shear, flexion and Δ (os) averaged over the ring and the disc of the scale of Δ.
    pub averages: RingAndDisc,
    /// Where the axis ray, bent by the haloes, meets lens plane and source.
    pub axis_ray_arcsec: [[f64; 2]; 2],
    /// Centre of the main lens, where the haloes make it appear on the axis: −α_od(0).
    pub lens_centre_arcsec: [f64; 2],
    /// Centre of the source, where the haloes alone would make it appear on the axis: −α_os(0).
    pub source_centre_arcsec: [f64; 2],
}

impl SightScalars {
    /// What stands for a line of sight where only the names of its quantities count.
    pub fn nothing() -> Self {
        let zero = Complex::new(0.0, 0.0);
        let none = Distortion { tidal: Tidal::NONE, f_per_arcsec: zero, g_per_arcsec: zero };
        let flexion = none.flexion();
        let effective = EffectiveLineOfSight {
            od: none,
            os: none,
            ds: none,
            los: Tidal::NONE,
            los_linear: Tidal::NONE,
            flexion_1ds: flexion,
            flexion_2ds: flexion,
        };
        let averaged = Averaged { gamma: zero, f_per_arcsec: zero, g_per_arcsec: zero, delta: 0.0 };
        Self {
            number_of_haloes: 0,
            number_in_lens_plane: 0,
            effective,
            ring: Some(BeamAverage::nothing()),
            variation: ShearVariation { gamma: zero, delta: 0.0 },
            averages: RingAndDisc { ring: averaged, disc: averaged },
            axis_ray_arcsec: [[0.0; 2]; 2],
            lens_centre_arcsec: [0.0; 2],
            source_centre_arcsec: [0.0; 2],
        }
    }

    /// Traces the axis ray and the rings of a line of sight.
    ///
    /// # Errors
    /// When A_ds cannot be inverted.
    pub fn of(config: &Config, sight: &LineOfSight) -> Result<Self> {
        let (z_lens, theta_e) = (config.line_of_sight.z_lens, config.diagnostics.theta_e_arcsec);
        // Haloes at the lens's redshift are part of the lens.
        let outside = &sight.without_plane_at(z_lens)?;
        let beside = [[theta_e, 0.0], [0.0, theta_e]];
        let near = outside.near_axis(z_lens, beside)?;
        let number_in_lens_plane = sight.len() - outside.len();
        let whole = if number_in_lens_plane == 0 { near } else { sight.near_axis(z_lens, beside)? };
        let lens_centre_arcsec = whole.od.beta_arcsec;
        let [right, above] = &whole.beside;
        Ok(Self {
            number_of_haloes: sight.len(),
            number_in_lens_plane,
            effective: EffectiveLineOfSight::of_rays(&near, sight.slope_per_reduced_deflection(z_lens)?)?,
            ring: ring_of(config, outside, lens_centre_arcsec)?,
            variation: ShearVariation::of_jacobians([&whole.os.jacobian, &right.jacobian, &above.jacobian]),
            averages: RingAndDisc::of_sight(sight, theta_e),
            axis_ray_arcsec: axis_ray(config, sight),
            lens_centre_arcsec,
            source_centre_arcsec: whole.os.beta_arcsec,
        })
    }
}

/// The tensors along the beam of the Einstein ring of a lens at that centre.
fn ring_of(config: &Config, outside: &LineOfSight, centre: [f64; 2]) -> Result<Option<BeamAverage>> {
    let (z_lens, radius) = (config.line_of_sight.z_lens, config.lens.einstein_radius_arcsec);
    Ok(BeamAverage::of(&[outside.ring_beam(z_lens, radius, centre)?]))
}

/// Where the axis ray, bent by the haloes, meets lens plane and source.
fn axis_ray(config: &Config, line_of_sight: &LineOfSight) -> [[f64; 2]; 2] {
    let los = &config.line_of_sight;
    let chi = [los.z_lens, los.z_source].map(|z| config.cosmology.comoving_distance_mpc(z));
    let at = line_of_sight.axis_ray_arcsec(&chi);
    [at[0], at[1]]
}

fn axis_position(mapping: &impl Mapping) -> [f64; 2] {
    mapping.map(&[[0.0, 0.0]], Order::Position).beta_arcsec[0]
}

/// Centre of the main lens, where the haloes make it appear on the axis: −α_od(0), arcsec.
///
/// # Errors
/// When the lens is not before the source.
pub fn lens_centre(config: &Config, line_of_sight: &LineOfSight) -> Result<[f64; 2]> {
    Ok(axis_position(&line_of_sight.observer_to(config.line_of_sight.z_lens)?))
}

/// Centre of the source, where the haloes alone would make it appear on the axis: −α_os(0), arcsec.
pub fn source_centre(line_of_sight: &LineOfSight) -> [f64; 2] {
    axis_position(&line_of_sight.observer_to_source())
}
