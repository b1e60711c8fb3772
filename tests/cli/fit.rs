//! `haloray fit` from the command line: results, convergence, bad input, and fits that are killed.

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::folder::Folder;
use crate::small_image::{self, MODEL, SIDE};
use haloray::io::{ImageFile, Provenance, PsfKernel};
use serde_json::Value;

fn image() -> ImageFile {
    small_image::image([0.0, 0.0], 0)
}

fn save(folder: &Folder, image: &ImageFile) {
    image.write(&folder.path("image.fits"), &Provenance::new(None, "")).unwrap();
}

fn folder() -> Folder {
    let folder = Folder::with(&[("small.toml", MODEL)]);
    save(&folder, &image());
    folder
}

fn summary(folder: &Folder, fit: &str) -> Value {
    let text = std::fs::read_to_string(folder.path(fit).join("summary.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

fn posterior(folder: &Folder, fit: &str) -> Vec<u8> {
    std::fs::read(folder.path(fit).join("posterior.nc")).unwrap()
}

#[test]
fn a_fit_finds_what_the_image_was_made_with_on_any_number_of_threads() {
    let folder = folder();
    for threads in [1, 2] {
        let arguments =
            format!("fit image.fits --model small.toml -o fit{threads} --quiet --threads {threads}");
        let output = folder.haloray(&arguments);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    assert!(posterior(&folder, "fit1") == posterior(&folder, "fit2"), "posteriors differ");
    let fitted = std::fs::read_to_string(folder.path("fit1/model.toml")).unwrap();
    assert!(fitted.contains("pixel_sampling = \"point\""), "PIXSAMP of the image is not heeded: {fitted}");
    let summary = summary(&folder, "fit1");
    for key in ["chi2_reduced", "p_value", "evaluations", "worst_r_hat", "worst_ess", "log_likelihood"] {
        assert!(summary[key].is_number(), "{key}: {}", summary[key]);
    }
    assert_eq!(summary["converged"], true);
    assert_eq!(summary["good_fit"], true);
    assert_eq!(summary["warnings"], Value::Array(vec![]));
    let same = |name: &str| {
        let [one, two] = [1, 2].map(|k| std::fs::read(folder.path(format!("fit{k}")).join(name)).unwrap());
        assert!(one == two, "{name} differs");
    };
    ["summary.json", "model.toml", "corner.svg"].into_iter().for_each(same);
    let timings = std::fs::read_to_string(folder.path("fit1/timings.json")).unwrap();
    assert!(timings.contains("seconds"));
    assert!((summary["chi2_reduced"].as_f64().unwrap() - 1.0).abs() < 0.25);
    let parameters = summary["parameters"].as_array().unwrap();
    assert_eq!(parameters.len(), 6);
    for parameter in parameters {
        for key in ["mean", "median", "best_fit", "hpd68_low", "hpd68_high", "r_hat", "ess_bulk", "ess_tail"]
        {
            assert!(parameter[key].is_number(), "{key} of {parameter}");
        }
        assert!(parameter["unit"].is_string() && parameter["bounded"] == true, "{parameter}");
    }
    let truths = [("lens.theta_E", 1.1), ("lens.e1", 0.05), ("lens.e2", -0.08), ("source.R_sersic", 0.3)];
    for (name, truth) in truths {
        let found = parameters.iter().find(|p| p["name"] == name).unwrap();
        let number = |key: &str| found[key].as_f64().unwrap();
        let pull = (number("mean") - truth) / number("standard_deviation");
        assert!(pull.abs() < 4.0, "{name}: {found}");
    }
    let written = folder.files();
    for file in ["model.toml", "corner.svg", "trace.svg", "reconstruction.svg", "source.svg"] {
        assert!(written.keys().any(|path| path.ends_with(file)), "no {file}");
    }
    assert!(!written.keys().any(|path| path.to_string_lossy().contains("haloray-fit")), "a checkpoint stays");
}

#[test]
fn a_profile_stands_beside_the_posterior_of_the_parameters_that_are_named() {
    let folder = folder();
    let refused = folder.haloray("fit image.fits --model small.toml -o fit --profile lens.theta_E,theta");
    let told = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(refused.status.code() == Some(2) && !folder.path("fit").exists(), "{told}");
    assert!(
        ["--profile", "theta", "lens.theta_E", "source.R_sersic"].iter().all(|word| told.contains(word)),
        "{told}"
    );

    let output = folder.haloray("fit image.fits --model small.toml -o fit --profile lens.theta_E,lens.e1");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(printed.contains("profile likelihood"), "{printed}");
    let summary = summary(&folder, "fit");
    let profiles = summary["profiles"].as_array().unwrap();
    assert_eq!(profiles.len(), 2);
    for profile in profiles {
        let parameters = summary["parameters"].as_array().unwrap();
        let fitted = parameters.iter().find(|p| p["name"] == profile["name"]).unwrap();
        let end = |key: &str, i: usize| profile[key][i].as_f64().unwrap();
        // A nearly normal posterior under wide priors: both intervals are one.
        let posterior = fitted["hpd68_high"].as_f64().unwrap() - fitted["hpd68_low"].as_f64().unwrap();
        let ratio = (end("interval68", 1) - end("interval68", 0)) / posterior;
        assert!((ratio - 1.0).abs() < 0.2, "{ratio}: {profile} {fitted}");
        let wider = (end("interval95", 1) - end("interval95", 0)) / posterior;
        assert!((wider - 2.0).abs() < 0.4, "{wider}: {profile}");
        let median = fitted["median"].as_f64().unwrap();
        assert!(end("interval68", 0) < median && median < end("interval68", 1), "{profile} {fitted}");
    }
    assert!(folder.path("fit/profiles.svg").exists());
}

#[test]
fn a_fit_that_does_not_converge_keeps_its_results_and_exits_1() {
    let folder = folder();
    let output = folder.haloray("fit image.fits --model small.toml -o fit --max-draws 20 --quiet");
    assert_eq!(output.status.code(), Some(1), "{}", String::from_utf8_lossy(&output.stderr));
    let summary = summary(&folder, "fit");
    assert_eq!(summary["converged"], false);
    assert!(summary["worst_ess"].as_f64().unwrap() < 400.0);
    assert!(!posterior(&folder, "fit").is_empty());
}

#[test]
fn a_fit_goes_on_to_the_effective_size_that_is_wanted() {
    let folder = folder();
    let output = folder.haloray("fit image.fits --model small.toml -o fit --min-ess 2500 --quiet");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(summary(&folder, "fit")["worst_ess"].as_f64().unwrap() > 2500.0);
    let arguments = "fit image.fits --model small.toml -o other --min-ess 300";
    folder.check_failure(2, &folder.haloray(arguments), arguments, &["--min-ess is 300", "at least 400"]);
}

#[test]
fn an_image_with_a_mask_and_a_kernel_is_fitted() {
    let folder = folder();
    let mut image = image();
    image.keywords.psf_fwhm_arcsec = None;
    image.keywords.psf_truncation_sigma = None;
    let mut kernel = vec![0.02; 9];
    kernel[4] = 0.84;
    image.psf = Some(PsfKernel { data: kernel, nx: 3, ny: 3, oversampling: 1 });
    // A pixel without a value is no fault where the mask leaves it out.
    let mut mask = vec![true; SIDE * SIDE];
    (mask[7], image.data[7]) = (false, f64::NAN);
    image.mask = Some(mask);
    save(&folder, &image);
    let output = folder.haloray("fit image.fits --model small.toml -o fit --max-draws 8 --quiet");
    assert_eq!(output.status.code(), Some(1), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(summary(&folder, "fit")["chi2_reduced"].is_number());
}

#[test]
fn all_models_are_explained() {
    let folder = Folder::with(&[]);
    let output = folder.haloray("fit --list");
    let text = String::from_utf8(output.stdout).unwrap();
    for name in ["simple-full", "simple-minimal", "tidal-minimal", "tidal-flexion"] {
        let line = text.lines().find(|line| line.starts_with(name));
        assert!(line.is_some_and(|line| line.len() > name.len() + 40), "{name} in {text}");
        let model = folder.haloray(&format!("fit --list --model {name}"));
        let model = String::from_utf8(model.stdout).unwrap();
        assert!(model.contains("[lens.parameters.theta_E]") || model.contains("theta_E ="), "{model}");
    }
}

/// Runs a fit that must be refused and leave nothing.
fn assert_refused(folder: &Folder, model: &str, wanted: &[&str]) {
    let before = folder.files();
    let arguments = format!("fit image.fits --model {model} -o fit");
    let output = folder.haloray(&arguments);
    folder.check_failure(2, &output, &arguments, wanted);
    assert!(folder.files() == before, "{wanted:?}: something was left behind");
}

#[test]
fn images_that_cannot_be_fitted_are_refused() {
    let kernel = |value: f64| Some(PsfKernel { data: vec![value; 9], nx: 3, ny: 3, oversampling: 1 });
    type Edit = Box<dyn Fn(&mut ImageFile)>;
    let edits: Vec<(Edit, Vec<&str>)> = vec![
        (Box::new(|i| i.keywords.exposure_time_s = None), vec!["EXPTIME is missing", "in s", "fit --help"]),
        (Box::new(|i| i.keywords.background_rms_e_per_s = None), vec!["BKGRMS is missing", "fit --help"]),
        (Box::new(|i| i.keywords.background_rms_e_per_s = Some(-0.01)), vec!["BKGRMS is -0.01"]),
        (Box::new(|i| i.keywords.psf_fwhm_arcsec = None), vec!["PSFFWHM is missing", "extension PSF"]),
        (Box::new(move |i| i.psf = kernel(1.0 / 9.0)), vec!["PSFFWHM is 0.16", "beside an extension PSF"]),
        (
            Box::new(move |i| (i.psf, i.keywords.psf_fwhm_arcsec) = (kernel(0.2), None)),
            vec!["sum of the PSF kernel is 1.79", "sums to 1"],
        ),
        (Box::new(|i| i.keywords.z_lens = Some(1.5)), vec!["ZLENS is 1.5", "below ZSOURCE"]),
        (Box::new(|i| i.mask = Some(vec![false; SIDE * SIDE])), vec!["number of pixels in use is 0", "MASK"]),
    ];
    for (edit, wanted) in edits {
        let folder = folder();
        let mut image = image();
        edit(&mut image);
        save(&folder, &image);
        assert_refused(&folder, "small.toml", &wanted);
    }
}

#[test]
fn models_that_cannot_be_meant_are_refused() {
    let edited = |from: &str, to: &str| {
        assert!(MODEL.contains(from));
        let folder = folder();
        std::fs::write(folder.path("small.toml"), MODEL.replacen(from, to, 1)).unwrap();
        folder
    };
    let list = "fit --list";
    assert_refused(&folder(), "simple", &["the model is simple", "simple-minimal", list]);
    assert_refused(&folder(), "none.toml", &["none.toml"]);
    assert_refused(
        &edited("[[source]]", "[[sorce]]"),
        "small.toml",
        &["sorce", "small.toml", "line 12", "column", list],
    );
    let flat = edited("uniform = [0.5, 2.0]", "uniform = [0.5, 0.5]");
    assert_refused(&flat, "small.toml", &["prior of lens.theta_E", "above the lower edge", list]);
    // A power law exists only for slopes below 3.
    let steep = edited("gamma = 2.1", "gamma = { uniform = [3.2, 4.0] }");
    assert_refused(&steep, "small.toml", &["no model", "gamma is 3.6", "below 3", list]);
    let unknown = edited("gamma = 2.1", "slope = 2.1");
    assert_refused(&unknown, "small.toml", &["parameter of EPL is slope", "theta_E, gamma", list]);
    assert_refused(&edited("\"EPL\"", "\"BLOB\""), "small.toml", &["BLOB", list]);
    let folder = folder();
    let arguments = "fit image.fits --model small.toml -o fit --sampler nested --max-draws 9";
    folder.check_failure(2, &folder.haloray(arguments), arguments, &["--max-draws is 9", "left out"]);
}

#[cfg(unix)]
#[test]
fn a_fit_killed_at_any_moment_ends_with_the_same_posterior() {
    let folder = folder();
    let arguments =
        |output: &str| format!("fit image.fits --model small.toml -o {output} --max-draws 3000 --quiet");
    let spawn = || {
        let mut command = Command::new(env!("CARGO_BIN_EXE_haloray"));
        command.env("HDF5_USE_FILE_LOCKING", "FALSE").current_dir(folder.path(""));
        command
            .args(arguments("killed").split(' '))
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap()
    };
    folder.haloray(&arguments("whole"));
    let checkpoint = folder.path(".killed.haloray-fit");
    let mut continued = 0;
    // Before the first state is saved, then after each new one, as often as the fit lets itself be caught.
    let mut child = spawn();
    std::thread::sleep(Duration::from_millis(3));
    child.kill().unwrap();
    child.wait().unwrap();
    for _ in 0..4 {
        let before = std::fs::read(&checkpoint).ok();
        let mut child = spawn();
        let start = Instant::now();
        while std::fs::read(&checkpoint).ok() == before {
            assert!(start.elapsed() < Duration::from_secs(60), "no state is saved");
            if child.try_wait().unwrap().is_some() {
                break;
            }
        }
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(!folder.path("killed/posterior.nc").exists() || !checkpoint.exists(), "half-written");
        continued += usize::from(checkpoint.exists());
    }
    assert!(continued > 1, "the fit was never caught with a saved state");
    folder.haloray(&arguments("killed"));
    assert!(posterior(&folder, "killed") == posterior(&folder, "whole"), "posteriors differ");
    assert!(!checkpoint.exists());
}

#[test]
fn a_fit_says_whether_its_model_describes_the_image() {
    let folder = folder();
    // A second source that the model lacks.
    let mut image = image();
    let bright = |k: usize| (k % SIDE).abs_diff(15) + (k / SIDE).abs_diff(4) < 3;
    let rms = image.keywords.background_rms_e_per_s.unwrap();
    image.data.iter_mut().enumerate().filter(|(k, _)| bright(*k)).for_each(|(_, v)| *v += 8.0 * rms);
    save(&folder, &image);
    std::fs::write(folder.path("truth.json"), r#"{"lens.theta_E": 1.1, "lens.mass": 3}"#).unwrap();
    let arguments = "fit image.fits --model small.toml --truth truth.json -o fit";
    let wanted = ["truth.json", "the fit has no lens.mass", "lens.theta_E"];
    folder.check_failure(2, &folder.haloray(arguments), arguments, &wanted);
    let twice = r#"{"lens.theta_E": 1.1, "lens.theta_E": 1.2}"#;
    std::fs::write(folder.path("truth.json"), twice).unwrap();
    folder.check_failure(
        2,
        &folder.haloray(arguments),
        arguments,
        &["truth.json", "lens.theta_E stands there twice"],
    );
    let output = folder.haloray("fit image.fits --model small.toml --max-draws 40 -o fit");
    let (summary, stdout) = (summary(&folder, "fit"), String::from_utf8_lossy(&output.stdout).into_owned());
    assert_eq!(summary["good_fit"], false, "{summary}");
    assert!(summary["p_value"].as_f64().unwrap() < 1e-3);
    assert!(summary["largest_residual_sigma"].as_f64().unwrap() > 6.0, "{summary}");
    let first = |text: &str| stdout.find(text).unwrap_or_else(|| panic!("no {text}: {stdout}"));
    assert!(
        first("NOT A GOOD FIT") < first("median") && first("does not describe the image") < first("median"),
        "{stdout}"
    );
    let figure = std::fs::read_to_string(folder.path("fit/corner.svg")).unwrap();
    assert!(figure.contains("Not a good fit"));
}

#[test]
fn what_contradicts_the_image_is_told_at_the_start() {
    type Edit = Box<dyn Fn(&mut ImageFile)>;
    let small =
        MODEL.replace("uniform = [0.5, 2.0]", "uniform = [0.5, 0.6]").replace("[0.3, 0.5]", "[0.1, 0.2]");
    let edits: Vec<(Edit, &str, &str)> = vec![
        (Box::new(|i| i.keywords.background_rms_e_per_s = Some(1e-5)), MODEL, "BKGRMS = 0.00001"),
        (
            Box::new(|i| {
                let limit = 3.0 * i.keywords.background_rms_e_per_s.unwrap();
                i.mask = Some(i.data.iter().map(|value| *value < limit).collect());
            }),
            MODEL,
            "MASK looks inverted",
        ),
        (
            Box::new(|i| i.data[SIDE + 1] += 100.0),
            &small,
            "no light of the model comes near the brightest pixels",
        ),
        (
            Box::new(|i| i.mask = Some((0..i.data.len()).map(|k| k < 2).collect())),
            MODEL,
            "2 pixels are in use and",
        ),
    ];
    for (edit, model, wanted) in edits {
        let folder = Folder::with(&[("small.toml", model)]);
        let mut image = image();
        edit(&mut image);
        save(&folder, &image);
        let output =
            folder.haloray("fit image.fits --model small.toml --sampler stretch --max-draws 4 -o fit");
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(stderr.contains(wanted), "{wanted}: {stderr}");
    }
}

#[test]
fn a_fit_of_what_is_not_there_ends_with_its_files() {
    // A lens off the image: nothing is magnified, and draws are stuck at the edges of their priors.
    let round =
        MODEL.replace("e1 = { normal = [0.0, 0.1] }\ne2 = { normal = [0.0, 0.1] }\n", "center_x = 30.0\n");
    assert!(round != MODEL);
    let folder = Folder::with(&[("off.toml", &round)]);
    save(&folder, &image());
    let output = folder.haloray(
        "fit image.fits --model off.toml --pixel-sampling point --sampler stretch --max-draws 8 -o fit",
    );
    assert!(!String::from_utf8_lossy(&output.stderr).contains("panicked"), "{output:?}");
    assert!(matches!(output.status.code(), Some(0 | 1)), "{output:?}");
    assert!(folder.path("fit/posterior.nc").is_file() && folder.path("fit/summary.json").is_file());
}
