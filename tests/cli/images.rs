//! `haloray images` end to end: table, curves and figure out, every complaint with its cure.

use crate::folder::Folder;

const MODEL: &str =
    r#"{"z_lens": 0.5, "z_source": 1.5, "lens_model_list": ["SIS"], "kwargs_lens": [{"theta_E": 1}]}"#;

#[test]
fn images_of_an_isothermal_sphere_are_printed_and_written() {
    let folder = Folder::with(&[("model.json", MODEL)]);
    let output = folder.haloray("images model.json --source 0.3,0 -o lens");
    let stdout = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(stdout.contains("1.300000000") && stdout.contains("2 images, complete"), "{stdout}");
    let table = std::fs::read_to_string(folder.path("lens/images.csv")).unwrap();
    assert_eq!(table.lines().count(), 3, "{table}");
    let curves = std::fs::read_to_string(folder.path("lens/curves.csv")).unwrap();
    assert!(curves.starts_with("curve,kind,closed,theta_x_arcsec") && curves.contains("tangential"));
    assert!(folder.path("lens/curves.png").is_file() && folder.path("lens/curves.svg").is_file());
}

#[test]
fn a_source_on_a_caustic_is_warned_of() {
    let folder = Folder::with(&[("model.json", MODEL)]);
    let output = folder.haloray("images model.json --source 0,0");
    assert!(output.status.success());
    assert!(String::from_utf8_lossy(&output.stderr).contains("warning: the parities do not add up"));
}

#[test]
fn bad_arguments_are_refused() {
    let folder = Folder::with(&[("model.json", MODEL)]);
    for (arguments, wanted) in [
        ("images model.json --source 0.3", "two numbers with a comma"),
        ("images model.json --source 0.3,x", "two numbers with a comma"),
        ("images model.json --source 0,0 --half-width-arcsec 0", "--half-width-arcsec is 0"),
        ("images none.json --source 0,0", "cannot read none.json"),
    ] {
        folder.check_failure(2, &folder.haloray(arguments), arguments, &[wanted]);
        assert_eq!(folder.files().len(), 1, "{arguments}");
    }
}
