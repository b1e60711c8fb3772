//! `haloray fit` through a halo table: the closure of the chain, and what is refused.

use crate::folder::Folder;
use serde_json::Value;

/// Haloes in front of the lens, in its plane and behind it, three of them inside the image.
const HALOES: &str = "z,theta_x_arcsec,theta_y_arcsec,m200c_msun,c200c\n\
                      0.3,0.7,0.5,3e9,14\n0.5,-0.2,1.1,2e9,14\n0.7,-0.8,0.4,1e10,12\n\
                      0.2,30,-12,2e12,7\n1.1,-25,40,5e12,6\n";

const CONFIG: &str = "seed = 5\n[image]\npixels = 36\n\
                      [lens]\neinstein_radius_arcsec = 0.9\nslope = 2.1\ne1 = 0.05\ne2 = -0.03\n\
                      [source]\nmagnitude = 22.0\nradius_arcsec = 0.2\nsersic_index = 1.5\ne1 = 0.1\ne2 = 0.02\n";

const MODEL: &str = r#"
name = "through"
[line_of_sight]
model = "haloes"
file = "haloes.csv"
[[lens]]
profile = "EPL"
[lens.parameters]
theta_E = { uniform = [0.5, 1.5] }
gamma = 2.1
e1 = { uniform = [-0.3, 0.3] }
e2 = { uniform = [-0.3, 0.3] }
[[source]]
profile = "SERSIC_ELLIPSE"
[source.parameters]
R_sersic = { uniform = [0.05, 1.0] }
n_sersic = 1.5
e1 = 0.1
e2 = 0.02
center_x = { uniform = [-0.1, 0.1] }
center_y = { uniform = [-0.1, 0.1] }
"#;

fn folder() -> Folder {
    let folder = Folder::with(&[("haloes.csv", HALOES), ("my.toml", CONFIG), ("through.toml", MODEL)]);
    let made = folder.haloray("image my.toml --haloes haloes.csv -o image --quiet");
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    folder
}

#[test]
fn an_image_fitted_through_its_own_haloes_gives_back_what_made_it() {
    let folder = folder();
    for (fit, sampling) in [("point", "point"), ("integrated", "adaptive")] {
        let arguments =
            format!("fit image/image.fits --model through.toml --pixel-sampling {sampling} -o {fit} --quiet");
        let output = folder.haloray(&arguments);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let text = std::fs::read_to_string(folder.path(fit).join("summary.json")).unwrap();
        let summary: Value = serde_json::from_str(&text).unwrap();
        // β is that of the traced rays to a thousandth of a pixel's thousandth.
        assert!(summary["expansion_error_arcsec"].as_f64().unwrap() < 1e-7, "{summary}");
        if sampling == "adaptive" {
            continue; // the image was made with one point a pixel
        }
        // 1296 pixels: χ² scatters by 4%.
        assert!((summary["chi2_reduced"].as_f64().unwrap() - 1.0).abs() < 0.12, "{summary}");
        for (name, truth) in
            [("lens.theta_E", 0.9), ("lens.e1", 0.05), ("lens.e2", -0.03), ("source.R_sersic", 0.2)]
        {
            let parameters = summary["parameters"].as_array().unwrap();
            let found = parameters.iter().find(|p| p["name"] == name).unwrap();
            let number = |key: &str| found[key].as_f64().unwrap();
            let pull = (number("mean") - truth) / number("standard_deviation");
            assert!(pull.abs() < 4.0, "{name} is {pull} deviations off: {found}");
        }
    }
}

#[test]
fn tables_that_are_missing_or_not_wanted_are_refused() {
    let folder = folder();
    for (arguments, wanted) in [
        ("--model haloes", ["line_of_sight.file is missing", "after --haloes"]),
        ("--model haloes --haloes none.csv", ["cannot read none.csv", "check the path"]),
        ("--model tidal-minimal --haloes haloes.csv", ["--haloes is haloes.csv", "left out unless"]),
    ] {
        let arguments = format!("fit image/image.fits {arguments} -o fit");
        folder.check_failure(2, &folder.haloray(&arguments), &arguments, &wanted);
    }
}
