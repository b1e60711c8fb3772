//! The sightlines of a configuration: what they share is built once, each is drawn by its number.

use std::sync::{Arc, OnceLock};

use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::haloes::{Haloes, MassFunctionCurve, linear_theory, sheets_from};
use super::matter::{Selection, mean_convergence};
use crate::config::{Config, Draw, HALO_MASS_DEFINITION, SheetModel};
use crate::constants::ARCSEC_RAD;
use crate::cosmology::LinearTheory;
use crate::error::{Error, Result};
use crate::halo::concentration::{ConcentrationRelation, ConcentrationTable};
use crate::halo::{
    DrawnHaloes, Epoch, HaloCatalogue, HaloMasses, Population, draw_brute_force, draw_direct,
    passes_shear_cut,
};
use crate::mapping::multiplane::LineOfSight;
use crate::monitor::Monitor;
use crate::numerics::random::{Stage, stream};
use crate::numerics::spline::UniformSpline;

/// More haloes than this would not fit into the memory of most machines (about 100 bytes each).
const EXPECTED_NUMBER_MAX: f64 = 1e8;

/// Haloes of the user's own for every sightline: those of a number, in front of a source at a redshift.
pub type ImportedSightlines = Arc<dyn Fn(u64, f64) -> Result<HaloCatalogue> + Send + Sync>;

/// Linear theory, mass function, concentrations and distances of one configuration, for any number of its sightlines.
///
/// Sightline k, the realisation k of the configured seed, is the same whichever are drawn beside it.
pub struct Sightlines {
    config: Config,
    linear: Arc<LinearTheory>,
    population: Arc<Population>,
    mass_function: Arc<MassFunctionCurve>,
    concentrations: Concentrations,
    expected_number: f64,
    /// Expected convergence of the haloes that are traced, by selection, where sheets need it.
    mean_convergence: [OnceLock<UniformSpline>; 2],
    /// Where haloes come from that are not drawn.
    imported: Option<ImportedSightlines>,
}

/// Median concentrations: tabulated where they depend on the mass alone.
enum Concentrations {
    Table(ConcentrationTable),
    Relation(Box<dyn ConcentrationRelation>),
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
    let sightlines = Sightlines::of(config)?;
    match imported {
        Some(catalogue) => sightlines.take(catalogue),
        None => sightlines.draw(realisation, monitor),
    }
}

impl Sightlines {
    /// Builds the tables of `config`.
    ///
    /// # Errors
    /// When a relation does not cover what is asked of it.
    pub fn of(config: &Config) -> Result<Self> {
        let linear = linear_theory(config)?;
        let settings = &config.haloes;
        let z_source = config.line_of_sight.z_source;
        let (z_max, z_curve) = match settings.epoch {
            Epoch::FrozenZ(z) => (z, z),
            Epoch::Evolving => (z_source, config.line_of_sight.z_lens),
        };
        let relation = settings.mass_function.build(settings.mass_definition, linear.background(), z_max)?;
        let dn_dlnm = |mass: f64, z: f64| relation.dn_dlnm_per_cmpc3(&linear, mass, z);
        let population =
            Population::new(config.cosmology, z_source, settings.limits(), settings.epoch, dn_dlnm)?;
        let mass_function = MassFunctionCurve::sample(relation.name(), config, z_curve, dn_dlnm);
        let relation = settings.concentration.build(HALO_MASS_DEFINITION)?;
        let concentrations = match settings.epoch {
            Epoch::Evolving => Concentrations::Relation(relation),
            Epoch::FrozenZ(z) => {
                let (low, high) = (settings.mass_min_msun, settings.mass_max_msun);
                Concentrations::Table(ConcentrationTable::new(relation.as_ref(), &linear, z, low, high)?)
            }
        };
        let expected_number = population.expected_number_kept();
        Ok(Self {
            config: config.clone(),
            linear: Arc::new(linear),
            population: Arc::new(population),
            mass_function: Arc::new(mass_function),
            concentrations,
            expected_number,
            mean_convergence: Default::default(),
            imported: None,
        })
    }

    /// The same sightlines with haloes of the user's own, cut and truncated as configured, where others are drawn.
    pub fn with_imported(self, imported: ImportedSightlines) -> Self {
        Self { imported: Some(imported), ..self }
    }

    /// The configuration.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// The population that haloes are drawn from.
    pub fn population(&self) -> &Population {
        &self.population
    }

    /// Linear theory behind mass function and concentrations.
    pub fn linear(&self) -> &LinearTheory {
        &self.linear
    }

    /// Builds what is built on first use, before threads ask for it, and checks that sightlines can be drawn.
    ///
    /// # Errors
    /// More haloes than memory holds; a relation that does not cover what sheets need.
    pub fn prepare(&self, tidal_regime_too: bool) -> Result<()> {
        self.expected()?;
        if self.config.line_of_sight.sheets == SheetModel::MeanDensity {
            self.mean_convergence(Selection::All)?;
            if tidal_regime_too {
                self.mean_convergence(Selection::TidalRegime)?;
            }
        }
        Ok(())
    }

    /// The expected number of haloes, if they fit into memory.
    fn expected(&self) -> Result<f64> {
        let expected = self.expected_number;
        if self.imported.is_some() {
            return Ok(expected);
        }
        if expected > EXPECTED_NUMBER_MAX {
            let allowed = format!(
                "at most {EXPECTED_NUMBER_MAX:e}; raise haloes.min_point_shear or mass_min_msun, or lower radius_cmpc"
            );
            return Err(Error::out_of_range("the expected number of haloes", expected.round(), &allowed));
        }
        Ok(expected)
    }

    /// Draws the haloes of sightline `number`, or takes those that are imported.
    ///
    /// # Errors
    /// More haloes than memory holds; imported ones that cannot be had, or are asked for and were not read; when cancelled.
    pub fn draw(&self, number: u64, monitor: &dyn Monitor) -> Result<Haloes> {
        if let Some(imported) = &self.imported {
            return self.take(imported(number, self.config.line_of_sight.z_source)?);
        }
        self.config.check_draws()?;
        let expected = self.expected()?;
        let population = &self.population;
        let (name, units) = match self.config.haloes.draw {
            Draw::Direct => ("draw the haloes that pass the cut", expected),
            Draw::BruteForce => ("draw all haloes", population.expected_number_drawn()),
        };
        let task = monitor.task(name, Some(units as u64));
        let seed = self.config.seed;
        let (drawn, number_drawn) = match self.config.haloes.draw {
            Draw::Direct => (draw_direct(population, seed, number, monitor)?, None),
            Draw::BruteForce => {
                let drawn = draw_brute_force(population, seed, number, monitor)?;
                let all = drawn.number_drawn;
                (drawn, Some(all))
            }
        };
        task.check()?;
        self.limited(self.catalogue(drawn, number)?, number_drawn)
    }

    /// Takes haloes of the user's own, cut and truncated as configured.
    ///
    /// # Errors
    /// The cut asked for without masses, a truncation without concentrations.
    pub fn take(&self, imported: HaloCatalogue) -> Result<Haloes> {
        let settings = &self.config.haloes;
        let cut = if settings.cut_imported {
            let keep = passes_shear_cut(&imported, settings.min_point_shear)?;
            imported.select(&keep)
        } else {
            imported
        };
        self.limited(self.truncated(cut)?, None)
    }

    /// Haloes without those of too much convergence.
    fn limited(&self, catalogue: HaloCatalogue, number_drawn: Option<u64>) -> Result<Haloes> {
        let (population, linear) = (self.population.clone(), self.linear.clone());
        let mass_function = self.mass_function.clone();
        let mut haloes =
            Haloes { catalogue, population, linear, number_drawn, number_excluded: 0, mass_function };
        if let Some(limit) = self.config.haloes.max_kappa {
            let effects = haloes.effects(&self.config)?;
            let kappa = &effects.decisive(&self.config).kappa;
            let keep: Vec<bool> = kappa.iter().map(|kappa| *kappa <= limit).collect();
            haloes.number_excluded = keep.iter().filter(|keep| !**keep).count();
            haloes.catalogue = haloes.catalogue.select(&keep);
        }
        Ok(haloes)
    }

    /// Sorts `catalogue`, the haloes of a selection, into planes with the sheets and the reference of the configuration.
    ///
    /// # Errors
    /// When a relation does not cover what the mean density needs.
    pub fn line_of_sight(&self, catalogue: &HaloCatalogue, selection: Selection) -> Result<LineOfSight> {
        let mean = match self.config.line_of_sight.sheets {
            SheetModel::MeanDensity => Some(self.mean_convergence(selection)?),
            _ => None,
        };
        let sheets = sheets_from(&self.config, mean, catalogue);
        LineOfSight::along(self.config.line_of_sight.reference, catalogue, &sheets)
    }

    /// Expected convergence of the haloes of a selection, see [`mean_convergence`].
    ///
    /// # Errors
    /// As [`mean_convergence`].
    pub fn mean_convergence(&self, selection: Selection) -> Result<&UniformSpline> {
        let place = &self.mean_convergence[usize::from(selection == Selection::TidalRegime)];
        if let Some(known) = place.get() {
            return Ok(known);
        }
        let computed = mean_convergence(&self.config, &self.linear, &self.population, selection)?;
        Ok(place.get_or_init(|| computed))
    }

    /// Redshifts, angles and concentrations of drawn haloes.
    fn catalogue(&self, drawn: DrawnHaloes, number: u64) -> Result<HaloCatalogue> {
        let background = &self.config.cosmology;
        let z: Vec<f64> = drawn.chi_cmpc.iter().map(|&chi| self.population.redshift(chi)).collect();
        let masses = &drawn.m200c_msun;
        let mut c200c: Vec<f64> = match &self.concentrations {
            Concentrations::Table(table) => masses.iter().map(|&m| table.concentration(m)).collect(),
            Concentrations::Relation(relation) => {
                let of = |(&m, &z): (&f64, &f64)| relation.concentration(&self.linear, m, z);
                masses.par_iter().zip(&z).map(of).collect()
            }
        };
        self.scatter(&mut c200c, number);
        let angle = |transverse: &[f64]| -> Vec<f64> {
            transverse.iter().zip(&drawn.chi_cmpc).map(|(x, chi)| x / chi / ARCSEC_RAD).collect()
        };
        let theta = [angle(&drawn.x_cmpc), angle(&drawn.y_cmpc)];
        let masses = HaloMasses::Physical { m200c_msun: drawn.m200c_msun, c200c };
        let z_source = self.config.line_of_sight.z_source;
        self.truncated(HaloCatalogue::new(z_source, background, z, theta, masses)?)
    }

    /// Log-normal scatter around the relation.
    fn scatter(&self, concentrations: &mut [f64], number: u64) {
        let dex = self.config.haloes.concentration_scatter_dex;
        if dex > 0.0 {
            let mut rng = stream(self.config.seed, number, Stage::Concentration, 0);
            for c in concentrations {
                let deviate: f64 = StandardNormal.sample(&mut rng);
                *c *= 10f64.powf(dex * deviate);
            }
        }
    }

    /// Truncates the haloes as configured, unless a catalogue brings radii of its own.
    fn truncated(&self, catalogue: HaloCatalogue) -> Result<HaloCatalogue> {
        match self.config.haloes.truncation()? {
            Some(truncation) if catalogue.r_trunc_arcsec.is_none() => catalogue.truncated(truncation),
            _ => Ok(catalogue),
        }
    }
}
