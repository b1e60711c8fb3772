//! Ended fits of a catalogue, one small JSON file each, so that none is ever repeated.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::io::containers::write_text;
use crate::mock::ShearRecovery;

#[derive(Serialize, Deserialize)]
struct Saved {
    /// Everything the fit depends on, in short.
    key: String,
    /// Seconds it took.
    seconds: f64,
    fit: ShearRecovery,
}

/// Where the fit of `image` with `model` lies under `folder`.
pub fn recovery_path(folder: &Path, image: &str, model: &str) -> PathBuf {
    let plain: String =
        image.chars().map(|c| if c.is_alphanumeric() || c == '-' { c } else { '_' }).collect();
    folder.join("fits").join(model).join(format!("{plain}.json"))
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
    let saved = Saved { key: key.into(), seconds, fit: fit.clone() };
    let json = serde_json::to_string(&saved).map_err(|e| Error::write(&path, e))?;
    write_text(&path, &json)
}

/// The saved fit of `image` with `model` and its seconds; `None` if there is none, or one of another key.
///
/// # Errors
/// [`Error::Read`] for a file that cannot be read.
pub fn read_recovery(
    folder: &Path,
    key: &str,
    image: &str,
    model: &str,
) -> Result<Option<(ShearRecovery, f64)>> {
    let path = recovery_path(folder, image, model);
    let text = match std::fs::read_to_string(&path) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(source) => return Err(Error::Read { path, source }),
    };
    let saved: Option<Saved> = serde_json::from_str(&text).ok();
    Ok(saved.filter(|saved| saved.key == key).map(|saved| (saved.fit, saved.seconds)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mock::RecoveredShear;

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
        assert_eq!(read_recovery(folder.path(), "k", &fit.image, "m").unwrap(), None);
        write_recovery(folder.path(), "k", &fit, 2.5).unwrap();
        assert_eq!(read_recovery(folder.path(), "k", &fit.image, "m").unwrap(), Some((fit.clone(), 2.5)));
        assert_eq!(read_recovery(folder.path(), "other", &fit.image, "m").unwrap(), None);
        std::fs::write(recovery_path(folder.path(), &fit.image, "m"), "{").unwrap();
        assert_eq!(read_recovery(folder.path(), "k", &fit.image, "m").unwrap(), None);
    }
}
