//! From the configuration to a halo catalogue.

use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::matter::{Selection, mean_convergence};
use crate::config::{Config, Draw, HALO_MASS_DEFINITION, SheetModel};
use crate::constants::ARCSEC_RAD;
use crate::cosmology::{Background, LinearTheory};
use crate::diagnostics::HaloTidal;
use crate::error::{Error, Result};
use crate::halo::concentration::ConcentrationTable;
use crate::halo::{
    DrawnHaloes, Epoch, HaloCatalogue, HaloMasses, Population, draw_brute_force, draw_direct,
    mean_density_sheets, passes_shear_cut,
};
use crate::mapping::multiplane::{LineOfSight, Reference, Sheets};
use crate::monitor::Monitor;
use crate::numerics::random::{Stage, stream};

/// More haloes than this would not fit into the memory of most machines (about 100 bytes each).
const EXPECTED_NUMBER_MAX: f64 = 1e8;

/// The haloes of one line of sight and the population they were drawn from.
#[derive(Debug, Clone)]
pub struct Haloes {
    /// The haloes kept.
    pub catalogue: HaloCatalogue,
    /// The population of the configuration (also behind an imported catalogue, for mean-density sheets).
    pub population: Population,
    /// Linear theory behind mass function and concentrations.
    pub linear: LinearTheory,
    /// Haloes drawn before the cut; none when drawn directly or imported.
    pub number_drawn: Option<u64>,
    /// Haloes left out because their own convergence on the axis exceeds `haloes.max_kappa`.
    pub number_excluded: usize,
    /// The mass function at the frozen redshift or that of the lens.
    pub mass_function: MassFunctionCurve,
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

/// Draws the haloes of `config`, or takes the `imported` ones.
///
/// # Errors
/// When a relation does not cover what is asked of it, or the cut is asked for without masses; when cancelled.
pub fn populate(
    config: &Config,
    imported: Option<HaloCatalogue>,
    realisation: u64,
    monitor: &dyn Monitor,
) -> Result<Haloes> {
    let linear = linear_theory(config)?;
    let settings = &config.haloes;
    let z_source = config.line_of_sight.z_source;
    let (z_max, z_curve) = match settings.epoch {
        Epoch::FrozenZ(z) => (z, z),
        Epoch::Evolving => (z_source, config.line_of_sight.z_lens),
    };
    let relation = settings.mass_function.build(settings.mass_definition, linear.background(), z_max)?;
    let dn_dlnm = |mass: f64, z: f64| relation.dn_dlnm_per_cmpc3(&linear, mass, z);
    let population = Population::new(config.cosmology, z_source, settings.limits(), settings.epoch, dn_dlnm)?;
    let mass_function = MassFunctionCurve::sample(relation.name(), config, z_curve, dn_dlnm);
    let (catalogue, number_drawn) = match imported {
        Some(catalogue) => (truncate(config, cut_imported(config, catalogue)?)?, None),
        None => draw(config, &linear, &population, realisation, monitor)?,
    };
    let mut haloes =
        Haloes { catalogue, population, linear, number_drawn, number_excluded: 0, mass_function };
    if let Some(limit) = settings.max_kappa {
        let effects = haloes.effects(config)?;
        let keep: Vec<bool> = effects.decisive(config).kappa.iter().map(|kappa| *kappa <= limit).collect();
        haloes.number_excluded = keep.iter().filter(|keep| !**keep).count();
        haloes.catalogue = haloes.catalogue.select(&keep);
    }
    Ok(haloes)
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
    Ok(match config.line_of_sight.sheets {
        SheetModel::OnAxis if config.line_of_sight.is_beside_axis() => Sheets::OnRay,
        SheetModel::OnAxis => Sheets::OnAxis,
        SheetModel::None => Sheets::None,
        SheetModel::MeanDensity => {
            let mean = mean_convergence(config, &haloes.linear, &haloes.population, selection)?;
            Sheets::Expected(mean_density_sheets(&mean, catalogue))
        }
    })
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
    /// When an imported halo has parameters that no profile allows.
    pub fn effects(&self, config: &Config) -> Result<SingleHaloes> {
        let theta_e = config.diagnostics.theta_e_arcsec;
        let on_axis = HaloTidal::of(&self.catalogue, theta_e)?;
        let on_ray = match config.line_of_sight.reference {
            Reference::Straight => None,
            Reference::Bent => {
                let sight = line_of_sight(config, self, &self.catalogue)?;
                let ray = sight.axis_ray_arcsec(&self.catalogue.chi_cmpc);
                Some(HaloTidal::along(&self.catalogue, theta_e, |i| ray[i])?)
            }
        };
        Ok(SingleHaloes { on_axis, on_ray })
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
    fn sample(name: &str, config: &Config, z: f64, dn_dlnm: impl Fn(f64, f64) -> f64) -> Self {
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

fn cut_imported(config: &Config, catalogue: HaloCatalogue) -> Result<HaloCatalogue> {
    if !config.haloes.cut_imported {
        return Ok(catalogue);
    }
    let keep = passes_shear_cut(&catalogue, config.haloes.min_point_shear)?;
    Ok(catalogue.select(&keep))
}

fn draw(
    config: &Config,
    linear: &LinearTheory,
    population: &Population,
    realisation: u64,
    monitor: &dyn Monitor,
) -> Result<(HaloCatalogue, Option<u64>)> {
    let expected = population.expected_number_kept();
    if expected > EXPECTED_NUMBER_MAX {
        let allowed = format!(
            "at most {EXPECTED_NUMBER_MAX:e}; raise haloes.min_point_shear or mass_min_msun, or lower radius_cmpc"
        );
        return Err(Error::out_of_range("the expected number of haloes", expected.round(), &allowed));
    }
    let (name, units) = match config.haloes.draw {
        Draw::Direct => ("draw the haloes that pass the cut", expected),
        Draw::BruteForce => ("draw all haloes", population.expected_number_drawn()),
    };
    let task = monitor.task(name, Some(units as u64));
    let (drawn, number_drawn) = match config.haloes.draw {
        Draw::Direct => (draw_direct(population, config.seed, realisation, monitor)?, None),
        Draw::BruteForce => {
            let drawn = draw_brute_force(population, config.seed, realisation, monitor)?;
            let number = drawn.number_drawn;
            (drawn, Some(number))
        }
    };
    task.check()?;
    Ok((to_catalogue(config, linear, drawn, realisation)?, number_drawn))
}

/// Redshifts, angles and concentrations of drawn haloes.
fn to_catalogue(
    config: &Config,
    linear: &LinearTheory,
    drawn: DrawnHaloes,
    realisation: u64,
) -> Result<HaloCatalogue> {
    let background = &config.cosmology;
    let z = redshifts(background, &drawn.chi_cmpc)?;
    let mut c200c = concentrations(config, linear, &drawn.m200c_msun, &z)?;
    scatter(&mut c200c, config.haloes.concentration_scatter_dex, config.seed, realisation);
    let angle = |transverse: &[f64]| -> Vec<f64> {
        transverse.iter().zip(&drawn.chi_cmpc).map(|(x, chi)| x / chi / ARCSEC_RAD).collect()
    };
    let theta = [angle(&drawn.x_cmpc), angle(&drawn.y_cmpc)];
    let masses = HaloMasses::Physical { m200c_msun: drawn.m200c_msun, c200c };
    truncate(config, HaloCatalogue::new(config.line_of_sight.z_source, background, z, theta, masses)?)
}

/// Truncates the haloes as configured, unless a catalogue brings radii of its own.
fn truncate(config: &Config, catalogue: HaloCatalogue) -> Result<HaloCatalogue> {
    match config.haloes.truncation()? {
        Some(truncation) if catalogue.r_trunc_arcsec.is_none() => catalogue.truncated(truncation),
        _ => Ok(catalogue),
    }
}

fn redshifts(background: &Background, chi_cmpc: &[f64]) -> Result<Vec<f64>> {
    chi_cmpc.par_iter().map(|&chi| background.redshift_at_comoving_distance(chi)).collect()
}

fn concentrations(config: &Config, linear: &LinearTheory, masses: &[f64], z: &[f64]) -> Result<Vec<f64>> {
    let settings = &config.haloes;
    let relation = settings.concentration.build(HALO_MASS_DEFINITION)?;
    Ok(match settings.epoch {
        Epoch::Evolving => {
            masses.par_iter().zip(z).map(|(&m, &z)| relation.concentration(linear, m, z)).collect()
        }
        Epoch::FrozenZ(z) => {
            let (low, high) = (settings.mass_min_msun, settings.mass_max_msun);
            let table = ConcentrationTable::new(relation.as_ref(), linear, z, low, high)?;
            masses.iter().map(|&m| table.concentration(m)).collect()
        }
    })
}

/// Log-normal scatter of `dex` around the relation.
fn scatter(concentrations: &mut [f64], dex: f64, seed: u64, realisation: u64) {
    if dex > 0.0 {
        let mut rng = stream(seed, realisation, Stage::Concentration, 0);
        for c in concentrations {
            let deviate: f64 = StandardNormal.sample(&mut rng);
            *c *= 10f64.powf(dex * deviate);
        }
    }
}
