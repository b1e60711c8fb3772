//! `haloray study catalogue` from the command line: fits are never repeated, and what cannot be fitted is left out.

use crate::folder::Folder;
use crate::small_image;
use haloray::io::{Provenance, Table, Values};

const GAMMA_LOS: [[f64; 2]; 3] = [[0.02, -0.01], [-0.03, 0.01], [0.0, 0.03]];

/// Three images with their truths, and two models: one fits, the other's priors exclude everything.
fn folder() -> Folder {
    let model = small_image::MODEL.replace(
        "[[lens]]",
        "[line_of_sight]\nmodel = \"minimal\"\n[line_of_sight.parameters]\ngamma1_los = { uniform = [-0.5, 0.5] }\n\
         gamma2_los = { uniform = [-0.5, 0.5] }\n\n[[lens]]",
    );
    let model =
        model.replace("e1 = { normal = [0.0, 0.1] }\ne2 = { normal = [0.0, 0.1] }", "e1 = 0.05\ne2 = -0.08");
    let steep =
        model.replace("\"small\"", "\"steep\"").replace("gamma = 2.1", "gamma = { uniform = [3.2, 4.0] }");
    assert!(steep.contains("3.2") && model.contains("e1 = 0.05"));
    let mut truth = String::from("image,gamma1_los,gamma2_los,quality\n");
    for (i, [g1, g2]) in GAMMA_LOS.into_iter().enumerate() {
        truth += &format!("{i}.fits,{g1},{g2},{}\n", 1000 + i);
    }
    let folder = Folder::with(&[("small.toml", &model), ("steep.toml", &steep), ("truth.csv", &truth)]);
    for (i, gamma_los) in GAMMA_LOS.into_iter().enumerate() {
        let image = small_image::image(gamma_los, i as u64);
        image.write(&folder.path(format!("{i}.fits")), &Provenance::new(None, "")).unwrap();
    }
    folder
}

/// Standard output of a command that succeeds.
fn printed(folder: &Folder, arguments: &str) -> String {
    let output = folder.haloray(arguments);
    assert!(output.status.success(), "{arguments}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

fn read(folder: &Folder, file: &str) -> String {
    std::fs::read_to_string(folder.path(file)).unwrap()
}

#[test]
fn a_study_that_was_stopped_repeats_no_fit_and_ends_with_the_same_table() {
    let folder = folder();
    let fitted = |text: &str| text.lines().filter(|line| line.contains(".fits  small")).count();
    assert_eq!(fitted(&printed(&folder, "study catalogue . --models small.toml -o whole")), 3);
    assert_eq!(fitted(&printed(&folder, "study catalogue . --models small.toml -o parts --first 1")), 1);
    // What a killed study leaves of a fit that had not ended is no fit.
    let half = folder.path("parts/fits/small/1_fits/recovery.json");
    std::fs::create_dir_all(half.parent().unwrap()).unwrap();
    std::fs::write(half, "{\"key\":").unwrap();
    assert_eq!(fitted(&printed(&folder, "study catalogue . --models small.toml -o parts")), 2);
    assert_eq!(fitted(&printed(&folder, "study catalogue . --models small.toml -o parts")), 0);
    for file in ["fits.csv", "table.md", "scores.json"] {
        assert_eq!(
            read(&folder, &format!("parts/{file}")),
            read(&folder, &format!("whole/{file}")),
            "{file}"
        );
    }
    let scores: serde_json::Value = serde_json::from_str(&read(&folder, "whole/scores.json")).unwrap();
    assert_eq!((&scores[0]["images"], &scores[0]["productive"]), (&3.into(), &3.into()), "{scores}");
    assert!(scores[0]["largest_residual"].as_f64().unwrap() < 4.0, "{scores}");
    // Another seed is another study.
    assert_eq!(
        fitted(&printed(&folder, "study catalogue . --models small.toml -o parts --first 1 --seed 2")),
        1
    );
}

#[test]
fn profile_likelihoods_are_scored_where_they_are_asked_for() {
    let folder = folder();
    let table = printed(&folder, "study catalogue . --models small.toml -o study --first 2 --profile");
    assert!(table.contains("coverage of 68%, profile") && table.contains("χ², profile"), "{table}");
    let scores: serde_json::Value = serde_json::from_str(&read(&folder, "study/scores.json")).unwrap();
    assert!(scores[0]["profile_coverage"].as_f64().is_some_and(|c| (0.0..=1.0).contains(&c)), "{scores}");
    let fits = Table::read(&folder.path("study/fits.csv"), "").unwrap();
    let of = |name: &str| match &fits.column(name).unwrap().values {
        Values::F64(values) => values.clone(),
        Values::Text(_) => panic!("{name} is text"),
    };
    for a in ["gamma1_los", "gamma2_los"] {
        let [low, best, high] = ["low", "best_fit", "high"].map(|end| of(&format!("{a}_profile_{end}")));
        let (median, sd) = (of(&format!("{a}_out")), of(&format!("{a}_sd")));
        for i in 0..2 {
            assert!(low[i] < best[i] && best[i] < high[i], "{a} {i}: {} {} {}", low[i], best[i], high[i]);
            // Everything else is fixed or measured well: both say the same.
            assert!((best[i] - median[i]).abs() < sd[i], "{a} {i}: {} {}", best[i], median[i]);
            assert!((0.5 * (high[i] - low[i]) / sd[i] - 1.0).abs() < 0.3, "{a} {i}");
        }
    }
    // Without profiles it is another study.
    let without = printed(&folder, "study catalogue . --models small.toml -o study --first 1");
    assert!(!without.contains("profile") && without.contains("1/1"), "{without}");
}

#[test]
fn what_cannot_be_fitted_is_named_and_left_out() {
    let folder = folder();
    let both = folder.haloray("study catalogue . --models small.toml,steep.toml -o both --first 1");
    let warnings = String::from_utf8_lossy(&both.stderr);
    assert!(both.status.success(), "{warnings}");
    assert!(warnings.contains("no fit of 0.fits with steep") && warnings.contains("below 3"), "{warnings}");
    assert!(String::from_utf8_lossy(&both.stdout).contains("1 of 2 fits"));
    let none = folder.haloray("study catalogue . --models steep.toml -o none --first 1");
    assert_eq!(none.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&none.stderr).contains("number of fits is 0"));
    let small = std::fs::read_to_string(folder.path("small.toml")).unwrap();
    let lines = small.lines().filter(|line| !line.contains("gamma2_los")).collect::<Vec<_>>().join("\n");
    assert_ne!(lines, small.trim_end());
    std::fs::write(folder.path("blind.toml"), lines).unwrap();
    let blind = "study catalogue . --models blind.toml -o none";
    folder.check_failure(2, &folder.haloray(blind), blind, &["gamma1_los and gamma2_los among"]);
    assert!(!folder.path("none").exists());
}

#[test]
fn a_truth_table_without_what_is_needed_is_refused() {
    let folder = folder();
    let arguments = "study catalogue . --models small.toml -o study";
    for (table, wanted) in [
        ("image,gamma1_los\n0.fits,0\n", "gamma2_los"),
        ("image,gamma1_los,gamma2_los\nnone.fits,0,0\n", "none.fits"),
        ("image,gamma1_los,gamma2_los\n", "truth.csv"),
    ] {
        std::fs::write(folder.path("truth.csv"), table).unwrap();
        folder.check_failure(2, &folder.haloray(arguments), arguments, &[wanted]);
    }
}

#[test]
fn two_of_one_name_and_names_that_leave_the_folder_are_refused_or_harmless() {
    let folder = folder();
    let twice = "study catalogue . --models small.toml,small.toml -o study";
    folder.check_failure(2, &folder.haloray(twice), twice, &["name of the model", "both would be one file"]);
    let truth = "image,gamma1_los,gamma2_los\n0.fits,0,0\n0_fits,0,0\n";
    std::fs::write(folder.path("truth.csv"), truth).unwrap();
    let cleaned = "study catalogue . --models small.toml -o study";
    folder.check_failure(2, &folder.haloray(cleaned), cleaned, &["name of the image", "0_fits"]);
    let twice = "simulate --fit tidal-minimal,tidal-minimal -o run";
    folder.check_failure(2, &folder.haloray(twice), twice, &["name of the model"]);
    assert!(!folder.path("study").exists() && !folder.path("run").exists());
}
