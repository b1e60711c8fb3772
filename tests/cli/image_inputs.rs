//! Images as other programs keep them: packed, in extensions, with other WCS keywords, kernels and units.

use std::fs;
use std::path::{Path, PathBuf};

use crate::folder::Folder;
use haloray::io::{ImageFile, PsfKernel};
use serde_json::Value;

fn input(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data/inputs").join(name)
}

fn folder(names: &[&str]) -> Folder {
    let folder = Folder::with(&[]);
    for name in names.iter().chain(&["free5.toml"]) {
        fs::copy(input(name), folder.path(name)).unwrap();
    }
    folder
}

#[test]
fn an_image_is_the_same_packed_in_an_extension_and_by_another_wcs() {
    let ok = ImageFile::read(&input("image_ok.fits")).unwrap();
    for (name, tolerance) in [
        ("gzipped.fits.gz", 0.0),
        ("gzip_1.fits.fz", 0.0),
        ("gzip_2.fits.fz", 0.0),
        ("rice_1.fits.fz", 5e-6),
        ("scaled.fits", 5e-5),
        ("sci_inherit.fits", 0.0),
        ("sci_silent.fits", 0.0),
        ("wcs_to_header.fits", 0.0),
    ] {
        let found = ImageFile::read(&input(name)).unwrap_or_else(|error| panic!("{error}"));
        let largest = found.data.iter().zip(&ok.data).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(largest <= tolerance && found.data.len() == ok.data.len(), "{name}: {largest}");
        assert_eq!(found.keywords, ok.keywords, "{name}");
        assert!((found.pixel_scale_arcsec / 0.1 - 1.0).abs() < 1e-9, "{name}: {}", found.pixel_scale_arcsec);
    }
}

#[test]
fn images_that_say_too_little_or_too_much_are_refused() {
    let folder = folder(&[
        "sci_alone.fits",
        "two_bands.fits",
        "hcompress_1.fits.fz",
        "blank.fits",
        "psffwhm_capacity_overflow.fits",
    ]);
    for (name, wanted) in [
        ("sci_alone.fits", "EXPTIME is missing"),
        ("two_bands.fits", "give one alone EXTNAME = 'SCI'; its extensions are: F814W, F606W"),
        (
            "hcompress_1.fits.fz",
            "is compressed by HCOMPRESS_1; RICE_1, GZIP_1 and GZIP_2 are read, funpack unpacks all",
        ),
        ("blank.fits", "is NaN; finite numbers only, which BLANK is not"),
        ("psffwhm_capacity_overflow.fits", "PSFFWHM is 9223372036854775807"),
    ] {
        let fit = format!("fit {name} --model free5.toml --threads 1 -o o");
        let output = folder.haloray(&fit);
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        let without_notes: Vec<&str> = stderr.lines().filter(|line| !line.starts_with("note: ")).collect();
        assert_eq!(output.status.code(), Some(2), "{name}: {stderr}");
        assert!(
            without_notes[0].starts_with("error: ") && without_notes[0].contains(wanted),
            "{name}: {stderr}"
        );
        assert!(without_notes[0].contains(name) && !folder.path("o").exists(), "{name}: {stderr}");
    }
}

#[test]
fn the_header_of_a_kernel_says_how_fine_it_is_and_a_fit_uses_it_so() {
    let image = ImageFile::read(&input("psf_half_pixel.fits")).unwrap();
    assert!(matches!(image.psf, Some(PsfKernel { nx: 21, ny: 21, oversampling: 2, .. })));
    let folder = folder(&["psf_half_pixel.fits"]);
    let fit =
        "fit psf_half_pixel.fits --model free5.toml --pixel-sampling point --min-ess 200 --threads 1 -o o";
    let output = folder.haloray(fit);
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        stderr.contains("note: psf_half_pixel.fits: the PSF has 2×2 pixels for one of the image"),
        "{stderr}"
    );
    let summary: Value = serde_json::from_slice(&fs::read(folder.path("o/summary.json")).unwrap()).unwrap();
    let parameters = summary["parameters"].as_array().unwrap();
    for (name, truth, tolerance) in
        [("R_sersic", 0.25, 0.03), ("n_sersic", 1.2, 0.2), ("theta_E", 1.2, 0.006)]
    {
        let found = parameters.iter().find(|p| p["name"].as_str().unwrap().contains(name)).unwrap();
        let median = found["median"].as_f64().unwrap();
        assert!((median - truth).abs() < tolerance, "{name}: {median} instead of {truth}");
    }
}
