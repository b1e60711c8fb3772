//! Computes what is missing of an ensemble: a sightline on each core, one lens after the other.

use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};

use super::plan::Plan;
use super::sightline::sightline_row;
use super::store::{Outcome, SightlineStore};
use crate::error::{Error, Result};
use crate::imaging::Psf;
use crate::monitor::{Monitor, Uncounted};
use crate::pipeline::{Sightlines, one_core_each};

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
    for lens in 0..plan.lenses.len().max(1) {
        let of_lens: Vec<u64> =
            missing.iter().copied().filter(|&number| plan.lens_of(number) == lens).collect();
        if of_lens.is_empty() {
            continue;
        }
        task.check()?;
        let sightlines = Sightlines::of(&plan.config_of(lens)?)?;
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
