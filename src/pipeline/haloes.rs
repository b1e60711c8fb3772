//! From the configuration to a halo catalogue.

use std::sync::Arc;

use nalgebra::Complex;

use super::matter::{Selection, mean_convergence};
use crate::config::{Config, SheetModel};
use crate::cosmology::LinearTheory;
use crate::diagnostics::{HaloTidal, JudgedHaloes, los_shear_in_disc};
use crate::error::{Error, Result};
use crate::halo::{HaloCatalogue, Population, mean_density_sheets};
use crate::mapping::multiplane::{LineOfSight, Reference, Sheets};
use crate::numerics::spline::UniformSpline;

/// The haloes of one line of sight and the population they were drawn from.
#[derive(Debug, Clone)]
pub struct Haloes {
    /// The haloes kept.
    pub catalogue: HaloCatalogue,
    /// The population of the configuration (also behind an imported catalogue, for mean-density sheets).
    pub population: Arc<Population>,
    /// Linear theory behind mass function and concentrations.
    pub linear: Arc<LinearTheory>,
    /// Haloes drawn before the cut; none when drawn directly or imported.
    pub number_drawn: Option<u64>,
    /// Haloes left out because their own convergence on the axis exceeds `haloes.max_kappa`.
    pub number_excluded: usize,
    /// The mass function at the frozen redshift or that of the lens.
    pub mass_function: Arc<MassFunctionCurve>,
}

/// dn/d ln M at one redshift, for files and figures.
#[derive(Debug, Clone, PartialEq)]
pub struct MassFunctionCurve {
    /// Name of the relation.
    pub name: String,
    /// Redshift.
    pub z: f64,
    /// M200c, Msun.
    pub m200c_msun: Vec<f64>,
    /// Comoving number density per ln M, Mpc⁻³.
    pub dn_dlnm_per_cmpc3: Vec<f64>,
}

/// Sorts haloes into planes with the sheets and the reference of the configuration.
///
/// # Errors
/// Passed on from the sheets.
pub fn line_of_sight(config: &Config, haloes: &Haloes, catalogue: &HaloCatalogue) -> Result<LineOfSight> {
    line_of_sight_of(config, haloes, catalogue, Selection::All)
}

/// As [`line_of_sight`], through the haloes of a selection, which sheets of the mean density must know.
///
/// # Errors
/// As [`line_of_sight`].
pub fn line_of_sight_of(
    config: &Config,
    haloes: &Haloes,
    catalogue: &HaloCatalogue,
    selection: Selection,
) -> Result<LineOfSight> {
    let sheets = sheets_of(config, haloes, catalogue, selection)?;
    LineOfSight::along(config.line_of_sight.reference, catalogue, &sheets)
}

/// The sheets of the configuration for haloes of a selection.
///
/// # Errors
/// When a relation does not cover what the mean density needs.
pub fn sheets_of(
    config: &Config,
    haloes: &Haloes,
    catalogue: &HaloCatalogue,
    selection: Selection,
) -> Result<Sheets> {
    let mean = match config.line_of_sight.sheets {
        SheetModel::MeanDensity => {
            Some(mean_convergence(config, &haloes.linear, &haloes.population, selection)?)
        }
        _ => None,
    };
    Ok(sheets_from(config, mean.as_ref(), catalogue))
}

/// The sheets of the configuration; those of the mean density share out the convergence that is expected.
pub(super) fn sheets_from(
    config: &Config,
    mean: Option<&UniformSpline>,
    catalogue: &HaloCatalogue,
) -> Sheets {
    match (config.line_of_sight.sheets, mean) {
        (SheetModel::OnAxis, _) if config.line_of_sight.is_beside_axis() => Sheets::OnRay,
        (SheetModel::OnAxis, _) => Sheets::OnAxis,
        (SheetModel::MeanDensity, Some(mean)) => Sheets::Expected(mean_density_sheets(mean, catalogue)),
        (SheetModel::None | SheetModel::MeanDensity, _) => Sheets::None,
    }
}

/// What each halo does on its own.
#[derive(Debug, Clone, PartialEq)]
pub struct SingleHaloes {
    /// At θ = 0 in its plane.
    pub on_axis: HaloTidal,
    /// Where the axis ray passes it, bent by all haloes; none where that ray is kept straight and the two are the same.
    pub on_ray: Option<HaloTidal>,
}

impl SingleHaloes {
    /// What haloes are judged by: `line_of_sight.halo_effects`.
    pub fn decisive(&self, config: &Config) -> &HaloTidal {
        self.on_ray.as_ref().filter(|_| config.line_of_sight.is_beside_axis()).unwrap_or(&self.on_axis)
    }
}

impl Haloes {
    /// What each halo does on its own.
    ///
    /// # Errors
    /// When an imported halo has parameters that no profile allows, or lies on the very ray.
    pub fn effects(&self, config: &Config) -> Result<SingleHaloes> {
        let theta_e = config.diagnostics.theta_e_arcsec;
        let on_axis = self.off_the_ray(HaloTidal::of(&self.catalogue, theta_e)?)?;
        let on_ray = match config.line_of_sight.reference {
            Reference::Straight => None,
            Reference::Bent => {
                let sight = line_of_sight(config, self, &self.catalogue)?;
                let ray = sight.axis_ray_arcsec(&self.catalogue.chi_cmpc);
                Some(self.off_the_ray(HaloTidal::along(&self.catalogue, theta_e, |i| ray[i])?)?)
            }
        };
        Ok(SingleHaloes { on_axis, on_ray })
    }

    /// What each halo does where it is judged, without averages over the ring; `sight` is the line of sight through all.
    ///
    /// # Errors
    /// As [`Self::effects`].
    pub fn effects_along(&self, config: &Config, sight: &LineOfSight) -> Result<HaloTidal> {
        let ray = self.ray(config.line_of_sight.is_beside_axis(), sight);
        let effects = HaloTidal::along(&self.catalogue, config.diagnostics.theta_e_arcsec, |i| ray[i])?;
        self.off_the_ray(effects)
    }

    /// Refuses a halo on the very ray along which it is judged, where its shear is zero and Δ_h no number.
    fn off_the_ray(&self, effects: HaloTidal) -> Result<HaloTidal> {
        let Some(i) = effects.delta.iter().position(|delta| !delta.is_finite()) else { return Ok(effects) };
        let at = format!("({}, {})", self.catalogue.theta_x_arcsec[i], self.catalogue.theta_y_arcsec[i]);
        let allowed = "off the axis ray, by 1e-6 arcsec say: on it a halo has no shear and Δ_h no value";
        Err(Error::out_of_range(&format!("position of halo {}", i + 1), at, allowed))
    }

    /// κ_h of each halo where it is judged, and whether it is in the tidal regime; `sight` is the line of sight through all.
    ///
    /// # Errors
    /// As [`Self::effects`].
    pub fn judged(&self, config: &Config, sight: &LineOfSight) -> Result<JudgedHaloes> {
        let (theta_e, limit) = (config.diagnostics.theta_e_arcsec, config.diagnostics.delta_threshold);
        let ray = self.ray(config.line_of_sight.is_beside_axis(), sight);
        JudgedHaloes::along(&self.catalogue, theta_e, limit, |i| ray[i])
    }

    /// γ_LOS to first order, averaged over discs of those radii about the ray that is traced on the axis.
    ///
    /// # Errors
    /// As [`Self::effects`]; a radius that is not positive.
    pub fn los_shears_in_discs(
        &self,
        config: &Config,
        sight: &LineOfSight,
        radii_arcsec: &[f64],
    ) -> Result<Vec<Complex<f64>>> {
        if radii_arcsec.is_empty() {
            return Ok(Vec::new());
        }
        let ray = self.ray(config.line_of_sight.reference == Reference::Bent, sight);
        let in_disc = |radius: &f64| {
            los_shear_in_disc(&self.catalogue, config.line_of_sight.z_lens, *radius, |i| ray[i])
        };
        radii_arcsec.iter().map(in_disc).collect()
    }

    /// Where the axis ray, or the axis itself, meets the plane of each halo, arcsec.
    fn ray(&self, is_bent: bool, sight: &LineOfSight) -> Vec<[f64; 2]> {
        match is_bent {
            true => sight.axis_ray_arcsec(&self.catalogue.chi_cmpc),
            false => vec![[0.0; 2]; self.catalogue.len()],
        }
    }

    /// The haloes in the tidal regime: Δ_h below the threshold.
    ///
    /// # Errors
    /// As [`Self::effects`].
    pub fn in_tidal_regime(&self, config: &Config) -> Result<HaloCatalogue> {
        let within = self.effects(config)?.decisive(config).within(config.diagnostics.delta_threshold);
        Ok(self.catalogue.select(&within))
    }
}

/// Linear theory of the configuration, in the h-units it asks for.
pub(super) fn linear_theory(config: &Config) -> Result<LinearTheory> {
    let linear = LinearTheory::new(config.structure)?;
    match config.haloes.h_units_h0_km_s_mpc {
        Some(h0) => linear.in_hubble_units_of(h0),
        None => Ok(linear),
    }
}

impl MassFunctionCurve {
    pub(super) fn sample(name: &str, config: &Config, z: f64, dn_dlnm: impl Fn(f64, f64) -> f64) -> Self {
        const POINTS: usize = 200;
        let limits = config.haloes.limits();
        let range = (limits.mass_max_msun / limits.mass_min_msun).ln();
        let m200c_msun: Vec<f64> = (0..POINTS)
            .map(|i| limits.mass_min_msun * (range * i as f64 / (POINTS - 1) as f64).exp())
            .collect();
        let dn_dlnm_per_cmpc3 = m200c_msun.iter().map(|&m| dn_dlnm(m, z)).collect();
        Self { name: name.into(), z, m200c_msun, dn_dlnm_per_cmpc3 }
    }
}
