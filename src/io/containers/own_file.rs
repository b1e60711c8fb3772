//! Whose file a single output would replace: what haloray wrote says so, in its header or beside a CSV.

use std::io::{Error as IoError, ErrorKind};
use std::path::Path;

use super::table_csv::{csv_hash, provenance_beside, provenance_file};
use super::table_file::Format;
use super::{fits_file, sealed_hdf5};
use crate::error::{Error, Result};

/// Refuses to replace a file that no command of haloray wrote, or a CSV that was changed since; an empty one holds nothing.
///
/// # Errors
/// [`Error::OutputPlace`].
pub fn check_own(path: &Path) -> Result<()> {
    let is_there = |path: &Path| std::fs::metadata(path).is_ok_and(|found| found.len() > 0);
    let refuse = |path: &Path| {
        let text = "it is there already, and no unchanged file of haloray; give another name, or allow it to be replaced (--overwrite, in Python overwrite=True)";
        Err(Error::OutputPlace { path: path.into(), source: IoError::new(ErrorKind::AlreadyExists, text) })
    };
    let beside = provenance_file(path);
    if matches!(Format::of(path), Ok(Format::Csv)) && is_there(&beside) && provenance_beside(path).is_none() {
        return refuse(&beside);
    }
    if !is_there(path) || is_own(path) { Ok(()) } else { refuse(path) }
}

fn is_own(path: &Path) -> bool {
    match Format::of(path) {
        Ok(Format::Csv) => provenance_beside(path).is_some_and(|of| of == csv_hash(path)),
        Ok(Format::Hdf5) => sealed_hdf5::is_own(path),
        Ok(Format::Fits) => fits_file::is_own(path),
        Err(_) => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::containers::{Column, Provenance, Table};

    #[test]
    fn only_what_haloray_wrote_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let table = Table::new(vec![Column::f64("x", None, vec![1.0])]).unwrap();
        for name in ["t.csv", "t.h5", "t.fits"] {
            let path = folder.path().join(name);
            check_own(&path).unwrap();
            table.write(&path, "rays", &Provenance::new(None, "")).unwrap();
            check_own(&path).unwrap();
            let other = folder.path().join(format!("other_{name}"));
            std::fs::write(&other, "").unwrap();
            check_own(&other).unwrap();
            std::fs::write(&other, "x\n1\n").unwrap();
            let error = check_own(&other).unwrap_err();
            assert!(error.is_bad_input() && error.to_string().contains("--overwrite"), "{error}");
        }
        // Each is as good as before, and holds another number.
        let units = fits_file::read(&folder.path().join("t.fits")).unwrap();
        let path = folder.path().join("t.fits");
        let bytes = std::fs::read(&path).unwrap();
        assert_eq!(units.len(), 2);
        let at = bytes.len() - 2880;
        std::fs::write(&path, [&bytes[..at], &2.0_f64.to_be_bytes(), &bytes[at + 8..]].concat()).unwrap();
        assert!(check_own(&path).unwrap_err().to_string().contains("t.fits: it is there already"));
        let path = folder.path().join("t.h5");
        hdf5::File::open_rw(&path)
            .unwrap()
            .group("rays")
            .unwrap()
            .dataset("x")
            .unwrap()
            .write(&[2.0])
            .unwrap();
        assert!(check_own(&path).unwrap_err().to_string().contains("t.h5: it is there already"));
        let path = folder.path().join("t.csv");
        std::fs::write(&path, "x,mine\n1,2\n").unwrap();
        assert!(check_own(&path).unwrap_err().to_string().contains("t.csv: it is there already"));
        let notes = folder.path().join("notes.csv.provenance.toml");
        std::fs::write(&notes, "my notes\n").unwrap();
        let error = check_own(&folder.path().join("notes.csv")).unwrap_err().to_string();
        assert!(error.contains("notes.csv.provenance.toml"), "{error}");
    }
}
