//! One line of sight looked through: its tensors, Δ_tot, and the image of the lens seen through it.

use super::los_shears::{LosShears, Seen};
use super::scalars::SightScalars;
use super::shapes::LensAndSource;
use crate::config::{Config, LightConfig};
use crate::diagnostics::{
    CriticalCurves, EffectiveLineOfSight, RingAndDisc, ShearVariation, SkyWindow, TidalMaps,
};
use crate::error::Result;
use crate::imaging::{Exposure, Psf, Scene, SkyGrid, expose};
use crate::mapping::Mapping;
use crate::mapping::multiplane::{AccuracyReport, AdaptiveSegment, Field, LineOfSight, MainLens, Segment};
use crate::monitor::{Monitor, Uncounted};
use crate::numerics::random::{Stage, StreamName};
use crate::profile::light::Sersic;
use crate::profile::mass::{Epl, MassModel};

/// What is seen through one set of haloes.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// Haloes on this line of sight.
    pub number_of_haloes: usize,
    /// Of these, haloes at the redshift of the lens: part of it, and of none of the tensors.
    pub number_in_lens_plane: usize,
    /// od, os, ds and LOS tensors on the axis.
    pub effective: EffectiveLineOfSight,
    /// Total (os) shear and its relative variation.
    pub variation: ShearVariation,
    /// Shear, flexion and Δ (os) averaged over the ring and the disc of the scale of Δ.
    pub averages: RingAndDisc,
    /// γ_LOS by other definitions than the axis ray's.
    pub los_shears: LosShears,
    /// Where the axis ray, bent by the haloes, meets lens plane and source: for a straight reference, by how much these
    /// planes are moved to keep it straight.
    pub axis_ray_arcsec: [[f64; 2]; 2],
    /// Centre of the main lens, where the haloes make it appear on the axis: −α_od(0).
    pub lens_centre_arcsec: [f64; 2],
    /// Centre of the source, where the haloes alone would make it appear on the axis: −α_os(0).
    pub source_centre_arcsec: [f64; 2],
    /// The image.
    pub exposure: Exposure,
    /// How accurately its rays were traced.
    pub accuracy: AccuracyReport,
    /// Critical curves and caustics, where the configuration asks for them.
    pub curves: Option<CriticalCurves>,
}

/// A segment that is traced as accurately as configured, for about `rays` rays out to `half_width_arcsec`.
pub fn to_accuracy(
    config: &Config,
    segment: &Segment,
    half_width_arcsec: f64,
    rays: usize,
) -> AdaptiveSegment {
    let field = Field { centre_arcsec: [0.0; 2], half_arcsec: [half_width_arcsec; 2] };
    segment.adaptive(config.line_of_sight.accuracy_arcsec, Some(field), rays)
}

/// Maps of all haloes on the grid of the configuration, main lens excluded, and how accurately they were traced.
///
/// # Errors
/// When cancelled.
pub fn maps(
    config: &Config,
    line_of_sight: &LineOfSight,
    monitor: &dyn Monitor,
) -> Result<(TidalMaps, AccuracyReport)> {
    let (half, rays) = (config.maps.half_width_arcsec, config.maps.points * config.maps.points);
    let exact = line_of_sight.observer_to_source();
    let mapping = to_accuracy(config, &exact, half, rays);
    let _task = monitor.task("maps of the distortions", Some(rays as u64));
    let maps = TidalMaps::of(&mapping, config.maps, monitor)?;
    Ok((maps, mapping.report()))
}

impl View {
    /// What the line of sight does without an image.
    pub fn scalars(&self) -> SightScalars {
        SightScalars {
            number_of_haloes: self.number_of_haloes,
            number_in_lens_plane: self.number_in_lens_plane,
            effective: self.effective,
            ring: self.los_shears.ring,
            variation: self.variation,
            averages: self.averages,
            axis_ray_arcsec: self.axis_ray_arcsec,
            lens_centre_arcsec: self.lens_centre_arcsec,
            source_centre_arcsec: self.source_centre_arcsec,
        }
    }

    /// Looks through `line_of_sight` at the lens and source of the configuration.
    ///
    /// # Errors
    /// When lens or source cannot be built from the configuration; when cancelled.
    pub fn through(
        config: &Config,
        line_of_sight: &LineOfSight,
        shapes: &LensAndSource,
        psf: &Psf,
        noise: (u64, Stage),
        monitor: &dyn Monitor,
    ) -> Result<Self> {
        let z_lens = config.line_of_sight.z_lens;
        let scalars = SightScalars::of(config, line_of_sight)?;
        let SightScalars { lens_centre_arcsec, source_centre_arcsec, .. } = scalars;
        let lens = main_lens(config, shapes, lens_centre_arcsec)?;
        let source = light(config, &config.source, shapes.source_ellipticity, source_centre_arcsec)?;
        let lens_light = lens_light(config, shapes)?;
        let grid = SkyGrid::new(config.image.pixels, config.instrument.pixel_scale_arcsec)?;
        let exact = line_of_sight.through_lens(&lens)?;
        let rays = config.image.pixels * config.image.pixels;
        let whole = to_accuracy(config, &exact, grid.half_width_arcsec(), rays);
        let scene = Scene { mapping: &whole, source: &source, lens_light: lens_light.as_ref() };
        let sampling = config.image.pixel_sampling;
        let noise = StreamName { seed: config.seed, realisation: noise.0, stage: noise.1 };
        let exposure = expose(&scene, grid, &config.instrument, psf, sampling, noise, monitor)?;
        let accuracy = whole.report();
        let outside = line_of_sight.without_plane_at(z_lens)?;
        let seen =
            Seen { shapes, lens: &lens, lens_light: lens_light.as_ref(), whole: &whole, exposure: &exposure };
        let los_shears = LosShears::measure(
            config,
            &outside,
            &scalars.effective,
            scalars.ring,
            &seen,
            &Uncounted(monitor),
        )?;
        let SightScalars { number_of_haloes, number_in_lens_plane, effective, variation, averages, .. } =
            scalars;
        Ok(Self {
            number_of_haloes,
            number_in_lens_plane,
            effective,
            los_shears,
            variation,
            averages,
            axis_ray_arcsec: scalars.axis_ray_arcsec,
            lens_centre_arcsec,
            source_centre_arcsec,
            exposure,
            accuracy,
            curves: config
                .diagnostics
                .critical_curves
                .then(|| critical_curves(&exact, grid.half_width_arcsec(), monitor))
                .transpose()?,
        })
    }
}

/// The main lens of the configuration at the centre where it is to be: [`lens_centre`](super::lens_centre), so that the haloes
/// make it appear on the axis.
///
/// # Errors
/// When it cannot be built from the configuration.
pub fn main_lens(config: &Config, shapes: &LensAndSource, centre_arcsec: [f64; 2]) -> Result<MainLens> {
    let (radius, slope) = (config.lens.einstein_radius_arcsec, config.lens.slope);
    let profile = MassModel::Epl(Epl::new(radius, slope, shapes.lens_ellipticity, centre_arcsec)?);
    Ok(MainLens { z: config.line_of_sight.z_lens, profile })
}

/// Critical curves and caustics of a lens seen on the axis, out to `half_width_arcsec`.
///
/// # Errors
/// A half width that is not positive and finite; when cancelled.
pub fn critical_curves(
    mapping: &impl Mapping,
    half_width_arcsec: f64,
    monitor: &dyn Monitor,
) -> Result<CriticalCurves> {
    /// Of the first grid there are four times as many a side.
    const CELLS: usize = 24;
    let window = SkyWindow { cells: CELLS, ..SkyWindow::about_axis(half_width_arcsec, vec![[0.0; 2]])? };
    CriticalCurves::of(mapping, &window, monitor)
}

pub(super) fn light(
    config: &Config,
    own: &LightConfig,
    ellipticity: [f64; 2],
    centre_arcsec: [f64; 2],
) -> Result<Sersic> {
    let flux = config.instrument.flux_e_s(own.magnitude);
    Sersic::with_flux(flux, own.radius_arcsec, own.sersic_index, ellipticity, centre_arcsec)
}

/// Light of the lens galaxy, which is seen on the axis; shaped like the lens unless it has a shape of its own.
pub(super) fn lens_light(config: &Config, shapes: &LensAndSource) -> Result<Option<Sersic>> {
    let Some(own) = &config.lens_light else { return Ok(None) };
    let ellipticity = own.e1.zip(own.e2).map_or(shapes.lens_ellipticity, |(e1, e2)| [e1, e2]);
    Ok(Some(light(config, own, ellipticity, [0.0, 0.0])?))
}
