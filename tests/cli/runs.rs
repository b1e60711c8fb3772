//! The commands as a user runs them, end to end: what they write, print, repeat and explain.

use std::fs;

use crate::folder::Folder;
use crate::quick_run::{SMALL, folder, numbers, succeeds};
use haloray::io::{ImageFile, Table};

fn json(text: &str) -> serde_json::Value {
    serde_json::from_str(text).unwrap()
}

#[test]
fn the_same_seed_gives_the_same_bytes_for_every_number_of_threads() {
    let folders = [folder(), folder()];
    for (folder, threads) in folders.iter().zip(["--threads 1", "--threads 2"]) {
        for command in [
            "simulate small.toml -o run",
            "map small.toml --preset consistent -o maps",
            "image small.toml --preset consistent -o image",
        ] {
            succeeds(folder, &format!("{command} {threads}"));
        }
    }
    let [one, two] = folders.map(|folder| folder.files());
    assert!(one.keys().eq(two.keys()));
    for (name, bytes) in &one {
        assert!(bytes == &two[name], "{} depends on the number of threads", name.display());
    }
}

#[test]
fn simulate_writes_everything_it_promises_and_nothing_else() {
    let folder = folder();
    let printed = succeeds(&folder, "simulate small.toml -o run");
    let figures = ["cylinder", "flexion_maps", "histograms", "images", "mass_function", "tidal_maps"];
    let images = ["all_haloes", "all_haloes_noise_free", "tidal_haloes", "tidal_haloes_noise_free"];
    let mut expected: Vec<String> =
        ["figures", "run.h5", "summary.json", "config.toml", "manifest.json", "report.html", "report.json"]
            .map(String::from)
            .into();
    expected.extend(figures.iter().flat_map(|f| [format!("figures/{f}.svg"), format!("figures/{f}.png")]));
    expected.extend(images.map(|name| format!("image_{name}.fits")));
    expected.sort();
    let files = folder.files();
    let found: Vec<String> =
        files.keys().filter_map(|f| Some(f.strip_prefix("run").ok()?.to_str()?.to_string())).collect();
    let found: Vec<String> = found.into_iter().filter(|name| !name.is_empty()).collect();
    assert_eq!(found, expected);
    let listed = printed.lines().find_map(|line| line.strip_prefix("files in run: ")).unwrap_or_default();
    let (told, more) = listed.rsplit_once(" and ").unwrap_or_default();
    let told: Vec<&str> = told.split(", ").collect();
    assert!(told[0] == "report.html" && told.contains(&"figures/ (12)") && listed.len() < 100, "{printed}");
    // All but the manifest, twelve figures as one entry.
    let more: usize = more.trim_end_matches(" more").parse().unwrap();
    assert_eq!(told.len() + more, expected.len() - 13, "{printed}");
    assert!(printed.find("γ_LOS") < printed.find("files in run"), "{printed}");

    for name in images {
        let path = folder.path(format!("run/image_{name}.fits"));
        let image = ImageFile::read(&path).unwrap();
        let k = image.keywords;
        assert_eq!((image.nx, image.ny, k.exposure_time_s), (12, 12, Some(5400.0)));
        assert!((k.background_rms_e_per_s.unwrap() / 0.005919973387690837 - 1.0).abs() < 1e-12);
        assert_eq!((k.psf_fwhm_arcsec, k.psf_truncation_sigma), (Some(0.08), Some(5.0)));
        assert_eq!((k.z_lens, k.z_source), (Some(0.5), Some(1.5)));
        let header = String::from_utf8_lossy(&fs::read(&path).unwrap()[..11520]).to_string();
        for keyword in ["CTYPE1  =", "CRPIX1  =", "BUNIT   =", "SEED    ="] {
            assert!(header.contains(keyword), "{name} lacks {keyword}");
        }
    }
}

#[test]
fn the_summary_has_the_documented_keys_and_agrees_with_the_run_file() {
    let folder = folder();
    succeeds(&folder, "simulate small.toml --seed 3 --draw brute-force -o run");
    let summary = json(&fs::read_to_string(folder.path("run/summary.json")).unwrap());
    assert_eq!(summary["seed"], 3);
    assert_eq!(summary["expected_number_in_cylinder"].as_f64().unwrap().round(), 10_642_020.0);
    let drawn = summary["number_drawn"].as_f64().unwrap();
    assert!((drawn - 10_642_020.0).abs() < 5.0 * 10_642_020f64.sqrt(), "{drawn}");
    for key in ["number_excluded_by_kappa", "number_above_kappa_warning", "largest_kappa_h"] {
        assert!(summary[key].is_number(), "{key}");
    }
    let haloes = Table::read(&folder.path("run/run.h5"), "haloes").unwrap();
    assert_eq!(summary["number_kept"], haloes.row_count());
    let beyond = numbers(&haloes, "delta_h").iter().filter(|delta| **delta >= 0.1).count();
    assert_eq!(summary["number_beyond_tidal"], beyond);
    for view in ["all_haloes", "tidal_haloes"] {
        for tensor in ["od", "os", "ds", "los", "los_linear"] {
            for quantity in ["kappa", "gamma1", "gamma2", "omega"] {
                assert!(summary[view][format!("{quantity}_{tensor}")].is_number());
            }
        }
        for key in ["delta_tot", "F1_os_per_arcsec", "G2_ds_per_arcsec", "lens_centre_x_arcsec"] {
            assert!(summary[view][key].is_number(), "{view} {key}");
        }
    }
}

#[test]
fn a_stored_configuration_and_a_printed_preset_repeat_the_run() {
    let folder = folder();
    succeeds(&folder, "simulate small.toml -o first");
    let stored = fs::read_to_string(folder.path("first/config.toml")).unwrap();
    let printed = succeeds(&folder, "schema --preset paper");
    let printed = printed
        .replace("min_point_shear = 1e-6", "min_point_shear = 1e-5")
        .replace("pixels = 64", "pixels = 12")
        .replace("points = 101", "points = 9");
    for (name, text, preset) in [("stored", stored, "consistent"), ("printed", printed, "paper")] {
        // Keys that `consistent` lacks or leaves out are in the stored file, which is complete.
        fs::write(folder.path("again.toml"), text).unwrap();
        succeeds(&folder, &format!("simulate again.toml --preset {preset} -o {name}"));
    }
    let files = folder.files();
    let run = |name: &str| -> Vec<_> {
        let inside = |(file, bytes): (&std::path::PathBuf, &Vec<u8>)| {
            Some((file.strip_prefix(name).ok()?.to_path_buf(), bytes.clone()))
        };
        files.iter().filter_map(inside).collect()
    };
    assert!(run("first").len() > 15);
    assert!(run("stored") == run("first"), "config.toml");
    assert!(run("printed") == run("first"), "schema --preset paper");
}

#[test]
fn the_schema_names_and_explains_every_key_of_the_presets() {
    let folder = folder();
    let schema = json(&succeeds(&folder, "schema"));
    let resolve = |value: &serde_json::Value| match value["$ref"].as_str() {
        Some(reference) => schema.pointer(reference.trim_start_matches('#')).unwrap().clone(),
        None => value.clone(),
    };
    for preset in ["paper", "consistent"] {
        let table: toml::Table = succeeds(&folder, &format!("schema --preset {preset}")).parse().unwrap();
        for (name, section) in table {
            let described = &schema["properties"][&name];
            assert!(described.is_object(), "{name}");
            for key in section.as_table().into_iter().flat_map(|section| section.keys()) {
                let property = &resolve(described)["properties"][key];
                let text = property["description"].as_str().unwrap_or("");
                assert!(!text.is_empty(), "{name}.{key} is not explained");
            }
        }
    }
}

#[test]
fn a_line_of_sight_without_haloes_is_simulated_as_empty_space() {
    let folder = folder();
    fs::write(folder.path("none.toml"), SMALL.replace("1e-5", "1e9")).unwrap();
    let printed = succeeds(&folder, "simulate none.toml -o run");
    assert!(printed.contains("0 on the line of sight") && printed.contains("undefined"), "{printed}");
    assert!(!printed.contains("NaN"), "{printed}");
    let summary = json(&fs::read_to_string(folder.path("run/summary.json")).unwrap());
    assert_eq!(summary["number_kept"], 0);
    assert_eq!(summary["all_haloes"]["kappa_los"], 0.0);
    assert!(summary["all_haloes"]["delta_tot"].is_null());
    assert!(folder.path("run/figures/histograms.png").is_file());
    succeeds(&folder, "map none.toml -o maps");
    succeeds(&folder, "image none.toml -o image");
}

#[test]
fn curves_enclose_the_einstein_disc_and_lie_in_every_file_that_was_asked_for() {
    let folder = folder();
    fs::write(folder.path("small.toml"), format!("{SMALL}[instrument]\npixel_scale_arcsec = 0.4\n")).unwrap();
    succeeds(&folder, "simulate small.toml --curves -o run");
    succeeds(&folder, "map small.toml --curves -o maps.h5");
    let all = haloray::io::RunFileReader::open(&folder.path("run/run.h5")).unwrap();
    let of_maps = haloray::io::RunFileReader::open(&folder.path("maps.h5")).unwrap();
    for (file, group) in
        [(&all, "images/all_haloes/curves"), (&all, "images/tidal_haloes/curves"), (&of_maps, "curves")]
    {
        let curves = haloray::io::read_curves(file, group).unwrap();
        let radius = curves.einstein_radius_arcsec().unwrap();
        assert!((radius - 1.5).abs() < 0.1, "{group}: {radius}");
    }
    succeeds(&folder, "map small.toml -o plain.h5");
    let plain = haloray::io::RunFileReader::open(&folder.path("plain.h5")).unwrap();
    assert!(!plain.names("").unwrap().contains(&"curves".to_string()));
}

#[test]
fn the_cut_study_counts_more_haloes_below_lower_cuts_and_refuses_impossible_ones() {
    let folder = folder();
    let printed = succeeds(&folder, "study cut small.toml --cuts 1e-4,1e-5 -o cut");
    assert!(["cut.csv", "cut.svg", "cut.png"].iter().all(|file| printed.contains(file)), "{printed}");
    let table = Table::read(&folder.path("cut/cut.csv"), "").unwrap();
    assert_eq!(numbers(&table, "min_point_shear"), [1e-4, 1e-5]);
    let haloes = numbers(&table, "number_of_haloes");
    assert!(haloes[0] > 0.0 && haloes[0] < haloes[1], "{haloes:?}");
    // The last line is what the others are compared with.
    let difference = numbers(&table, "image_chi2");
    assert!(difference[0] > 0.0 && difference[1] == 0.0, "{difference:?}");
    let refused = folder.haloray("study cut small.toml --cuts -1 -o other");
    folder.check_failure(2, &refused, "study cut --cuts -1", &["--cuts is -1", "at least 0 and below 1"]);
    assert!(!folder.path("other").exists());
}

#[test]
fn a_refused_run_leaves_an_earlier_one_as_it_was() {
    let folder = folder();
    succeeds(&folder, "simulate small.toml -o run");
    fs::remove_file(folder.path("run/summary.json")).unwrap();
    fs::create_dir(folder.path("run/summary.json")).unwrap();
    let before = folder.files();
    let command = "simulate small.toml --seed 2 -o run";
    let wanted = ["cannot write to run/summary.json: it is a folder"];
    folder.check_failure(2, &folder.haloray(command), command, &wanted);
    assert!(folder.files() == before, "files of both runs are mixed");
}

#[test]
fn quiet_commands_print_nothing() {
    let folder = folder();
    for command in [
        "simulate small.toml -o run",
        "populate small.toml -o haloes.csv",
        "trace --haloes haloes.csv --points points.csv --z-source 1.5 -o rays.csv",
        "map small.toml -o maps",
        "image small.toml -o image.fits",
    ] {
        assert!(!succeeds(&folder, command).is_empty(), "{command}");
        assert_eq!(succeeds(&folder, &format!("{command} --quiet")), "", "{command}");
    }
}

#[test]
fn help_teaches_by_example_and_names_units() {
    let folder = folder();
    let version = format!("haloray {}", env!("CARGO_PKG_VERSION"));
    assert_eq!(succeeds(&folder, "-V"), version.clone() + "\n");
    assert_eq!(succeeds(&folder, "--version"), format!("{version} ({})\n", env!("HALORAY_GIT_REVISION")));
    assert!(succeeds(&folder, "--help").contains("haloray simulate -o run"));
    for (command, wanted) in [
        ("simulate", "--seed"),
        ("populate", "r_s_arcsec"),
        ("trace", "per arcsec"),
        ("map", "ARCSEC"),
        ("image", "e⁻/s"),
        ("schema", "--preset paper"),
        ("completions", "bash"),
    ] {
        let help = succeeds(&folder, &format!("{command} --help"));
        assert!(help.contains(wanted), "{help}");
        assert!(help.contains("Example") && help.contains(&format!("  haloray {command}")), "{help}");
    }
    assert_eq!(folder.haloray("").status.code(), Some(2));
}

#[test]
fn completions_know_the_subcommands() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = succeeds(&folder(), &format!("completions {shell}"));
        assert!(script.contains("simulate") && script.contains("populate"), "{shell}");
    }
}

#[test]
fn a_folder_belongs_to_one_run_and_a_user_keeps_what_is_the_users() {
    let folder = folder();
    fs::create_dir(folder.path("run")).unwrap();
    fs::write(folder.path("run/config.toml"), "mine").unwrap();
    let command = "simulate small.toml -o run";
    let wanted = ["cannot write to run/config.toml", "--overwrite"];
    folder.check_failure(2, &folder.haloray(command), command, &wanted);
    assert_eq!(fs::read_to_string(folder.path("run/config.toml")).unwrap(), "mine");
    succeeds(&folder, &format!("{command} --overwrite"));
    fs::write(folder.path("run/notes.txt"), "mine").unwrap();
    // Another command into the same folder: the run's own files go, the notes stay.
    let other = folder.haloray("image small.toml -o run");
    let said = String::from_utf8_lossy(&other.stderr).into_owned();
    assert!(
        other.status.success()
            && said.contains("note: run: an earlier run's ")
            && said.contains("more files"),
        "{said}"
    );
    assert!(folder.path("run/image.fits").is_file() && !folder.path("run/run.h5").exists());
    assert!(!folder.path("run/figures").exists());
    assert_eq!(fs::read_to_string(folder.path("run/notes.txt")).unwrap(), "mine");
    let names: Vec<_> = fs::read_dir(folder.path("run")).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert!(names.iter().all(|name| !name.to_string_lossy().starts_with('.')), "{names:?}");
}

#[test]
fn one_sightline_of_a_study_can_be_made_alone() {
    let folder = folder();
    succeeds(&folder, "study tidal small.toml -n 3 -o all");
    succeeds(&folder, "study tidal small.toml --sightline 2 -o one");
    let last = |name: &str| {
        let text = fs::read_to_string(folder.path(name).join("residuals.csv")).unwrap();
        text.lines().last().unwrap().to_string()
    };
    assert_eq!(last("all"), last("one"));
    succeeds(&folder, "populate small.toml --sightline 2 -o haloes.csv");
    let haloes = Table::read(&folder.path("haloes.csv"), "").unwrap();
    let row = Table::read(&folder.path("one/residuals.csv"), "").unwrap();
    assert!(haloes.row_count() as f64 >= numbers(&row, "number_of_haloes")[0]);
    assert_ne!(folder.haloray("study tidal small.toml --sightline 2 -n 3 -o x").status.code(), Some(0));
}

#[test]
fn settings_follow_or_are_refused() {
    let haloes = "z,theta_x_arcsec,theta_y_arcsec,r_s_arcsec,alpha_rs_arcsec\n0.5,0,0,1.0,0.1\n";
    let own = format!("{SMALL}\n").replace("[haloes]\n", "[haloes]\ncatalogue = \"haloes.csv\"\n");
    let folder = folder();
    fs::write(folder.path("haloes.csv"), haloes).unwrap();
    fs::write(folder.path("axis.csv"), "theta_x_arcsec,theta_y_arcsec\n0,0\n1,0\n").unwrap();
    fs::write(folder.path("own.toml"), own).unwrap();
    for study in ["tidal", "cut", "haloes", "which-shear", "validity"] {
        let command = format!("study {study} own.toml -o study");
        folder.check_failure(
            2,
            &folder.haloray(&command),
            &command,
            &["haloes.catalogue", "draws its haloes"],
        );
    }
    let command = "distances 2 --z-source 1";
    folder.check_failure(2, &folder.haloray(command), command, &["--z-source is 1", "2 is one"]);
    // One halo at the centre: κ_h(0) has no bound.
    let output = folder.haloray("trace --haloes haloes.csv --points axis.csv --z-source 1.5 -o rays.csv");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && stderr.contains("κ has no bound"), "{stderr}");
    assert!(String::from_utf8_lossy(&output.stdout).contains("sheets: on-axis, κ = −"), "{output:?}");
    let command = "image --set haloes.catalogue=haloes.csv --set image.pixels=12 -o image.fits";
    folder.check_failure(2, &folder.haloray(command), command, &["must be off the axis ray"]);
    fs::write(folder.path("near.csv"), haloes.replace("0.5,0,0", "0.5,0.001,0")).unwrap();
    let output = folder.haloray("image --set haloes.catalogue=near.csv --set image.pixels=12 -o image.fits");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && stderr.contains("κ has no bound"), "{output:?}");
    let none = succeeds(
        &folder,
        "trace --haloes haloes.csv --points axis.csv --z-source 1.5 --sheets none -o rays.csv",
    );
    assert!(none.contains("sheets: none"), "{none}");
    let rays = Table::read(&folder.path("rays.csv"), "").unwrap();
    assert!((numbers(&rays, "beta_x_arcsec")[1] - 0.9).abs() < 1e-12);
    // A built-in model is printed as it can be extended, one line a prior.
    let model = succeeds(&folder, "fit --list --model simple-minimal");
    fs::write(
        folder.path("more.toml"),
        model.clone()
            + "\n[[lens_light]]\nprofile = \"SERSIC\"\n[lens_light.parameters]\n\
        R_sersic = 0.5\nn_sersic = 4.0\n",
    )
    .unwrap();
    succeeds(&folder, "fit --list --model more.toml");
    assert!(model.lines().any(|line| line.contains("uniform = [") && line.contains(']')), "{model}");
}

#[cfg(target_os = "linux")]
#[test]
fn full_outputs_and_refused_threads_are_errors_and_no_panics() {
    use std::process::Command;
    let folder = folder();
    let full = || fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let run = |arguments: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_haloray"));
        command.args(arguments.split(' ')).current_dir(folder.path(""));
        command
    };
    for arguments in ["fit --list", "distances 0.5", "images model.json --source 0.3,0", "ensemble --help"] {
        fs::write(folder.path("model.json"), WIDE_LENS).unwrap();
        let output = run(arguments).stdout(full()).output().unwrap();
        folder.check_failure(1, &output, arguments, &["cannot write to standard output"]);
    }
    let output = run("populate small.toml -o haloes.csv").stderr(full()).stdout(full()).output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    let output = run("populate none.toml -o haloes.csv").stderr(full()).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    // Closed, not full.
    for redirect in [">&-", "2>&-", "<&- >&- 2>&-"] {
        let script = format!("\"$0\" populate small.toml -o closed.csv {redirect}");
        let mut shell = Command::new("sh");
        let status =
            shell.args(["-c", &script, env!("CARGO_BIN_EXE_haloray")]).current_dir(folder.path("")).status();
        assert_eq!(status.unwrap().code(), Some(0), "{redirect}");
    }
    // No room for the stacks of so many threads.
    let script = "ulimit -v 6000000; \"$0\" populate small.toml -o many.csv --threads 1024";
    let mut shell = Command::new("sh");
    shell.args(["-c", script, env!("CARGO_BIN_EXE_haloray")]).current_dir(folder.path(""));
    let output = shell.env("RUST_MIN_STACK", "67108864").output().unwrap();
    folder.check_failure(2, &output, script, &["--threads is 1024", "possible here"]);
}

const WIDE_LENS: &str =
    r#"{"z_lens": 0.5, "z_source": 1.5, "lens_model_list": ["SIS"], "kwargs_lens": [{"theta_E": 3.0}]}"#;

#[test]
fn haloes_in_the_plane_of_the_lens_are_part_of_it() {
    let config = "[haloes]\ncatalogue = \"mine.csv\"\n[image]\npixels = 12\n[maps]\npoints = 9\n";
    let haloes = "z,theta_x_arcsec,theta_y_arcsec,m200c_msun,c200c\n0.5,3.0,1.0,1e11,8\n";
    let folder = Folder::with(&[("my.toml", config), ("mine.csv", haloes)]);
    let output = folder.haloray("simulate my.toml -o run");
    assert!(output.status.success(), "{output:?}");
    let told = String::from_utf8_lossy(&output.stdout);
    assert!(told.contains("1 halo at the redshift of the lens: part of the lens"), "{told}");
    let text = std::fs::read_to_string(folder.path("run/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&text).unwrap();
    let all = &summary["all_haloes"];
    assert_eq!([&all["number_of_haloes"], &all["number_in_lens_plane"]], [1.0, 1.0]);
    assert_eq!([&all["gamma1_los"], &all["gamma1_os"]], [0.0, 0.0], "{all}");
}

#[test]
fn an_image_that_cannot_show_its_ring_or_source_is_doubted() {
    let folder = folder();
    for (key, word) in [
        ("lens.einstein_radius_arcsec=1500", "its ring lies far outside"),
        ("instrument.pixel_scale_arcsec=100", "no ring can be seen in them"),
        ("source.radius_arcsec=900", "its light fills all of it"),
    ] {
        let output = folder.haloray(&format!("image small.toml --set {key} -o image.fits"));
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(
            output.status.success() && told.contains("warning: ") && told.contains(word),
            "{key}: {told}"
        );
    }
}
