//! The arguments that choose a configuration, shared by the subcommands that need one.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use haloray::Error;
use haloray::Result;
use haloray::config::{self, Config, Draw};
use haloray::cosmology::Background;
use haloray::error::{Domain, FileFault, TableKind};
use haloray::halo::HaloCatalogue;
use haloray::imaging::Psf;
use haloray::io::{Provenance, PsfKernel, hash, read_cone, read_haloes};
use haloray::mapping::multiplane::Accuracy;
use haloray::monitor::Monitor;

use crate::record::option;

/// Which configuration to use.
#[derive(clap::Args)]
pub struct Settings {
    /// TOML file with the keys to change; `haloray schema` explains them, data/presets/ has two complete ones.
    #[arg(value_name = "CONFIG.toml")]
    config: Option<PathBuf>,
    #[command(flatten)]
    layers: Layers,
    /// How haloes are drawn, instead of the configuration's.
    #[arg(long, value_enum)]
    draw: Option<DrawArg>,
}

/// What lies below and above a configuration file.
#[derive(clap::Args)]
pub struct Layers {
    /// What the file's keys are laid over.
    #[arg(long, value_enum, default_value_t = Preset::Paper)]
    preset: Preset,
    /// Seed of everything random, instead of the configuration's.
    #[arg(long, allow_negative_numbers = true, value_name = "N")]
    #[arg(value_parser = whole::<u64>(0..=i64::MAX as u64))]
    seed: Option<u64>,
    /// A key of the configuration, laid over the file; may be given again for other keys.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
}

impl Layers {
    /// The configuration of a file between them, with more assignments on top.
    pub fn resolve(&self, file: Option<&Path>, more: &[String]) -> Result<Config> {
        let preset = match self.preset {
            Preset::Paper => config::Preset::Paper,
            Preset::Consistent => config::Preset::Consistent,
        };
        self.check_once("--seed", self.seed.as_ref(), "seed")?;
        let mut config = config::load_with(preset, file, &[&self.set, more].concat())?;
        config.seed = self.seed.unwrap_or(config.seed);
        Ok(config)
    }

    /// Refuses an option beside an assignment to the same key.
    fn check_once(&self, option: &str, value: Option<impl ToString>, key: &str) -> Result<()> {
        let is_key = |one: &&String| one.split('=').next().is_some_and(|own| own.trim() == key);
        match (value, self.set.iter().find(is_key)) {
            (Some(value), Some(one)) => {
                Err(Error::argument(option, value.to_string(), &format!("left out beside --set {one}")))
            }
            _ => Ok(()),
        }
    }
}

/// Parser of a whole number within `range`.
pub fn whole<T: TryFrom<u64>>(
    range: std::ops::RangeInclusive<u64>,
) -> impl Fn(&str) -> std::result::Result<T, String> + Clone {
    move |text| {
        let number = text.parse().ok().filter(|number| range.contains(number));
        let allowed = match *range.end() {
            u64::MAX => format!("from {}", range.start()),
            last => format!("from {} to {last}", range.start()),
        };
        let number = number.and_then(|number| T::try_from(number).ok());
        number.ok_or(format!("must be a whole number {allowed}, in digits alone"))
    }
}

#[derive(Clone, Copy, ValueEnum)]
pub enum Preset {
    /// Section 4 of Hogg et al. 2023 as its authors ran it.
    Paper,
    /// One cosmology, evolving relations, comoving radius, haloes that end, a straight axis ray, integrated pixels.
    Consistent,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum DrawArg {
    /// Only the haloes that pass the shear cut.
    Direct,
    /// All haloes of the cylinder, then the cut.
    BruteForce,
}

impl DrawArg {
    fn name(self) -> &'static str {
        match self {
            DrawArg::Direct => "direct",
            DrawArg::BruteForce => "brute-force",
        }
    }
}

impl Settings {
    /// The configuration file, if there is one.
    pub fn file(&self) -> Option<&Path> {
        self.config.as_deref()
    }

    /// Takes `file` for the configuration if there is none yet.
    pub fn or_file(&mut self, file: &str) -> bool {
        let is_free = self.config.is_none();
        self.config.get_or_insert_with(|| file.into());
        is_free
    }

    /// The resolved configuration.
    pub fn resolve(&self) -> Result<Config> {
        self.resolve_with(&[])
    }

    /// The same with more assignments laid over it.
    pub fn resolve_with(&self, more: &[String]) -> Result<Config> {
        let mut config = self.layers.resolve(self.config.as_deref(), more)?;
        if let Some(draw) = self.draw {
            self.layers.check_once("--draw", Some(draw.name()), "haloes.draw")?;
            config.haloes.draw = match draw {
                DrawArg::Direct => Draw::Direct,
                DrawArg::BruteForce => Draw::BruteForce,
            };
        }
        Ok(config)
    }

    /// What the run is called in its summary.
    pub fn name(&self) -> String {
        let preset = match self.layers.preset {
            Preset::Paper => "preset paper",
            Preset::Consistent => "preset consistent",
        };
        match &self.config {
            Some(path) => format!("{} over {preset}", path.display()),
            None => preset.into(),
        }
    }
}

/// Which of the sightlines of a seed.
#[derive(clap::Args)]
pub struct Sightline {
    /// Sightline K of the seed, as `study tidal -n` numbers them from 0.
    #[arg(long = "sightline", value_name = "K", default_value_t = 0)]
    pub number: u64,
}

/// How accurately rays are traced.
#[derive(clap::Args)]
pub struct Tracing {
    /// Largest error of a traced ray in arcsec, or `exact`, instead of the configuration's.
    #[arg(long, allow_negative_numbers = true, value_name = "exact|ARCSEC")]
    accuracy: Option<Accuracy>,
}

impl Tracing {
    /// Lays the option over a configuration.
    pub fn apply(&self, config: &mut Config) {
        let accuracy = &mut config.line_of_sight.accuracy_arcsec;
        *accuracy = self.accuracy.unwrap_or(*accuracy);
    }
}

/// What is allowed for options of the draw beside a halo table.
const WITHOUT_DRAW: &str = "left out beside --haloes, whose table is not drawn";

/// One line of sight: configured, or through given haloes.
#[derive(clap::Args)]
pub struct Sight {
    #[command(flatten)]
    settings: Settings,
    #[command(flatten)]
    sightline: Sightline,
    #[command(flatten)]
    tracing: Tracing,
    /// Halo table to use instead of a draw.
    #[arg(long, value_name = "FILE")]
    haloes: Option<PathBuf>,
    /// Draw critical curves and caustics of the main lens over the figures, and keep them in .h5 outputs.
    #[arg(long)]
    curves: bool,
}

impl Sight {
    /// The configuration file, if there is one.
    pub fn file(&self) -> Option<&Path> {
        self.settings.file()
    }

    /// Which of the sightlines of the seed.
    pub fn sightline(&self) -> u64 {
        self.sightline.number
    }

    /// Refuses a seed beside a halo table where nothing else is drawn: the lens, for its curves.
    pub fn check_seed_matters(&self, config: &Config) -> Result<()> {
        match self.settings.layers.seed {
            Some(seed) if self.haloes.is_some() && !config.diagnostics.critical_curves => {
                Err(Error::argument("--seed", seed.to_string(), WITHOUT_DRAW))
            }
            _ => Ok(()),
        }
    }

    /// The resolved configuration, with the options laid over it.
    pub fn resolve(&self) -> Result<Config> {
        let mut config = self.settings.resolve()?;
        let layers = &self.settings.layers;
        let haloes = self.haloes.as_deref().map(|path| path.display());
        layers.check_once("--haloes", haloes, "haloes.catalogue")?;
        if let (Some(draw), true) = (self.settings.draw, self.haloes.is_some()) {
            return Err(Error::argument("--draw", draw.name(), WITHOUT_DRAW));
        }
        config.haloes.catalogue = self.haloes.clone().or(config.haloes.catalogue);
        self.tracing.apply(&mut config);
        config.diagnostics.critical_curves |= self.curves;
        Ok(config)
    }
}

const H0_KM_S_MPC: f64 = 67.4;
const OMEGA_M: f64 = 0.315;

/// The cosmology of commands that read angles and redshifts only.
#[derive(clap::Args)]
pub struct Cosmology {
    /// Hubble constant of the distances.
    #[arg(long, allow_negative_numbers = true, value_name = "KM/S/MPC", default_value_t = H0_KM_S_MPC)]
    h0_km_s_mpc: f64,
    /// Matter density of the distances (flat ΛCDM).
    #[arg(long, allow_negative_numbers = true, value_name = "OMEGA", default_value_t = OMEGA_M)]
    omega_m: f64,
}

impl Cosmology {
    pub fn background(&self) -> Result<Background> {
        Background::new(self.h0_km_s_mpc, self.omega_m)
            .map_err(|error| error.named("h0_km_s_mpc", "--h0-km-s-mpc").named("omega_m", "--omega-m"))
    }

    /// The options that ask for it; empty words for what is the default.
    pub fn words(&self) -> [String; 4] {
        let [h0, value] = option("--h0-km-s-mpc", self.h0_km_s_mpc, H0_KM_S_MPC);
        let [omega, matter] = option("--omega-m", self.omega_m, OMEGA_M);
        [h0, value, omega, matter]
    }
}

/// Checks the number of an option.
pub fn of_option(domain: Domain, option: &str, value: f64, allowed: &str) -> Result<()> {
    domain.check_in_words(option, value, allowed).map(drop).map_err(|error| error.named(option, option))
}

/// What every output of a configured run of that sightline stores.
pub fn provenance(config: &Config, sightline: u64) -> Result<Provenance> {
    let text = toml::to_string(config)
        .map_err(|e| Error::out_of_range("configuration", e, "representable as TOML"))?;
    let told = if sightline == 0 { String::new() } else { format!("# sightline = {sightline}\n") };
    Ok(Provenance::new(Some(config.seed), told + &text))
}

/// A configuration with what identifies the PSF and the light cone that it names, by which unfinished work is known again: a
/// hash of the kernel, the size and the time of the last change of the cone's files, which may be a hundred gigabytes.
pub fn with_named_files(config: &Config, psf: &Psf, config_toml: &str) -> String {
    let change = |path: &PathBuf| {
        let metadata = std::fs::metadata(path).ok()?;
        Some((path.clone(), metadata.len(), metadata.modified().ok()))
    };
    let cone = config.haloes.lightcone.iter().flat_map(|cone| &cone.files);
    let changes: Vec<_> = cone.map(change).collect();
    format!("{config_toml}\n{:016x}\n{changes:?}", hash(format!("{psf:?}").as_bytes()))
}

/// Refuses a halo table of the user's own where many lines of sight are wanted.
pub fn check_many(config: &Config, study: &str) -> Result<()> {
    match &config.haloes.catalogue {
        None => Ok(()),
        Some(path) => {
            let allowed = format!("left out: {study} has many lines of sight, a halo table is one");
            Err(Error::out_of_range("haloes.catalogue", path.display(), &allowed))
        }
    }
}

/// The imported haloes of a sightline, if the configuration names a table or a light cone.
pub fn imported_haloes(
    config: &Config,
    sightline: u64,
    monitor: &dyn Monitor,
) -> Result<Option<HaloCatalogue>> {
    let z_source = config.line_of_sight.z_source;
    if let Some(cone) = &config.haloes.lightcone {
        return read_cone(config, cone, &[sightline], z_source, monitor)?(sightline, z_source).map(Some);
    }
    let Some(path) = config.haloes.catalogue.as_deref() else { return Ok(None) };
    let haloes = read_haloes(path, z_source, &config.cosmology)?;
    if config.haloes.cut_imported && haloes.m200c_msun.is_none() {
        let problem = "is missing, but haloes.cut_imported = true needs the masses";
        return Err(Error::table(path, "column m200c_msun", problem).in_table(TableKind::Haloes));
    }
    Ok(Some(haloes))
}

/// The PSF of a configuration: Gaussian, or the kernel in its file.
pub fn psf(config: &Config) -> Result<Psf> {
    let instrument = &config.instrument;
    match &instrument.psf_file {
        Some(path) => kernel(path, instrument.pixel_scale_arcsec),
        None => Psf::gaussian(
            instrument.psf_fwhm_arcsec,
            instrument.psf_truncation_sigma,
            instrument.pixel_scale_arcsec,
        ),
    }
}

fn kernel(path: &Path, pixel_scale_arcsec: f64) -> Result<Psf> {
    let read = || {
        let kernel = PsfKernel::read(path, pixel_scale_arcsec)?;
        let total: f64 = kernel.data.iter().sum();
        let psf = Psf::kernel(kernel.nx, kernel.ny, kernel.data, kernel.oversampling)?;
        if (total - 1.0).abs() > 1e-3 {
            let path = path.display();
            crate::terminal::warn(format_args!(
                "{path}: the kernel sums to {total:.6} and is divided by that"
            ));
        }
        Ok(psf)
    };
    read().map_err(|error: Error| error.in_file(FileFault::PsfKernel, path))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unfinished_work_is_known_by_its_kernel_and_its_light_cone() {
        let folder = tempfile::tempdir().unwrap();
        let cone = folder.path().join("cone.csv");
        let text = format!("[haloes.lightcone]\nfiles = [{:?}]\n", cone.display().to_string());
        std::fs::write(folder.path().join("my.toml"), text).unwrap();
        let config = config::load(config::Preset::Paper, Some(&folder.path().join("my.toml"))).unwrap();
        let kernel = |weight: f64| Psf::kernel(3, 3, [vec![weight], vec![1.0; 8]].concat(), 1).unwrap();
        std::fs::write(&cone, "z\n").unwrap();
        let before = with_named_files(&config, &kernel(1.0), "");
        assert_eq!(with_named_files(&config, &kernel(1.0), ""), before);
        assert_ne!(with_named_files(&config, &kernel(2.0), ""), before);
        std::fs::write(&cone, "z\n1\n").unwrap();
        assert_ne!(with_named_files(&config, &kernel(1.0), ""), before);
    }
}
