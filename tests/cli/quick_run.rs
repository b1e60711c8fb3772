//! What tests of successful commands share: a quick configuration, and reading back what was written.

use haloray::io::{Table, Values};

use crate::folder::Folder;

/// Keys that make a run of the preset `paper` quick: fewer haloes, pixels and map nodes.
pub const SMALL: &str = "[haloes]\nmin_point_shear = 1e-5\n[image]\npixels = 12\n[maps]\npoints = 9\n";
const POINTS: &str = "theta_x_arcsec,theta_y_arcsec,id,note\n1.1,0,7,east\n-0.3,1.2,8,\"north, west\"\n";

pub fn folder() -> Folder {
    Folder::with(&[("small.toml", SMALL), ("points.csv", POINTS)])
}

/// Runs a command that must succeed without a word on stderr but how far it is, and returns what it printed.
pub fn succeeds(folder: &Folder, arguments: &str) -> String {
    let output = folder.haloray(arguments);
    let stderr = String::from_utf8_lossy(&output.stderr);
    let is_silent = stderr.lines().all(|line| line.starts_with("progress: "));
    assert!(output.status.success() && is_silent, "haloray {arguments}\n{stderr}");
    String::from_utf8(output.stdout).unwrap()
}

/// A column by its exact name.
pub fn column(table: &Table, name: &str) -> Values {
    table.columns().iter().find(|c| c.name == name).unwrap_or_else(|| panic!("no {name}")).values.clone()
}

pub fn numbers(table: &Table, name: &str) -> Vec<f64> {
    match column(table, name) {
        Values::F64(values) => values,
        Values::Text(_) => panic!("{name} is text"),
    }
}
