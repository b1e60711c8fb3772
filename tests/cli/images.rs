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
    assert!(
        stdout.contains("1.300000000") && stdout.contains("2 images within 5.0000″ of the axis, complete"),
        "{stdout}"
    );
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
    assert!(String::from_utf8_lossy(&output.stderr).contains("warning: some directions stayed undecided"));
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

const WIDE: &str =
    r#"{"z_lens": 0.5, "z_source": 1.5, "lens_model_list": ["SIS"], "kwargs_lens": [{"theta_E": 3.0}]}"#;
const TWO_PLANES: &str = r#"{"z_source": 1.0, "lens_redshift_list": [0.5, 1.0], "lens_model_list": ["SIE", "SIE"],
    "kwargs_lens": [{"theta_E": 1.6, "e1": 0.05, "e2": 0.0},
        {"theta_E": 0.2, "e1": 0.0, "e2": 0.1, "center_x": 0.02, "center_y": 0.03}]}"#;

#[test]
fn the_window_widens_to_where_the_deflection_reaches() {
    let sheet = r#"{"z_lens": 0.5, "z_source": 1.5, "lens_model_list": ["CONVERGENCE"], "kwargs_lens": [{"kappa": 1.5}]}"#;
    let folder = Folder::with(&[("wide.json", WIDE), ("sheet.json", sheet)]);
    for extra in ["", " --half-width-arcsec 2"] {
        let output = folder.haloray(&format!("images wide.json --source 2.5,0{extra}"));
        let stdout = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.success() && output.stderr.is_empty(), "{output:?}");
        for text in ["5.500000000", "−0.500000000", "2 images within", "complete by the parity count"] {
            assert!(stdout.contains(text), "{text}: {stdout}");
        }
    }
    let output = folder.haloray("images sheet.json --source 0.1,0");
    assert!(String::from_utf8_lossy(&output.stdout).contains("NOT proven complete"));
    assert!(String::from_utf8_lossy(&output.stderr).contains("images beyond are not excluded"));
}

#[test]
fn planes_at_and_behind_the_source_do_nothing() {
    let alone = r#"{"z_source": 1.0, "lens_redshift_list": [0.5], "lens_model_list": ["SIE"],
        "kwargs_lens": [{"theta_E": 1.6, "e1": 0.05, "e2": 0.0}]}"#;
    let points = "theta_x_arcsec,theta_y_arcsec\n1.1,0.4\n-0.2,0.9\n";
    let folder = Folder::with(&[("two.json", TWO_PLANES), ("one.json", alone), ("points.csv", points)]);
    let images = ["two", "one"].map(|name| folder.haloray(&format!("images {name}.json --source 0.1,0.05")));
    assert!(images[0].status.success(), "{images:?}");
    assert_eq!(images[0].stdout, images[1].stdout);
    let rays = ["two", "one"].map(|name| {
        let arguments = format!("lens {name}.json --points points.csv -o {name}.csv");
        assert!(folder.haloray(&arguments).status.success());
        std::fs::read(folder.path(format!("{name}.csv"))).unwrap()
    });
    assert!(rays[0] == rays[1]);
}

#[test]
fn inputs_are_never_the_output() {
    let points = "theta_x_arcsec,theta_y_arcsec\n1.1,0.4\n";
    let folder = Folder::with(&[("model.json", MODEL), ("points.csv", points), ("small.toml", "seed = 2\n")]);
    std::fs::copy(folder.path("points.csv"), folder.path("model.csv")).unwrap();
    let before = folder.files();
    for arguments in [
        "lens model.json --points points.csv -o points.csv",
        "lens model.json --points points.csv -o ./points.csv",
        "images points.csv --source 0,0 -o points.csv",
    ] {
        let output = folder.haloray(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments}: {output:?}");
        assert!(folder.files() == before, "{arguments}");
    }
}
