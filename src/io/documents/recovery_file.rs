//! Ended fits of a catalogue, a small folder each, so that none is ever repeated.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::io::containers::{Saved, TIMINGS, write_text};
use crate::mock::ShearRecovery;

#[derive(Serialize, Deserialize)]
struct SavedRecovery {
    /// Everything the fit depends on, in short.
    key: String,
    fit: ShearRecovery,
}

#[derive(Serialize, Deserialize)]
struct Timings {
    seconds: f64,
}

/// A name as a file can bear it: letters, digits and `-`, everything else `_`.
pub fn plain_name(name: &str) -> String {
    name.chars().map(|c| if c.is_alphanumeric() || c == '-' { c } else { '_' }).collect()
}

/// Where the fit of `image` with `model` lies under `folder`: `recovery.json`, and `timings.json` beside it.
pub fn recovery_path(folder: &Path, image: &str, model: &str) -> PathBuf {
    folder.join("fits").join(plain_name(model)).join(plain_name(image)).join("recovery.json")
}

/// Saves a fit that has ended, atomically; `key` says what it depends on.
///
/// # Errors
/// [`Error::Write`] and [`Error::OutputPlace`].
pub fn write_recovery(folder: &Path, key: &str, fit: &ShearRecovery, seconds: f64) -> Result<()> {
    let path = recovery_path(folder, &fit.image, &fit.model);
    if let Some(parent) = path.parent() {
        std::fs::create_dir_all(parent).map_err(|e| Error::write(parent, e))?;
    }
    let json = |path: &Path, text: serde_json::Result<String>| {
        text.map_err(|e| Error::write(path, e)).and_then(|text| write_text(path, &(text + "\n")))
    };
    let timings = path.with_file_name(TIMINGS);
    json(&timings, serde_json::to_string(&Timings { seconds }))?;
    json(&path, serde_json::to_string(&SavedRecovery { key: key.into(), fit: fit.clone() }))
}

/// The saved fit of `image` with `model` and its seconds, 0 where nobody knows them; what is of another key or damaged
/// cannot be used.
///
/// # Errors
/// [`Error::Read`] for a file that cannot be read.
pub fn read_recovery(
    folder: &Path,
    key: &str,
    image: &str,
    model: &str,
) -> Result<Saved<(ShearRecovery, f64)>> {
    let path = recovery_path(folder, image, model);
    let bytes = match std::fs::read(&path) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Saved::Nothing),
        Err(source) => return Err(Error::Read { path, source }),
    };
    Ok(match serde_json::from_slice::<SavedRecovery>(&bytes) {
        Ok(saved) if saved.key == key => {
            let timings = std::fs::read(path.with_file_name(TIMINGS)).unwrap_or_default();
            let seconds = serde_json::from_slice(&timings).map_or(0.0, |timings: Timings| timings.seconds);
            Saved::State((saved.fit, seconds))
        }
        Ok(_) => Saved::Unusable("of another command"),
        Err(_) => Saved::Unusable("damaged, or of another version of haloray"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mock::{ProfiledShear, RecoveredShear};

    #[test]
    fn a_fit_is_found_again_under_its_own_key_only() {
        let shear = RecoveredShear {
            median: 0.1,
            mean: 0.1,
            standard_deviation: 1.0 / 3.0,
            best_fit: 0.1,
            low: 0.0,
            high: 0.2,
            bounded: true,
            fisher: 0.1,
            profile: Some(ProfiledShear { best_fit: 0.1, interval68: [None, Some(1.0 / 3.0)] }),
        };
        let fit = ShearRecovery {
            image: "images/a b.fits".into(),
            model: "m".into(),
            shear: [shear; 2],
            draws: vec![[0.1, 0.2]],
            converged: true,
            worst_r_hat: 1.0,
            worst_ess: 400.0,
            divergences: 0,
            chi2_reduced: 1.0,
            evaluations: 1,
            unbounded: vec![],
        };
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(read_recovery(folder.path(), "k", &fit.image, "m").unwrap(), Saved::Nothing);
        write_recovery(folder.path(), "k", &fit, 2.5).unwrap();
        assert_eq!(
            read_recovery(folder.path(), "k", &fit.image, "m").unwrap(),
            Saved::State((fit.clone(), 2.5))
        );
        let other = read_recovery(folder.path(), "other", &fit.image, "m").unwrap();
        assert_eq!(other, Saved::Unusable("of another command"));
        for damaged in ["{".as_bytes(), &[0xff, 0xfe]] {
            std::fs::write(recovery_path(folder.path(), &fit.image, "m"), damaged).unwrap();
            let found = read_recovery(folder.path(), "k", &fit.image, "m").unwrap();
            assert!(matches!(found, Saved::Unusable(why) if why.starts_with("damaged")));
        }
    }
}
