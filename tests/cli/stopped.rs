//! Ctrl-C and SIGTERM: an end within a second, exit code 130 or 143, what is kept and how to go on, nothing half-written.
#![cfg(unix)]

use std::fs;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use haloray::io::Provenance;

use crate::folder::Folder;
use crate::small_image::{self, MODEL};

const BINARY: &str = env!("CARGO_BIN_EXE_haloray");
/// The command ends within a second; a busy machine may take longer to notice.
const END: Duration = Duration::from_secs(5);

/// Runs a command, sends the signal once `is_time`, and says what came of it.
fn stop(folder: &Folder, arguments: &str, signal: &str, is_time: impl Fn() -> bool) -> Output {
    let mut child = Command::new(BINARY)
        .args(arguments.split(' '))
        .current_dir(folder.path(""))
        .env("HDF5_USE_FILE_LOCKING", "FALSE")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let start = Instant::now();
    while !is_time() {
        assert!(start.elapsed() < Duration::from_secs(120), "{arguments}: the moment never comes");
        assert!(child.try_wait().unwrap().is_none(), "{arguments} ended before it was stopped");
        std::thread::sleep(Duration::from_millis(1));
    }
    let sent = Instant::now();
    assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    println!("{arguments}: stopped within {:?}", sent.elapsed());
    assert!(sent.elapsed() < END, "{arguments}: {:?}", sent.elapsed());
    output
}

/// Checks exit code and message; returns stderr.
fn check(output: &Output, code: i32, arguments: &str, wanted: &[&str]) {
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments}: {stderr}");
    for text in wanted.iter().copied().chain([arguments]) {
        assert!(stderr.contains(text), "{arguments}: without {text:?}: {stderr}");
    }
    assert!(!stderr.contains("error:") && !stderr.contains("panicked"), "{arguments}: {stderr}");
}

/// True once a staging folder has appeared in that folder.
fn has_begun(folder: &Folder, output: &str) -> bool {
    let Ok(entries) = fs::read_dir(folder.path(output)) else { return false };
    entries.flatten().any(|entry| entry.path().join(".haloray-lock").exists())
}

#[test]
fn long_commands_end_at_once_and_leave_nothing() {
    let folder = Folder::with(&[]);
    for (arguments, signal, code, first) in [
        ("simulate --draw brute-force -o out", "-INT", 130, "stopped by Ctrl-C"),
        ("study cut --quiet -o out", "-INT", 130, "stopped by Ctrl-C"),
    ] {
        let output = stop(&folder, arguments, signal, || has_begun(&folder, "out"));
        check(&output, code, arguments, &[first, "to begin again: "]);
        let said = String::from_utf8_lossy(&output.stderr).contains("removed: what was half-written in out");
        assert_eq!(said, !arguments.contains("--quiet"), "{arguments}");
        assert!(output.stdout.is_empty() && folder.files().is_empty(), "{arguments}: {:?}", folder.files());
    }
}

#[test]
fn studies_and_mocks_keep_what_has_ended_and_end_with_the_same_bytes() {
    let small = "[image]\npixels = 12\n[maps]\npoints = 9\n[haloes]\nmin_point_shear = 1e-5\n";
    let folder = Folder::with(&[("small.toml", small)]);
    for (command, signal, code) in [
        ("mock -n 300 -o", "-TERM", 143),
        ("study tidal small.toml -n 12 -o", "-INT", 130),
        (
            "study validity small.toml --set instrument.pixel_scale_arcsec=0.3 -n 8 --views all --starts truth --estimate laplace -o",
            "-INT",
            130,
        ),
        ("study calibration -n 2 -o", "-TERM", 143),
    ] {
        let (arguments, state) = (format!("{command} out"), folder.path(".out.haloray-study"));
        let output = stop(&folder, &arguments, signal, || state.exists());
        check(
            &output,
            code,
            &arguments,
            &["kept: what has been done in .out.haloray-study", "to continue: "],
        );
        assert!(!folder.path("out").exists(), "{arguments}");
        assert!(folder.haloray(&arguments).status.success() && !state.exists(), "{arguments}");
        let continued = folder.files();
        assert!(folder.haloray(&format!("{command} other")).status.success());
        let files = folder.files();
        let mut pairs = 0;
        for (name, bytes) in
            continued.iter().filter(|(name, bytes)| name.starts_with("out") && !bytes.is_empty())
        {
            let other = std::path::Path::new("other").join(name.strip_prefix("out").unwrap());
            assert!(files[&other] == *bytes, "{arguments}: {}", name.display());
            pairs += 1;
        }
        assert!(pairs > 2, "{arguments}");
        fs::remove_dir_all(folder.path("out")).unwrap();
        fs::remove_dir_all(folder.path("other")).unwrap();
    }
}

#[test]
fn a_damaged_state_is_told_of_and_the_work_begins_anew() {
    let folder = Folder::with(&[]);
    fs::write(folder.path(".out.haloray-study"), "damaged").unwrap();
    let output = folder.haloray("mock -n 4 -o out");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && stderr.contains("is damaged; the work begins anew"), "{output:?}");
    assert!(!folder.path(".out.haloray-study").exists());
}

#[test]
fn a_warm_up_and_a_catalogue_end_at_once_and_go_on() {
    let truth = "image,gamma1_los,gamma2_los\nimage.fits,0,0\nother.fits,0,0\n";
    let folder = Folder::with(&[("small.toml", MODEL), ("truth.csv", truth)]);
    for (name, number) in [("image.fits", 0), ("other.fits", 1)] {
        let image = small_image::image([0.0, 0.0], number);
        image.write(&folder.path(name), &Provenance::new(None, "")).unwrap();
    }
    // The start is saved, and the warm-up of the sampler follows.
    let arguments = "fit image.fits --model small.toml --sampler nuts --seed 5 --threads 1 -o fit";
    let state = folder.path(".fit.haloray-fit");
    let output = stop(&folder, arguments, "-INT", || state.exists());
    check(&output, 130, arguments, &["kept: the state of the fit in .fit.haloray-fit", "to continue: "]);
    let saved = fs::read(&state).unwrap();
    let output = stop(&folder, arguments, "-INT", || fs::read(&state).is_ok_and(|now| now != saved));
    check(&output, 130, arguments, &["kept: the state of the fit", "to continue: "]);
    assert!(folder.haloray(arguments).status.success() && !state.exists());

    let model = MODEL.replace("[[lens]]", "[line_of_sight]\nmodel = \"minimal\"\n[line_of_sight.parameters]\n\
        gamma1_od = 0.0\ngamma2_od = 0.0\ngamma1_los = { uniform = [-0.1, 0.1] }\ngamma2_los = { uniform = [-0.1, 0.1] }\n\
        omega_los = 0.0\n\n[[lens]]");
    fs::write(folder.path("sheared.toml"), model).unwrap();
    let arguments = "study catalogue . --models sheared.toml --threads 1 -o study";
    let fits = folder.path("study/fits");
    let output = stop(&folder, arguments, "-TERM", || fits.exists());
    check(&output, 143, arguments, &["kept: the fits that have ended in study/fits", "to continue: "]);
    assert!(!folder.path("study/fits.csv").exists());
    let output = folder.haloray(arguments);
    assert!(output.status.success(), "{output:?}");
    let lines = String::from_utf8_lossy(&output.stdout).lines().filter(|l| l.contains("image.fits")).count();
    assert_eq!(lines, 0, "an ended fit is repeated: {output:?}");
    assert!(folder.path("study/fits.csv").exists());
}

#[test]
fn a_trace_ends_at_once_and_keeps_the_former_table() {
    let folder = Folder::with(&[("rays.csv", "former")]);
    assert!(folder.haloray("populate -o haloes.h5").status.success());
    let rows: String =
        (0..400_000).map(|i| format!("{},{}\n", f64::from(i % 1000) / 500.0, i / 1000)).collect();
    fs::write(folder.path("points.csv"), format!("theta_x_arcsec,theta_y_arcsec\n{rows}")).unwrap();
    let before = folder.files();
    let arguments = "trace --haloes haloes.h5 --points points.csv --z-source 1.5 --accuracy exact -o rays.csv --overwrite";
    let start = Instant::now();
    let output = stop(&folder, arguments, "-INT", || start.elapsed() > Duration::from_millis(1500));
    check(&output, 130, arguments, &["stopped by Ctrl-C", "kept: nothing"]);
    assert!(folder.files() == before, "something was left behind");
}

#[test]
fn a_fit_that_was_stopped_continues_and_ends_with_the_same_posterior() {
    let folder = Folder::with(&[("small.toml", MODEL)]);
    small_image::image([0.0, 0.0], 0).write(&folder.path("image.fits"), &Provenance::new(None, "")).unwrap();
    let before = folder.files();
    let arguments = "fit image.fits --model small.toml --sampler nuts --seed 3 -o fit";
    let output = stop(&folder, arguments, "-INT", || has_begun(&folder, "fit"));
    check(&output, 130, arguments, &["stopped by Ctrl-C", "removed: what was half-written in fit"]);
    fs::remove_file(folder.path(".fit.haloray-fit")).ok();
    assert!(folder.files() == before, "something was left behind");

    let state = folder.path(".fit.haloray-fit");
    let output = stop(&folder, arguments, "-TERM", || state.exists());
    check(&output, 143, arguments, &["kept: the state of the fit in .fit.haloray-fit", "to continue: "]);
    assert!(!folder.path("fit").exists());
    assert!(folder.haloray(arguments).status.success());
    assert!(folder.haloray(&arguments.replace("-o fit", "-o whole")).status.success());
    let posterior = |fit: &str| fs::read(folder.path(fit).join("posterior.nc")).unwrap();
    assert!(posterior("fit") == posterior("whole"), "posteriors differ");
    assert!(!state.exists());
}

#[test]
fn a_second_signal_ends_without_patience_and_closed_outputs_do_not_matter() {
    let folder = Folder::with(&[]);
    let mut child = Command::new(BINARY)
        .args(["simulate", "--draw", "brute-force", "-o", "out"])
        .current_dir(folder.path(""))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop((child.stdout.take(), child.stderr.take()));
    while !has_begun(&folder, "out") {
        assert!(child.try_wait().unwrap().is_none());
        std::thread::sleep(Duration::from_millis(1));
    }
    for _ in 0..2 {
        let _ = Command::new("kill").args(["-INT", &child.id().to_string()]).stderr(Stdio::null()).status();
    }
    let sent = Instant::now();
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(sent.elapsed() < END && folder.files().is_empty());
}
