//! Full disks, killed runs and closed pipes: nothing half-written is ever seen under a final name.
#![cfg(unix)]

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::folder::Folder;

const BINARY: &str = env!("CARGO_BIN_EXE_haloray");
/// Long enough to be killed in the middle, about a second.
const CONFIG: &str = "[image]\npixels = 12\n[maps]\npoints = 21\n";

#[test]
fn a_full_disk_fails_the_run_and_keeps_the_former_files() {
    let folder = Folder::with(&[
        ("my.toml", CONFIG),
        ("quick.toml", "[haloes]\nmin_point_shear = 1e-5"),
        ("old.csv", "z\n1\n"),
        ("old.h5", "former"),
    ]);
    for (command, written) in [
        ("populate -o haloes.csv", "haloes.csv"),
        ("populate -o old.csv --overwrite", "old.csv"),
        ("populate -o haloes.fits", "haloes.fits"),
        ("populate -o old.h5 --overwrite", "old.h5"),
        ("simulate my.toml -o run", "run/run.h5"),
        ("map quick.toml --grid-points 61 -o maps", "maps/maps.h5"),
        ("map quick.toml --grid-points 61 -o maps.h5", "maps.h5"),
        ("image -o image", "image/"),
    ] {
        let before = folder.files();
        // A limit on the size of files stands for the end of the disk; the signal that comes with it is ignored.
        let script = format!("trap '' XFSZ; ulimit -f 32; exec \"$0\" {command}");
        let output =
            Command::new("sh").args(["-c", &script, BINARY]).current_dir(folder.path("")).output().unwrap();
        let wanted = [&format!("writing {written}"), " failed: ", "hint: is the disk full?"];
        folder.check_failure(1, &output, command, &wanted);
        assert!(folder.files() == before, "{command} left something behind");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_result_that_cannot_be_printed_fails() {
    let folder = Folder::with(&[]);
    let full = || fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    for command in ["schema", "completions"] {
        let arguments: &[&str] = if command == "schema" { &[command] } else { &[command, "bash"] };
        let output = Command::new(BINARY).args(arguments).stdout(full()).output().unwrap();
        folder.check_failure(1, &output, command, &["cannot write to standard output"]);
    }
}

#[test]
fn a_closed_pipe_is_no_error() {
    let haloes = "z,theta_x_arcsec,theta_y_arcsec,r_s_arcsec,alpha_rs_arcsec\n0.5,1,2,3,0.1\n";
    let folder = Folder::with(&[("haloes.csv", haloes)]);
    for command in [
        "schema",
        "schema --preset paper",
        "completions bash",
        "--help",
        "trace --haloes haloes.csv --points haloes.csv --z-source 1.5 -o rays.csv",
    ] {
        let mut child = Command::new(BINARY)
            .args(command.split(' '))
            .current_dir(folder.path(""))
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success() && output.stderr.is_empty(), "{command}: {output:?}");
    }
    assert!(folder.path("rays.csv").is_file());
}

/// True once a staging folder below `run` holds a file of that name.
fn is_staged(run: &Path, name: &str) -> bool {
    let Ok(entries) = fs::read_dir(run) else { return false };
    entries.flatten().any(|entry| entry.path().join(name).exists())
}

#[test]
fn a_killed_run_shows_no_result_and_the_same_command_succeeds_afterwards() {
    let folder = Folder::with(&[("my.toml", CONFIG)]);
    let run = folder.path("run");
    for moment in [".haloray-lock", "run.h5", "figures"] {
        let mut child = Command::new(BINARY)
            .args(["simulate", "my.toml", "-o", "run", "--quiet"])
            .current_dir(folder.path(""))
            .spawn()
            .unwrap();
        let start = Instant::now();
        while !is_staged(&run, moment) {
            assert!(start.elapsed() < Duration::from_secs(60), "{moment} never appears");
            std::thread::sleep(Duration::from_millis(1));
        }
        child.kill().unwrap();
        assert!(!child.wait().unwrap().success());
        for entry in fs::read_dir(&run).unwrap() {
            let name = entry.unwrap().file_name().into_string().unwrap();
            assert!(name.starts_with(".haloray-"), "killed at {moment}, but there is {name}");
        }
    }
    assert!(folder.haloray("simulate my.toml -o run").status.success());
    assert!(run.join("run.h5").is_file() && run.join("figures/images.png").is_file());
    #[cfg(target_os = "linux")] // elsewhere stale staging folders are left alone
    assert!(fs::read_dir(&run).unwrap().all(|e| !e.unwrap().file_name().to_string_lossy().starts_with('.')));
}
