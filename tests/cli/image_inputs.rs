//! Images as other programs keep them: packed, in extensions, with other WCS keywords, kernels and units.

use std::fs;
use std::path::{Path, PathBuf};

use crate::folder::Folder;
use haloray::imaging::Psf;
use haloray::inference::model::{CompiledModel, LikelihoodKind, ModelDescription};
use haloray::inference::{ImageLikelihood, Observation};
use haloray::io::{ImageFile, PsfKernel, read_observation};
use haloray::monitor::Silent;

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
        ("gzip_1_steps.fits.fz", 5.001e-6),
        ("gzip_2.fits.fz", 6e-6),
        ("gzip_2_steps.fits.fz", 5.001e-6),
        ("gzip_2_lossless.fits.fz", 0.0),
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
fn what_is_not_used_may_be_packed_in_any_way_and_the_scale_may_stand_in_the_primary_header() {
    const BLOCK: usize = 2880;
    let folder = folder(&["image_ok.fits", "hcompress_1.fits.fz", "sci_silent.fits"]);
    let read = |name: &str| fs::read(folder.path(name)).unwrap();
    // The primary unit of the packed file is one empty block.
    let packed = read("hcompress_1.fits.fz").split_off(BLOCK);
    fs::write(folder.path("both.fits"), [read("image_ok.fits"), packed].concat()).unwrap();
    let ok = ImageFile::read(&folder.path("image_ok.fits")).unwrap();
    assert_eq!(ImageFile::read(&folder.path("both.fits")).unwrap().data, ok.data);

    let mut bytes = read("sci_silent.fits");
    let cards = |bytes: &[u8], name: &str| -> Vec<usize> {
        (0..bytes.len()).step_by(80).filter(|&at| bytes[at..].starts_with(name.as_bytes())).collect()
    };
    let scale = ["CDELT1", "CDELT2", "CD1_1", "CD2_2", "PIXSCALE"].map(|name| cards(&bytes, name)).concat();
    assert!(!scale.is_empty() && scale.iter().all(|at| *at >= BLOCK), "{scale:?}");
    for at in scale {
        bytes[at..at + 8].copy_from_slice(b"COMMENT ");
    }
    fs::write(folder.path("without.fits"), &bytes).unwrap();
    let error = ImageFile::read(&folder.path("without.fits")).unwrap_err().to_string();
    assert!(error.contains("has no pixel scale"), "{error}");
    let end = cards(&bytes, "END     ")[0];
    assert!(end + 160 <= BLOCK);
    bytes[end..end + 80].copy_from_slice(format!("{:<80}", "PIXSCALE=                  0.1").as_bytes());
    bytes[end + 80..end + 160].copy_from_slice(format!("{:<80}", "END").as_bytes());
    fs::write(folder.path("above.fits"), &bytes).unwrap();
    assert!((ImageFile::read(&folder.path("above.fits")).unwrap().pixel_scale_arcsec - 0.1).abs() < 1e-12);
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
        ("blank.fits", "is NaN; finite numbers only (BLANK is none)"),
        (
            "psffwhm_capacity_overflow.fits",
            "PSFFWHM is 9.223372036854776e18, but must be between 0 and the width of the image",
        ),
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
fn the_header_of_a_kernel_says_how_fine_it_is_and_the_likelihood_uses_it_so() {
    let image = ImageFile::read(&input("psf_half_pixel.fits")).unwrap();
    assert!(matches!(image.psf, Some(PsfKernel { nx: 21, ny: 21, oversampling: 2, .. })));
    let chi2 = |oversampling: usize| {
        let (mut observation, _) = read_observation(&input("psf_half_pixel.fits")).unwrap();
        let kernel = image.psf.clone().unwrap();
        observation.psf = Psf::kernel(kernel.nx, kernel.ny, kernel.data, oversampling).unwrap();
        chi2_of_the_truth(observation)
    };
    let (as_stated, as_pixels_of_the_image) = (chi2(2), chi2(1));
    assert!(as_stated < 1.1 && as_pixels_of_the_image > 1.5, "{as_stated}, {as_pixels_of_the_image}");
}

/// χ² per degree of freedom at the lens and the size of the source that an image was made with; the place of the source,
/// which is not known, is searched for.
fn chi2_of_the_truth(observation: Observation) -> f64 {
    let description = ModelDescription::parse(&fs::read_to_string(input("free5.toml")).unwrap()).unwrap();
    let model = CompiledModel::new(&description).unwrap();
    let names: Vec<String> = model.free.iter().map(|free| free.name.clone()).collect();
    let likelihood = ImageLikelihood::new(observation, model, LikelihoodKind::Gaussian, &Silent).unwrap();
    let at = |[x, y]: [f64; 2]| {
        let value = |name: &String| match name.rsplit('.').next().unwrap() {
            "theta_E" => 1.2,
            "R_sersic" => 0.25,
            "n_sersic" => 1.2,
            "center_x" => x,
            _ => y,
        };
        let free: Vec<f64> = names.iter().map(value).collect();
        likelihood.image(&free).map_or(f64::INFINITY, |image| likelihood.chi2_reduced(&image))
    };
    let (mut best, mut centre, mut step) = (f64::INFINITY, [0.0; 2], 0.05);
    while step > 5e-4 {
        let from = centre;
        for (i, j) in (-5..=5).flat_map(|i| (-5..=5).map(move |j| (i, j))) {
            let place = [from[0] + f64::from(i) * step, from[1] + f64::from(j) * step];
            let chi2 = at(place);
            if chi2 < best {
                (best, centre) = (chi2, place);
            }
        }
        step *= 0.3;
    }
    best
}
