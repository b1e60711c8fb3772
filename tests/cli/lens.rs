//! `haloray lens` end to end: models in lenstronomy's form in, tables out, every complaint once.

use std::path::{Path, PathBuf};

use assert_cmd::Command;
use serde_json::{Value, json};
use tempfile::TempDir;

/// A folder with points that carry a column of their own.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let points = "name,theta_x_arcsec,theta_y_arcsec,weight\nA,1.2,0.7,0.5\nB,-0.4,1.1,0.25\n";
    std::fs::write(folder.path().join("points.csv"), points).unwrap();
    folder
}

fn lens(folder: &Path, model: &str) -> Command {
    std::fs::write(folder.join("model.json"), model).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_haloray"));
    command.current_dir(folder).args(["lens", "model.json", "--points", "points.csv", "-o", "lensed.csv"]);
    command
}

fn epl() -> Value {
    json!({"theta_E": 1.5, "gamma": 2.1, "e1": 0.1, "e2": 0.05, "center_x": 0, "center_y": 0})
}

fn shear() -> Value {
    json!({"gamma1": 0.03, "gamma2": -0.02})
}

fn minimal(omega_od: f64) -> Value {
    json!({"kappa_od": 0.01, "gamma1_od": 0.02, "gamma2_od": -0.01, "omega_od": omega_od,
           "kappa_los": 0.03, "gamma1_los": -0.02, "gamma2_los": 0.01})
}

fn model(names: &[&str], kwargs: &[Value]) -> Value {
    json!({"z_lens": 0.5, "z_source": 1.5, "lens_model_list": names, "kwargs_lens": kwargs})
}

/// A model like that of [`model`] with one key changed.
fn with(key: &str, value: Value) -> Value {
    let mut whole = model(&["EPL"], &[epl()]);
    whole[key] = value;
    whole
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|f| f.unwrap().path()).collect();
    files.sort();
    files
}

/// Runs a bad model: exit 2, one error that names the file and contains all `parts`, nothing written.
fn assert_refused(text: &str, parts: &[&str]) {
    let folder = folder();
    let output = lens(folder.path(), text).output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{text}\n{stderr}");
    assert!(stderr.starts_with("error: model.json: "), "{stderr}");
    assert_eq!(stderr.lines().count(), 2, "{stderr}");
    for part in parts {
        assert!(stderr.contains(part), "\"{part}\" is not in: {stderr}");
    }
    assert!(output.stdout.is_empty());
    assert_eq!(files(folder.path()), ["model.json", "points.csv"].map(|name| folder.path().join(name)));
}

/// Runs a good model and returns the table's cells, names first, and stderr.
fn lensed(model: &Value) -> (Vec<Vec<String>>, String) {
    let folder = folder();
    let output = lens(folder.path(), &model.to_string()).output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{stderr}");
    let table = std::fs::read_to_string(folder.path().join("lensed.csv")).unwrap();
    (table.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect(), stderr)
}

#[test]
fn a_model_is_evaluated_and_other_columns_are_kept() {
    let (table, stderr) = lensed(&model(&["LOS_MINIMAL", "EPL", "SHEAR"], &[minimal(0.0), epl(), shear()]));
    let names = "name,theta_x_arcsec,theta_y_arcsec,weight,beta_x_arcsec,beta_y_arcsec,f_xx,f_xy,f_yx,f_yy,\
                 fermat_arcsec2,delay_days";
    assert_eq!(table[0].join(","), names);
    assert_eq!(table.len(), 3);
    assert_eq!([&table[1][0], &table[2][3]], ["A", "0.25"]);
    assert_eq!(stderr, "");
}

#[test]
fn a_singular_isothermal_sphere_deflects_by_its_einstein_radius() {
    let (table, _) = lensed(&model(&["SIS"], &[json!({"theta_E": 1})]));
    let beta: Vec<f64> = table[1][4..6].iter().map(|cell| cell.parse().unwrap()).collect();
    let left = 1.0 - 1.0 / 1.2_f64.hypot(0.7);
    assert!((beta[0] - 1.2 * left).abs() < 1e-15 && (beta[1] - 0.7 * left).abs() < 1e-15, "{beta:?}");
}

#[test]
fn both_spellings_of_a_cosmology_mean_the_same() {
    let own = json!({"h0_km_s_mpc": 70, "omega_m": 0.3});
    let (ours, _) = lensed(&with("cosmology", own));
    let (theirs, _) = lensed(&with("cosmology", json!({"H0": 70.0, "Om0": 0.3, "Tcmb0": 0})));
    assert_eq!(ours, theirs);
    assert_ne!(ours, lensed(&with("cosmology", json!({"H0": 67.4, "Om0": 0.315}))).0);
}

#[test]
fn every_model_has_a_redshift_in_a_list_of_redshifts() {
    let mut planes = model(&["EPL", "SHEAR"], &[epl(), shear()]);
    planes.as_object_mut().unwrap().remove("z_lens");
    planes["lens_redshift_list"] = json!([0.5, 0.5]);
    let (one, _) = lensed(&model(&["EPL", "SHEAR"], &[epl(), shear()]));
    let (many, _) = lensed(&planes);
    assert!(!many[0].contains(&"fermat_arcsec2".to_owned()));
    let column = |table: &[Vec<String>], name: &str| -> f64 {
        let at = table[0].iter().position(|other| other == name).unwrap();
        table[2][at].parse().unwrap()
    };
    for name in ["beta_x_arcsec", "beta_y_arcsec", "f_xx", "f_xy", "f_yx", "f_yy", "delay_days"] {
        let (a, b) = (column(&one, name), column(&many, name));
        assert!((a - b).abs() < 1e-12 * a.abs().max(1.0), "{name}: {a} {b}");
    }
    planes["lens_redshift_list"] = json!([0.5, 0.9]);
    assert_ne!(lensed(&planes).0[2], many[2]);
}

#[test]
fn rotation_of_the_foreground_in_the_minimal_model_is_warned_of() {
    let (_, stderr) = lensed(&model(&["LOS_MINIMAL", "EPL"], &[minimal(0.01), epl()]));
    assert!(stderr.starts_with("warning: LOS_MINIMAL with omega_od ≠ 0"), "{stderr}");
}

#[test]
fn points_on_a_singular_centre_are_warned_of_and_those_on_a_core_are_not() {
    let at = |lens: &str, arguments: Value| {
        let mut arguments = arguments;
        arguments["center_x"] = json!(1.2);
        arguments["center_y"] = json!(0.7);
        lensed(&model(&[lens], &[arguments])).1
    };
    let warning = at("SIS", json!({"theta_E": 1}));
    assert!(warning.starts_with("warning: 1 ray meets the centre of a lens (row 1 first)"), "{warning}");
    assert!(at("NFW", json!({"Rs": 5, "alpha_Rs": 1})).contains("meets the centre of a lens"));
    assert_eq!(at("SERSIC", json!({"k_eff": 0.5, "R_sersic": 0.5, "n_sersic": 1})), "");
}

#[test]
fn what_is_no_json_is_told_in_words() {
    let text = model(&["SIS"], &[json!({"theta_E": 1})]).to_string();
    let (folder, with_mark) = (folder(), format!("\u{feff}{text}"));
    assert!(lens(folder.path(), &with_mark).output().unwrap().status.success());
    for (from, to, wanted) in [
        ("\"theta_E\":1", "\"theta_E\":1,\"theta_E\":2", "theta_E stands there twice"),
        ("1.5", "NaN", "NaN, Infinity, None, True and False are no JSON"),
        ("{", "{\"lensing_entities\": [], ", "it is a COOLEST file, which is not read"),
    ] {
        assert_refused(&text.replacen(from, to, 1), &["not a lens model", wanted]);
    }
}

#[test]
fn all_unknown_models_are_named() {
    let text = model(&["PJAFFE", "EPL", "GNFW"], &[json!({}), epl(), json!({})]).to_string();
    assert_refused(&text, &["lens_model_list is PJAFFE, GNFW, but must be among EPL, SIE"]);
}

#[test]
fn arguments_missing_unknown_or_impossible_are_named_with_their_model() {
    let changed = |key: &str, value: Option<Value>| {
        let mut kwargs = epl();
        match value {
            Some(value) => kwargs[key] = value,
            None => drop(kwargs.as_object_mut().unwrap().remove(key)),
        }
        model(&["SHEAR", "EPL"], &[shear(), kwargs]).to_string()
    };
    let missing = "argument gamma of EPL (number 2 of the list) is missing, but must be a number";
    assert_refused(&changed("gamma", None), &[missing]);
    let unknown = "argument of EPL (number 2 of the list) is q, but must be one of theta_E, gamma, e1, e2";
    assert_refused(&changed("q", Some(json!(0.7))), &[unknown]);
    assert_refused(
        &changed("theta_E", Some(json!(-1))),
        &["of EPL (number 2 of the list) is -1, but must be"],
    );
    assert_refused(&changed("e1", Some(json!("0.1"))), &["not a lens model", "line 1"]);
    assert_refused(&changed("e1", Some(Value::Null)), &["not a lens model"]);
    let mut los = minimal(0.0);
    los["F1_od"] = json!(0.1);
    let text = model(&["LOS_MINIMAL", "EPL"], &[los, epl()]).to_string();
    assert_refused(
        &text,
        &["argument of LOS_MINIMAL (number 1 of the list) is F1_od", "gamma1_los", "omega_od"],
    );
}

#[test]
fn redshifts_in_the_wrong_order_are_refused() {
    let allowed = "z_lens is 1.5, but must be above 0 and below z_source = 1.5";
    assert_refused(&with("z_lens", json!(1.5)).to_string(), &[allowed]);
    assert_refused(&with("z_lens", json!(-0.1)).to_string(), &["z_lens is -0.1"]);
    assert_refused(&with("z_lens", Value::Null).to_string(), &["z_lens is missing", "lens_redshift_list"]);
}

#[test]
fn lists_of_different_lengths_are_refused() {
    let text = model(&["EPL", "SHEAR"], &[epl()]).to_string();
    assert_refused(&text, &["length of kwargs_lens is 1, but must be 2 as the lens_model_list"]);
    assert_refused(&model(&[], &[]).to_string(), &["lens_model_list is empty"]);
}

#[test]
fn two_lines_of_sight_are_refused() {
    let text = model(&["LOS_MINIMAL", "EPL", "LOS"], &[minimal(0.0), epl(), json!({})]).to_string();
    assert_refused(&text, &["LOS (number 3 of the list)", "the only LOS model"]);
}

#[test]
fn text_that_is_no_model_is_refused_with_its_place() {
    assert_refused("{\"z_lens\": 0.5,", &["not a lens model: EOF", "line 1 column 15"]);
    assert_refused("[1, 2]", &["not a lens model"]);
    let whole = model(&["EPL"], &[epl()]).to_string();
    assert_refused(&whole.replace("2.1", "NaN"), &["not a lens model: expected value", "column"]);
    assert_refused(&whole.replace("2.1", "1e999"), &["number out of range"]);
    assert_refused(&with("z_lense", json!(0.5)).to_string(), &["unknown field `z_lense`"]);
}

#[test]
fn a_cosmology_that_haloray_has_not_is_refused() {
    let warm = json!({"H0": 70, "Om0": 0.3, "Tcmb0": 2.725});
    assert_refused(&with("cosmology", warm).to_string(), &["Tcmb0 is 2.725, but must be 0"]);
    let empty = json!({"H0": 70, "Om0": 0});
    assert_refused(
        &with("cosmology", empty).to_string(),
        &["omega_m is 0, but must be above 0 and at most 1"],
    );
    assert_refused(&with("cosmology", json!({"H0": 70})).to_string(), &["missing field"]);
}

#[test]
fn planes_that_cannot_be_are_refused() {
    let planes = |redshifts: Value, names: &[&str], kwargs: &[Value]| {
        let mut whole = model(names, kwargs);
        whole.as_object_mut().unwrap().remove("z_lens");
        whole["lens_redshift_list"] = redshifts;
        whole.to_string()
    };
    let both = with("lens_redshift_list", json!([0.5])).to_string();
    assert_refused(&both, &["z_lens is 0.5, but must be left out beside lens_redshift_list"]);
    let length = "length of lens_redshift_list is 2, but must be 1 as the lens_model_list";
    assert_refused(&planes(json!([0.5, 0.6]), &["EPL"], &[epl()]), &[length]);
    let before = "redshift of a lens is -0.1, but must be";
    assert_refused(&planes(json!([-0.1]), &["EPL"], &[epl()]), &[before]);
    let text = planes(json!([0.5, 0.5]), &["LOS_MINIMAL", "EPL"], &[minimal(0.0), epl()]);
    assert_refused(&text, &["LOS_MINIMAL (number 1 of the list), but must be a mass profile"]);
}
