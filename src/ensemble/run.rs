//! Computes what is missing of an ensemble: a sightline on each core, one lens after the other.

use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};

use super::plan::Plan;
use super::sightline::sightline_row;
use super::store::{Outcome, SightlineStore};
use crate::error::{Error, Result};
use crate::imaging::Psf;
use crate::io::read_cone;
use crate::monitor::{Monitor, Uncounted};
use crate::pipeline::{ImportedSightlines, Sightlines, one_core_each};

/// Computes the sightlines of `numbers` that `store` does not have. One that fails is kept with its reason and stops no other.
///
/// # Errors
/// A configuration that yields no sightline; a store that cannot be written; when cancelled.
pub fn run(
    plan: &Plan,
    numbers: Range<u64>,
    psf: &Psf,
    store: &SightlineStore,
    monitor: &dyn Monitor,
) -> Result<()> {
    let task = monitor.task("sightlines", Some(numbers.end - numbers.start));
    let missing: Vec<u64> = numbers.clone().filter(|&number| !store.has(number)).collect();
    task.advance(numbers.end - numbers.start - missing.len() as u64);
    let imported = imported_sightlines(plan, &missing, monitor)?;
    for lens in 0..plan.lenses.len().max(1) {
        let of_lens: Vec<u64> =
            missing.iter().copied().filter(|&number| plan.lens_of(number) == lens).collect();
        if of_lens.is_empty() {
            continue;
        }
        task.check()?;
        let mut sightlines = Sightlines::of(&plan.config_of(lens)?)?;
        if let Some(imported) = &imported {
            sightlines = sightlines.with_imported(imported.clone());
        }
        sightlines.prepare(plan.level.has_images())?;
        one_core_each(of_lens.len() as u64, |i| {
            task.check()?;
            let number = of_lens[i as usize];
            store.keep(number, &outcome(plan, &sightlines, psf, number, &Uncounted(monitor))?)?;
            task.advance(1);
            Ok(())
        })?;
    }
    Ok(())
}

/// The haloes of those sightlines, read once, where the configuration takes them from a light cone.
fn imported_sightlines(
    plan: &Plan,
    numbers: &[u64],
    monitor: &dyn Monitor,
) -> Result<Option<ImportedSightlines>> {
    let Some(cone) = plan.config.haloes.lightcone.as_ref().filter(|_| !numbers.is_empty()) else {
        return Ok(None);
    };
    if cone.behind_mass_msun.is_some() && !plan.lenses.is_empty() {
        let allowed =
            "left out beside a table of lenses: which haloes are near the lens depends on its redshift";
        return Err(Error::out_of_range("haloes.lightcone.behind_mass_msun", "given", allowed));
    }
    let own = plan.config.line_of_sight.z_source;
    let z_source = match plan.lenses.is_empty() {
        true => own,
        false => plan.lenses.iter().map(|lens| lens.z_source).fold(0.0, f64::max),
    };
    read_cone(&plan.config, cone, numbers, z_source, monitor).map(Some)
}

fn outcome(
    plan: &Plan,
    sightlines: &Sightlines,
    psf: &Psf,
    number: u64,
    monitor: &dyn Monitor,
) -> Result<Outcome> {
    let row = catch_unwind(AssertUnwindSafe(|| sightline_row(plan, sightlines, psf, number, monitor)));
    Ok(match row {
        Ok(Ok(row)) => Outcome::Done(row),
        Ok(Err(Error::Cancelled)) => return Err(Error::Cancelled),
        Ok(Err(error)) => Outcome::Failed(error.to_string()),
        Err(_) => Outcome::Failed("computing it failed".into()),
    })
}

#[cfg(test)]
mod tests {
    use super::super::assembled::{StoredStacks, assemble};
    use super::super::columns::stacks_of;
    use super::super::plan::Level;
    use super::*;
    use crate::config::Preset;
    use crate::io::{Provenance, StackRows};
    use crate::monitor::Silent;

    #[test]
    fn a_sightline_that_fails_is_kept_with_its_reason_and_stops_no_other() {
        let mut config = Preset::Paper.config().unwrap();
        (config.haloes.min_point_shear, config.image.pixels) = (1e-3, 8);
        let instrument = &config.instrument;
        let (fwhm, scale) = (instrument.psf_fwhm_arcsec, instrument.pixel_scale_arcsec);
        let psf = Psf::gaussian(fwhm, instrument.psf_truncation_sigma, scale).unwrap();
        // Fits through haloes have no shear of the line of sight.
        let (level, model) = (Level::Fits, "haloes".to_string());
        let plan = Plan {
            config,
            lenses: Vec::new(),
            level,
            model,
            smoothing_arcsec: vec![30.0],
            first: 4,
            number: 3,
        };
        let folder = tempfile::tempdir().unwrap();
        let (store, _) = SightlineStore::open(&folder.path().join("log"), "", plan.numbers()).unwrap();
        let kept = Outcome::Failed("a former reason".into());
        store.keep(5, &kept).unwrap();
        run(&plan, plan.numbers(), &psf, &store, &Silent).unwrap();
        assert_eq!(store.read(5).unwrap(), kept, "what has ended is not computed again");
        let table = assemble(&plan, plan.numbers(), &Provenance::new(None, ""), &store).unwrap();
        assert_eq!(table.failures.iter().map(|(number, _)| *number).collect::<Vec<_>>(), [4, 5, 6]);
        assert!(table.failures[0].1.contains("gamma1_los"), "{}", table.failures[0].1);
        assert_eq!(table.column("failed").unwrap(), [1.0; 3]);
        assert!(table.column("gamma1_los").unwrap().iter().all(|value| value.is_nan()));
        let specs = stacks_of(&plan.config, level);
        let pixels = StoredStacks { store: &store, specs: &specs }.pixels(0, 4).unwrap();
        assert!(pixels.len() == 64 && pixels.iter().all(|pixel| pixel.is_nan()));
    }
}
