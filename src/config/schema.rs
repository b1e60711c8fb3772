//! Every key of the configuration, its unit and its domain.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::haloes::HaloConfig;
use crate::cosmology::{Background, StructureParameters};
use crate::diagnostics::MapGrid;
use crate::error::{Domain, Error, Result, shortest};
use crate::imaging::{Instrument, PixelSampling, SkyGrid};
use crate::mapping::multiplane::{Accuracy, Reference};

/// A resolved configuration: a preset overlaid with a user's file and command-line options.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// Seed of everything random.
    pub seed: u64,
    /// Distances: flat ΛCDM without radiation.
    pub cosmology: Background,
    /// Linear theory behind mass function and concentration.
    pub structure: StructureParameters,
    /// The halo population, or the user's own catalogue.
    pub haloes: HaloConfig,
    /// Redshifts of lens and source, and the compensating sheets.
    pub line_of_sight: LineOfSightConfig,
    /// Scale and thresholds of the diagnostics.
    pub diagnostics: DiagnosticsConfig,
    /// The main lens.
    pub lens: LensConfig,
    /// The source.
    pub source: LightConfig,
    /// Light of the lens galaxy, centred on the lens; none when left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lens_light: Option<LightConfig>,
    /// Camera and exposure.
    pub instrument: Instrument,
    /// The images.
    pub image: ImageConfig,
    /// Grid of the κ, γ, ω, F, G, Δ maps.
    pub maps: MapGrid,
}

impl LineOfSightConfig {
    /// Whether effects of haloes are taken along a ray that leaves the axis.
    pub fn is_beside_axis(&self) -> bool {
        self.reference == Reference::Bent && self.halo_effects == HaloEffects::Ray
    }
}

/// Redshifts and sheets.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LineOfSightConfig {
    /// Redshift of the main lens.
    pub z_lens: f64,
    /// Redshift of the source.
    pub z_source: f64,
    /// Compensating sheet of every halo plane.
    pub sheets: SheetModel,
    /// What positions are measured from: "straight", the axis ray, kept straight by subtracting its deflection in every
    /// plane, or "bent", a line which that ray leaves (the paper).
    #[serde(default)]
    pub reference: Reference,
    /// Where each halo's own κ_h (on-axis sheets, haloes.max_kappa) and Δ_h (who is beyond the tidal regime) are taken:
    /// "ray", where the traced axis ray passes it, or "axis", θ = 0 (the paper); the same for a straight reference.
    #[serde(default)]
    pub halo_effects: HaloEffects,
    /// Largest error of β of a traced ray in arcsec, or "exact": every ray through every plane.
    #[serde(default)]
    pub accuracy_arcsec: Accuracy,
}

/// Where the effects of single haloes are taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum HaloEffects {
    /// At θ = 0 in the halo's plane.
    #[default]
    Axis,
    /// Where the traced axis ray passes the halo.
    Ray,
}

/// The sheet of negative convergence in every halo plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SheetModel {
    /// −κ_h: the halo's own convergence on the axis (the paper), or along the ray (halo_effects).
    OnAxis,
    /// None.
    None,
    /// The expected mass of the mass function in the plane's share of the line of sight.
    MeanDensity,
}

/// Scale and thresholds of the diagnostics.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DiagnosticsConfig {
    /// Angular scale of Δ.
    pub theta_e_arcsec: f64,
    /// Haloes with Δ_h of at least this are beyond the tidal regime.
    pub delta_threshold: f64,
    /// Haloes with κ_h above this are reported.
    pub kappa_warning: f64,
    /// Trace critical curves and caustics of the main lens through the haloes and draw them over images and maps.
    #[serde(default)]
    pub critical_curves: bool,
}

/// The main lens, an elliptical power law.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LensConfig {
    /// Einstein radius.
    pub einstein_radius_arcsec: f64,
    /// Logarithmic slope γ of the density, 1 < γ < 3.
    pub slope: f64,
    /// Ellipticity (1−q)/(1+q)·cos 2φ; drawn from the seed when left out (give both or none).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub e1: Option<f64>,
    /// Ellipticity (1−q)/(1+q)·sin 2φ.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub e2: Option<f64>,
}

/// An elliptical Sérsic light profile.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LightConfig {
    /// Total apparent magnitude, -100 to 100.
    pub magnitude: f64,
    /// Half-light radius.
    pub radius_arcsec: f64,
    /// Sérsic index, 0.3 to 10.
    pub sersic_index: f64,
    /// Ellipticity (1−q)/(1+q)·cos 2φ; drawn from the seed when left out (lens light: that of the lens).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub e1: Option<f64>,
    /// Ellipticity (1−q)/(1+q)·sin 2φ.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub e2: Option<f64>,
}

/// The images.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ImageConfig {
    /// Pixels a side.
    pub pixels: usize,
    /// Sum of the brightness over a pixel.
    pub pixel_sampling: PixelSampling,
}

impl Config {
    /// Refuses haloes of the user's own where they are drawn.
    ///
    /// # Errors
    /// A halo table or a light cone.
    pub fn check_draws(&self) -> Result<()> {
        let readers = |also: &str| {
            format!("left out: this command draws its haloes; simulate, populate, map, image{also} read them")
        };
        if let Some(path) = &self.haloes.catalogue {
            return Err(Error::out_of_range("haloes.catalogue", path.display(), &readers("")));
        }
        if self.haloes.lightcone.is_some() {
            let allowed = readers(", ensemble and extract");
            return Err(Error::out_of_range("haloes.lightcone", "given", &allowed));
        }
        Ok(())
    }

    /// Why images of this configuration would hardly show what they are made for, in words; empty where nothing does.
    pub fn image_doubts(&self) -> Vec<String> {
        /// A part of a ring is an image too; what is so many times larger than the image is a mistake in its unit.
        const FAR: f64 = 4.0;
        let (pixel, theta_e) = (self.instrument.pixel_scale_arcsec, self.lens.einstein_radius_arcsec);
        let (reach, source) = (0.5 * self.image.pixels as f64 * pixel, self.source.radius_arcsec);
        let reaches = format!("the image reaches {} arcsec from its middle", shortest(reach));
        let of_lens = format!("lens.einstein_radius_arcsec is {}", shortest(theta_e));
        let mut doubts = Vec::new();
        if theta_e > FAR * reach {
            doubts.push(format!("{of_lens}, but {reaches}: its ring lies far outside"));
        } else if theta_e > 0.0 && pixel > theta_e {
            doubts.push(format!(
                "{of_lens}, but pixels have {} arcsec: no ring can be seen in them",
                shortest(pixel)
            ));
        }
        if source > FAR * reach {
            doubts.push(format!(
                "source.radius_arcsec is {}, but {reaches}: its light fills all of it",
                shortest(source)
            ));
        }
        doubts
    }

    /// Checks every number; names are dotted key paths so that [`super::load`] can add the line.
    ///
    /// # Errors
    /// The first key outside its domain.
    pub fn validate(&self) -> Result<()> {
        // TOML knows no larger integer, and a run stores its seed as TOML.
        if i64::try_from(self.seed).is_err() {
            return Err(Error::out_of_range("seed", self.seed, &format!("at most {}", i64::MAX)));
        }
        self.structure.validate().map_err(|error| match error {
            Error::OutOfRange { what, value, allowed } => {
                Error::OutOfRange { what: format!("structure.{what}"), value, allowed }
            }
            other => other,
        })?;
        let los = &self.line_of_sight;
        Domain::above_to(0.0, 20.0).check("line_of_sight.z_source", los.z_source)?;
        let before_source = format!("above 0 and below z_source = {}", los.z_source);
        Domain::inside(0.0, los.z_source).check_in_words(
            "line_of_sight.z_lens",
            los.z_lens,
            &before_source,
        )?;
        los.accuracy_arcsec.validate("line_of_sight.accuracy_arcsec")?;
        self.haloes.validate(&self.structure, los.z_source)?;
        let (d, lens, maps) = (&self.diagnostics, &self.lens, &self.maps);
        for (key, value, domain) in [
            ("diagnostics.theta_e_arcsec", d.theta_e_arcsec, Domain::POSITIVE),
            ("diagnostics.delta_threshold", d.delta_threshold, Domain::POSITIVE),
            ("diagnostics.kappa_warning", d.kappa_warning, Domain::POSITIVE),
            ("lens.einstein_radius_arcsec", lens.einstein_radius_arcsec, Domain::NON_NEGATIVE),
            ("lens.slope", lens.slope, Domain::inside(1.0, 3.0)),
            ("maps.points", maps.points as f64, Domain::from_to(2.0, 2048.0)),
            ("maps.half_width_arcsec", maps.half_width_arcsec, Domain::POSITIVE),
        ] {
            domain.check(key, value)?;
        }
        ellipticity("lens", lens.e1, lens.e2)?;
        self.source.validate("source")?;
        if let Some(light) = &self.lens_light {
            light.validate("lens_light")?;
        }
        self.instrument.validate()?;
        SkyGrid::new(self.image.pixels, self.instrument.pixel_scale_arcsec).map(drop)
    }
}

impl LightConfig {
    fn validate(&self, table: &str) -> Result<()> {
        for (key, value, domain) in [
            ("magnitude", self.magnitude, Domain::from_to(-100.0, 100.0)),
            ("radius_arcsec", self.radius_arcsec, Domain::POSITIVE),
            ("sersic_index", self.sersic_index, Domain::from_to(0.3, 10.0)),
        ] {
            domain.check(&format!("{table}.{key}"), value)?;
        }
        ellipticity(table, self.e1, self.e2)
    }
}

fn ellipticity(table: &str, e1: Option<f64>, e2: Option<f64>) -> Result<()> {
    match (e1, e2) {
        (None, None) => Ok(()),
        (Some(e1), Some(e2)) if e1.hypot(e2) < 1.0 => Ok(()),
        (Some(e1), Some(_)) => {
            let allowed = "such that √(e1² + e2²) is below 1";
            Err(Error::out_of_range(&format!("{table}.e1"), shortest(e1), allowed))
        }
        (Some(_), None) => {
            Err(Error::out_of_range(&format!("{table}.e2"), "missing", "given together with e1"))
        }
        (None, Some(_)) => {
            Err(Error::out_of_range(&format!("{table}.e1"), "missing", "given together with e2"))
        }
    }
}

/// The JSON schema of the configuration, for editors and validators.
pub fn json_schema() -> serde_json::Value {
    schemars::schema_for!(Config).to_value()
}
