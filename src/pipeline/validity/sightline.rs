//! The rows of the study: each sightline drawn, seen through its haloes and through their tensors alone, and fitted.

use super::delays::Delays;
use super::estimate::{Wanted, fit};
use super::plan::{SeenHaloes, ValidityCase, ValidityPlan};
use super::rows::{ValidityImage, ValiditySightline, ValidityView, VaryingHalo};
use crate::diagnostics::EffectiveLineOfSight;
use crate::error::{Error, Result};
use crate::imaging::Exposure;
use crate::mapping::multiplane::LineOfSight;
use crate::mapping::tidal::LineOfSightModel;
use crate::monitor::{Monitor, Uncounted};
use crate::numerics::random::Stage;
use crate::pipeline::los_shears::LosShears;
use crate::pipeline::tidal_twin::{TidalTwin, tidal_lens};
use crate::pipeline::view_fits::FittedView;
use crate::pipeline::{
    BeamAverage, LensAndSource, RowStore, Selection, Sightlines, View, main_lens, one_core_each,
};

/// Computes sightlines 0 to `number` of every case, but for those that `rows` has; one on each core, sightline by sightline, so
/// that what has ended at any moment is a fair sample.
///
/// # Errors
/// A plan or configuration that yields no sightline; a store that cannot be written; when cancelled.
pub fn validity(
    plan: &ValidityPlan,
    number: u64,
    rows: &dyn RowStore<ValiditySightline>,
    monitor: &dyn Monitor,
) -> Result<Vec<ValiditySightline>> {
    plan.validate()?;
    let cases = plan.cases.len() as u64;
    let task = monitor.task("sightlines", Some(number * cases));
    let places: Vec<Place> = plan.cases.iter().map(|case| Place::of(plan, case)).collect::<Result<_>>()?;
    one_core_each(number * cases, |row| {
        task.check()?;
        let (sightline, case) = (row / cases, (row % cases) as usize);
        let ended = rows.row(row, || places[case].row(sightline, case, &Uncounted(monitor)));
        task.advance(1);
        ended
    })
}

/// A case with what all of its sightlines share.
struct Place<'a> {
    plan: &'a ValidityPlan,
    case: &'a ValidityCase,
    /// Sheets of the mean density depend on the selection, which makes one for each view.
    of_views: Vec<(SeenHaloes, Sightlines)>,
}

impl<'a> Place<'a> {
    fn of(plan: &'a ValidityPlan, case: &'a ValidityCase) -> Result<Self> {
        let of_view = |view: &SeenHaloes| -> Result<_> {
            let mut config = case.config.clone();
            config.diagnostics.delta_threshold = view.below.unwrap_or(config.diagnostics.delta_threshold);
            let sightlines = Sightlines::of(&config)?;
            sightlines.prepare(view.below.is_some())?;
            Ok((*view, sightlines))
        };
        Ok(Self { plan, case, of_views: plan.views.iter().map(of_view).collect::<Result<_>>()? })
    }

    /// A sightline; one that fails says why and is no error.
    fn row(&self, sightline: u64, case: usize, monitor: &dyn Monitor) -> Result<ValiditySightline> {
        let failed =
            |failure: String| ValiditySightline { sightline, case, halo: None, views: vec![], failure };
        match self.try_row(sightline, case, monitor) {
            Err(Error::Cancelled) => Err(Error::Cancelled),
            Err(error) => Ok(failed(error.to_string())),
            row => row,
        }
    }

    fn try_row(&self, sightline: u64, case: usize, monitor: &dyn Monitor) -> Result<ValiditySightline> {
        let config = &self.case.config;
        let (_, first) = &self.of_views[0];
        let haloes = first.draw(sightline, monitor)?;
        let whole = first.line_of_sight(&haloes.catalogue, Selection::All)?;
        let effects = haloes.effects_along(config, &whole)?;
        let shapes = LensAndSource::resolve(config, sightline);
        let view = |(seen, sightlines): &(SeenHaloes, Sightlines)| match seen.below {
            None => self.view(&whole, &shapes, (sightline, Stage::NoiseAllHaloes), monitor),
            Some(limit) => {
                let tidal = haloes.catalogue.select(&effects.within(limit));
                let sight = sightlines.line_of_sight(&tidal, Selection::TidalRegime)?;
                self.view(&sight, &shapes, (sightline, Stage::NoiseTidalHaloes), monitor)
            }
        };
        Ok(ValiditySightline {
            sightline,
            case,
            halo: VaryingHalo::of(&haloes.catalogue, &effects),
            views: self.of_views.iter().map(view).collect::<Result<_>>()?,
            failure: String::new(),
        })
    }

    fn view(
        &self,
        sight: &LineOfSight,
        shapes: &LensAndSource,
        noise: (u64, Stage),
        monitor: &dyn Monitor,
    ) -> Result<ValidityView> {
        let ValidityCase { config, psf, .. } = self.case;
        let view = View::through(config, sight, shapes, psf, noise, monitor)?;
        let axis = &view.effective;
        let twin = TidalTwin::of(config, shapes, axis, psf, noise, monitor)?;
        let [of_axis, truth, of_ring] = self.delays(sight, shapes, &view)?;
        let image =
            |exposure: &Exposure, shears: &LosShears, truth: Option<&Delays>, ring: Option<&Delays>| {
                let seen = FittedView {
                    image: "all_haloes",
                    config,
                    shapes,
                    exposure,
                    effective: axis,
                    los_shears: shears,
                    psf,
                };
                let ratio = |model: Option<&Delays>| {
                    truth.zip(model).map_or(f64::NAN, |(truth, own)| truth.h0_ratio(own))
                };
                self.image(&seen, axis, [ratio(of_axis.as_ref()), ratio(ring)], truth, monitor)
            };
        Ok(ValidityView {
            number_of_haloes: view.number_of_haloes,
            delta_tot: [view.variation.delta, view.averages.ring.delta],
            haloes: image(&view.exposure, &view.los_shears, truth.as_ref(), of_ring.as_ref())?,
            // The tensors of a twin are the same on the ring.
            tidal: image(&twin.exposure, &twin.los_shears, of_axis.as_ref(), of_axis.as_ref())?,
        })
    }

    /// Delays behind the tensors of the axis, behind the haloes, and behind the tensors of the ring, where they are wanted and the
    /// images of the first can be followed.
    fn delays(
        &self,
        sight: &LineOfSight,
        shapes: &LensAndSource,
        view: &View,
    ) -> Result<[Option<Delays>; 3]> {
        if !self.plan.has_delays {
            return Ok([None, None, None]);
        }
        let config = &self.case.config;
        let through = |model| tidal_lens(config, shapes, model);
        let half = view.exposure.grid.half_width_arcsec();
        let of_axis = Delays::of(&through(view.effective.tidal_model())?, half, [0.0; 2])?;
        let whole = sight.through_lens(&main_lens(config, shapes, view.lens_centre_arcsec)?)?;
        let truth = of_axis.followed(&whole, view.source_centre_arcsec);
        let of_ring = match view.los_shears.ring {
            Some(BeamAverage { od, os, ds, .. }) => {
                of_axis.followed(&through(LineOfSightModel::Full { od, os, ds })?, [0.0; 2])
            }
            None => None,
        };
        Ok([Some(of_axis), truth, of_ring])
    }

    fn image(
        &self,
        seen: &FittedView,
        axis: &EffectiveLineOfSight,
        h0_ratio: [f64; 2],
        delays: Option<&Delays>,
        monitor: &dyn Monitor,
    ) -> Result<ValidityImage> {
        let tensors = seen.los_shears.all(axis);
        let residual = [seen.los_shears.best_tidal, seen.los_shears.best_flexion];
        let mut fits = Vec::new();
        for (place, name) in self.plan.models.iter().enumerate() {
            for start in &self.plan.starts {
                let wanted = Wanted { model: (place, name), start: *start, estimate: self.plan.estimate };
                fits.push(fit(seen, wanted, delays, monitor)?);
            }
        }
        Ok(ValidityImage {
            by_definition: std::array::from_fn(|i| {
                tensors[i].map_or([f64::NAN; 2], |(_, los)| [los.gamma.re, los.gamma.im])
            }),
            residual_arcsec: residual.map(|best| best.map_or(f64::NAN, |best| best.residual_arcsec)),
            h0_ratio,
            fits,
        })
    }
}
