//! `haloray ensemble`, `merge` and `status`: the same sightlines however the work is cut up, and whatever interrupts it.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use haloray::io::{AttributeValue, RunFileReader, SightlineTable};

use crate::folder::Folder;
use crate::quick_run::succeeds;

/// A few hundred haloes a sightline.
const SMALL: &str = "[haloes]\nmin_point_shear = 1e-4\n[image]\npixels = 12\n[maps]\npoints = 9\n";
const LENSES: &str = "name,z_lens,z_source,einstein_radius_arcsec\na,0.3,0.9,0.8\nb,0.6,2.0,1.4\n";

fn folder() -> Folder {
    Folder::with(&[("small.toml", SMALL), ("lenses.csv", LENSES)])
}

/// Files of one folder with their bytes.
fn files_of(folder: &Folder, name: &str) -> BTreeMap<PathBuf, Vec<u8>> {
    let strip =
        |(path, bytes): (PathBuf, Vec<u8>)| Some((path.strip_prefix(name).ok()?.to_path_buf(), bytes));
    folder.files().into_iter().filter_map(strip).collect()
}

fn assert_same_files(folder: &Folder, one: &str, other: &str) {
    let [one, other] = [one, other].map(|name| files_of(folder, name));
    assert!(one.len() > 8, "{:?}", one.keys());
    assert!(one.keys().eq(other.keys()));
    for (name, bytes) in &one {
        assert!(*bytes == other[name], "{}", name.display());
    }
}

fn table(folder: &Folder, name: &str) -> SightlineTable {
    SightlineTable::read(&folder.path(name).join("sightlines.h5")).unwrap()
}

/// Every number of `row` that a run has too has its bits.
fn assert_is_simulated(folder: &Folder, table: &SightlineTable, row: usize, run: &str) {
    let file = RunFileReader::open(&folder.path(run).join("run.h5")).unwrap();
    let text = std::fs::read_to_string(folder.path(run).join("summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&text).unwrap();
    let mut compared = 0;
    for column in &table.all_haloes {
        let got = column.values[row];
        if let Ok(wanted) = file.read_attribute("diagnostics/all_haloes", &column.name) {
            let AttributeValue::F64(wanted) = wanted else { panic!("{}", column.name) };
            assert_eq!(got.to_bits(), wanted.to_bits(), "{}: {got} {wanted}", column.name);
            compared += 1;
        }
        let of_summary = summary.get(&column.name).or(summary["matter"].get(&column.name));
        if let Some(wanted) = of_summary.and_then(serde_json::Value::as_f64) {
            // JSON is read to the last digit but one.
            assert!((got - wanted).abs() <= 1e-15 * wanted.abs(), "{}: {got} {wanted}", column.name);
            compared += 1;
        }
    }
    assert!(compared > 60, "{compared}");
}

#[test]
fn a_sightline_is_the_same_alone_in_a_shard_on_any_threads_and_in_a_simulation() {
    let folder = folder();
    succeeds(&folder, "ensemble small.toml -n 5 --seed 5 -o whole --quiet");
    succeeds(&folder, "ensemble small.toml -n 5 --seed 5 -o again --quiet --threads 1");
    assert_same_files(&folder, "whole", "again");
    std::fs::create_dir(folder.path("parts")).unwrap();
    for shard in ["2/3", "1/3", "3/3"] {
        let name = shard.replace('/', "-");
        succeeds(
            &folder,
            &format!("ensemble small.toml -n 5 --seed 5 --shard {shard} -o parts/{name} --quiet"),
        );
    }
    let status = succeeds(&folder, "status parts");
    assert!(status.contains("parts/2-3: complete, 2 sightlines (1–2 of 0–4)"), "{status}");
    assert!(status.contains("3 parts: 5 of 5 sightlines"), "{status}");
    succeeds(&folder, "merge parts -o merged --quiet");
    assert_same_files(&folder, "whole", "merged");
    succeeds(&folder, "ensemble small.toml --sightline 3 --seed 5 -o one --quiet");
    succeeds(&folder, "simulate small.toml --sightline 3 --seed 5 -o run --quiet");
    let (whole, one) = (table(&folder, "whole"), table(&folder, "one"));
    assert_eq!(
        (whole.numbers.as_slice(), one.numbers.as_slice()),
        ([0, 1, 2, 3, 4].as_slice(), [3].as_slice())
    );
    for (all, alone) in whole.all_haloes.iter().zip(&one.all_haloes) {
        assert_eq!(all.values[3].to_bits(), alone.values[0].to_bits(), "{}", all.name);
    }
    assert_is_simulated(&folder, &whole, 3, "run");
    // A duplicate is told of; what is missing or of another seed is refused and nothing written.
    let merged = folder.haloray("merge parts/1-3 parts/2-3 parts/3-3 parts/1-3 -o twice --quiet");
    assert!(merged.status.success());
    assert!(String::from_utf8_lossy(&merged.stderr).contains("a duplicate of other parts"));
    assert_same_files(&folder, "whole", "twice");
    let before = folder.files();
    for (command, wanted) in [
        ("merge parts/1-3 parts/3-3 -o bad", "2 of 5 sightlines are in no part: 1–2"),
        ("merge parts/1-3 one -o bad", "sightlines 3 to 3, which overlap with 0 to 4"),
        ("merge nowhere -o bad", "nowhere"),
        ("status bad", "a folder of `haloray ensemble`"),
        ("ensemble small.toml -n 3 --shard 1/5 -o bad", "--shard is 1/5"),
        ("ensemble -n 3 --shard 0/5 -o bad", "I/K"),
        ("ensemble -n 3 --level all -o bad", "scalars, maps, images, fits"),
    ] {
        folder.check_failure(2, &folder.haloray(command), command, &[wanted]);
        assert!(folder.files() == before, "{command}");
    }
}

#[test]
fn lenses_of_a_table_take_turns_and_images_are_those_of_simulations() {
    let folder = folder();
    let command = "ensemble small.toml -n 2 --lenses lenses.csv --level images --quiet";
    succeeds(&folder, &format!("{command} -o whole"));
    std::fs::create_dir(folder.path("parts")).unwrap();
    for shard in ["1", "2"] {
        succeeds(&folder, &format!("{command} --shard {shard}/2 -o parts/{shard}"));
    }
    succeeds(&folder, "merge parts -o merged --quiet");
    assert_same_files(&folder, "whole", "merged");
    let whole = table(&folder, "whole");
    assert_eq!(whole.column("lens").unwrap(), [0.0, 1.0, 0.0, 1.0]);
    assert_eq!(whole.lenses.len(), 2);
    let own = "[line_of_sight]\nz_lens = 0.6\nz_source = 2.0\n[lens]\neinstein_radius_arcsec = 1.4\n";
    std::fs::write(folder.path("b.toml"), SMALL.to_string() + own).unwrap();
    succeeds(&folder, "simulate b.toml --sightline 3 -o run --quiet");
    assert_is_simulated(&folder, &whole, 3, "run");
    let run = RunFileReader::open(&folder.path("run/run.h5")).unwrap();
    let file = hdf5::File::open(folder.path("whole/sightlines.h5")).unwrap();
    for view in ["all_haloes", "tidal_haloes"] {
        for (of_stack, of_run) in [("", "noisy"), ("_noise_free", "noise_free")] {
            let (wanted, (ny, nx)) = run.read_2d(&format!("images/{view}"), of_run).unwrap();
            let stack: Vec<f32> =
                file.dataset(&format!("images/{view}{of_stack}")).unwrap().read_raw().unwrap();
            let layer = &stack[3 * ny * nx..4 * ny * nx];
            assert!(layer.iter().zip(&wanted).all(|(a, b)| *a == *b as f32), "{view} {of_run}");
        }
    }
    assert!(whole.column("gamma1_los_ring").unwrap().iter().all(|v| v.is_finite()));
    // Lens, counts, beams and flexions of the flexion model stand in the main group alone.
    assert_eq!(whole.tidal_haloes.len() + 26, whole.all_haloes.len());
}

#[test]
fn maps_are_kept_layer_by_layer() {
    let folder = folder();
    succeeds(&folder, "ensemble small.toml -n 2 --level maps -o maps --quiet");
    succeeds(&folder, "simulate small.toml --sightline 1 -o run --quiet");
    let run = RunFileReader::open(&folder.path("run/run.h5")).unwrap();
    let (wanted, _) = run.read_2d("maps", "gamma2").unwrap();
    let file = hdf5::File::open(folder.path("maps/sightlines.h5")).unwrap();
    let stack = file.dataset("maps/gamma2").unwrap();
    assert_eq!(stack.shape(), [2, 9, 9]);
    let layers: Vec<f32> = stack.read_raw().unwrap();
    assert!(layers[81..].iter().zip(&wanted).all(|(a, b)| *a == *b as f32));
}

/// Starts a command and waits until so many bytes of unfinished work are there.
#[cfg(unix)]
fn started(folder: &Folder, arguments: &str, bytes: u64) -> std::process::Child {
    let child = Command::new(env!("CARGO_BIN_EXE_haloray"))
        .args(arguments.split(' '))
        .current_dir(folder.path(""))
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let (start, log) = (Instant::now(), folder.path(".cut.haloray-ensemble"));
    while std::fs::metadata(&log).map_or(0, |found| found.len()) < bytes {
        assert!(start.elapsed() < Duration::from_secs(60), "no sightline ever ends");
        std::thread::sleep(Duration::from_millis(1));
    }
    child
}

#[cfg(unix)]
#[test]
fn whatever_interrupts_it_the_same_command_ends_with_the_same_bytes() {
    let folder = folder();
    let command = "ensemble small.toml -n 300 -o cut --quiet";
    succeeds(&folder, "ensemble small.toml -n 300 -o whole --quiet");
    let mut killed = started(&folder, command, 3000);
    killed.kill().unwrap();
    assert!(!killed.wait().unwrap().success());
    let status = succeeds(&folder, "status cut");
    assert!(status.contains("of 300 sightlines, stopped"), "{status}");
    let stopped = started(&folder, command, 9000);
    let id = stopped.id().to_string();
    assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    let output = stopped.wait_with_output().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(130), "{stderr}");
    assert!(stderr.contains("to continue: ") && stderr.contains("ensemble small.toml -n 300"), "{stderr}");
    let bytes = std::fs::metadata(folder.path(".cut.haloray-ensemble")).unwrap().len();
    assert!(bytes >= 9000);
    succeeds(&folder, command);
    assert_same_files(&folder, "whole", "cut");
    assert!(!folder.path(".cut.haloray-ensemble").exists());
}

/// Stands for Slurm: tasks run one after the other as they are submitted, and are known to the queue by what was submitted.
const SBATCH: &str = r#"#!/bin/bash
echo "$@" >> "$(dirname "$0")/submitted"
[ "$1" = --version ] && exit
script=${!#}
for task in $(seq "$(sed -n 's/^#SBATCH --array=1-//p' "$script" | grep . || echo 1)"); do
    SLURM_ARRAY_TASK_ID=$task bash "$script" >&2 || exit 1
done
echo "4$(grep -c parsable "$(dirname "$0")/submitted");cluster"
"#;
const SQUEUE: &str = "#!/bin/sh\necho RUNNING; echo PENDING; echo RUNNING\n";

#[test]
fn a_job_array_of_slurm_ends_with_the_bytes_of_one_process() {
    use std::os::unix::fs::PermissionsExt;
    let folder = folder();
    std::fs::create_dir(folder.path("tools")).unwrap();
    let on_cluster = |arguments: &str| {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin!("haloray"));
        let path = format!("{}:{}", folder.path("tools").display(), std::env::var("PATH").unwrap());
        command.current_dir(folder.path("")).env("PATH", path).env("HDF5_USE_FILE_LOCKING", "FALSE");
        command.args(arguments.split_whitespace()).output().unwrap()
    };
    for (name, text) in [("sbatch", SBATCH), ("squeue", SQUEUE)] {
        let path = folder.path("tools").join(name);
        std::fs::write(&path, text).unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
    }
    let ensemble = "ensemble small.toml -n 3 --first 1 --lenses lenses.csv --set seed=5";
    succeeds(&folder, &format!("{ensemble} -o alone --quiet"));
    let job =
        format!("{ensemble} --submit slurm --shards 4 --partition long --time 2-12:00 --memory 1G -o many");
    let written = on_cluster(&format!("{job} --no-submit"));
    assert!(written.status.success(), "{}", String::from_utf8_lossy(&written.stderr));
    assert!(!folder.path("tools/submitted").exists() && !folder.path("many").exists());
    let submitted = on_cluster(&job);
    let (out, err) = (String::from_utf8_lossy(&submitted.stdout), String::from_utf8_lossy(&submitted.stderr));
    assert!(submitted.status.success(), "{err}");
    assert!(out.contains("shards as job 41, their merge as job 42"), "{out}");
    let asked = std::fs::read_to_string(folder.path("tools/submitted")).unwrap();
    assert!(asked.contains("--dependency=afterok:41"), "{asked}");
    assert_same_files(&folder, "alone", "many");
    let script = std::fs::read_to_string(folder.path("many.parts/array.sh")).unwrap();
    assert!(
        script.contains("\n#SBATCH --partition=long\n#SBATCH --time=2-12:00\n#SBATCH --mem=1G\n"),
        "{script}"
    );
    let status = on_cluster("status many.parts");
    let told = String::from_utf8(status.stdout).unwrap();
    assert!(told.contains("4 parts: 6 of 6 sightlines\nqueue: 1 pending, 2 running\n"), "{told}");
    let other = on_cluster(&job.replace("seed=5", "seed=6"));
    folder.check_failure(2, &other, "another seed", &["shards of another ensemble"]);
    let sbatch = folder.path("tools/sbatch");
    std::fs::write(&sbatch, "#!/bin/sh\n[ \"$1\" = --version ] || { echo no such partition >&2; exit 1; }\n")
        .unwrap();
    let refused = on_cluster(&job.replace("-o many", "-o none"));
    let told = String::from_utf8(refused.stderr).unwrap();
    assert!(told.contains("no such partition") && told.contains("taken by sbatch"), "{told}");
    assert!(refused.status.code() == Some(2) && !folder.path("none.parts/jobs").exists());
    let many = on_cluster(&job.replace("--shards 4", "--shards 7"));
    folder.check_failure(2, &many, "too many shards", &["at most as many shards as sightlines (6)"]);
}

#[test]
fn expected_shears_are_those_of_the_ensemble_with_the_same_discs_and_fall_with_smoothing() {
    let folder = folder();
    let options = "small.toml --preset consistent --lenses lenses.csv -n 6 --smoothing 60,5,60 --quiet";
    succeeds(&folder, &format!("study expected {options} -o expected"));
    succeeds(&folder, &format!("ensemble {options} -o whole --no-figures"));
    let (of_study, of_ensemble) = (table(&folder, "expected"), table(&folder, "whole"));
    assert_eq!(of_study.all_haloes, of_ensemble.all_haloes, "each radius once");
    assert!(of_study.column("gamma1_los_disc_5").is_some_and(|v| v.iter().all(|v| v.is_finite())));
    let csv = std::fs::read_to_string(folder.path("expected/expected.csv")).unwrap();
    let sigma = |lens: &str, over: &str| -> f64 {
        let row = csv.lines().find(|line| line.starts_with(lens) && line.split(',').nth(3) == Some(over));
        row.unwrap().split(',').nth(6).unwrap().parse().unwrap()
    };
    for lens in ["a,", "b,"] {
        assert!(sigma(lens, "disc 60") < sigma(lens, "disc 5"), "{csv}");
        assert!((sigma(lens, "ring") / sigma(lens, "axis") - 1.0).abs() < 0.5, "{csv}");
    }
    let result = std::fs::read_to_string(folder.path("expected/result.md")).unwrap();
    let bars: Vec<usize> =
        result.lines().filter(|l| l.starts_with('|')).map(|l| l.matches('|').count()).collect();
    assert!(bars.len() == 10 && bars.iter().all(|n| *n == bars[0]), "a cell with a bar in it: {result}");
    let page = std::fs::read_to_string(folder.path("expected/report.html")).unwrap();
    assert!(page.contains("--smoothing 60,5,60") && page.contains("--lenses lenses.csv"));
    let before = folder.files();
    for (command, wanted) in [
        ("study expected --lenses lenses.csv --smoothing 5,-1 -o bad", "radius of smoothing in arcsec is -1"),
        (
            "study expected --lenses lenses.csv --smoothing 9999 -o bad",
            "the cylinder of the haloes ends there",
        ),
        ("study expected --lenses none.csv -o bad", "none.csv"),
        ("study expected -o bad", "--lenses"),
    ] {
        folder.check_failure(2, &folder.haloray(command), command, &[wanted]);
        assert!(folder.files() == before, "{command}");
    }
}

#[test]
fn what_means_nothing_is_told_of_or_refused() {
    let folder = folder();
    std::fs::write(folder.path("near.csv"), "z_lens,z_source,einstein_radius\n0.5,1.5,0.8\n").unwrap();
    let output = folder.haloray("ensemble small.toml -n 1 --lenses near.csv --no-figures -o near");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && said.contains("not used: einstein_radius; known are name"), "{said}");
    for (arguments, wanted) in [
        ("ensemble small.toml -n 2 --shards 2 -o no", "--submit"),
        ("ensemble small.toml -n 2 --model tidal-flexion -o no", "left out without --level fits"),
    ] {
        let output = folder.haloray(arguments);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(2) && said.contains(wanted), "{arguments}: {said}");
        assert!(!folder.path("no").exists());
    }
}

#[test]
fn shards_of_a_preset_with_another_h0_are_those_of_one_process() {
    let folder = folder();
    let options = "--set cosmology.h0_km_s_mpc=73 --set structure.h0_km_s_mpc=73";
    let job = format!("ensemble small.toml --preset consistent {options} -n 2 --no-figures");
    succeeds(&folder, &format!("{job} -o direct"));
    succeeds(&folder, &format!("{job} --submit slurm --no-submit --shards 2 -o many"));
    assert!(succeeds(&folder, "status many.parts").contains("no shard has begun"));
    // As array.sh has it.
    for shard in 1..=2 {
        let parts = format!("--shard {shard}/2 -o many.parts/{shard}");
        succeeds(&folder, &format!("ensemble many.parts/config.toml -n 2 --no-figures {parts}"));
    }
    succeeds(&folder, "merge many.parts --no-figures -o many");
    let [many, direct] = ["many", "direct"].map(|name| files_of(&folder, name));
    assert!(many[&PathBuf::from("sightlines.h5")] == direct[&PathBuf::from("sightlines.h5")]);
}
