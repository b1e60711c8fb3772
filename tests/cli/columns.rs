//! Tables as other programs write them: units converted or refused, CSV of pandas and spreadsheets, damaged HDF5.

use std::fs;
use std::path::Path;

use crate::folder::Folder;
use haloray::io::{Column, Provenance, Table};

const TRACE: &str = "--points points.csv --z-source 1.5 --threads 1 -o rays.csv";
/// β of the ray at (1″, 0.5″) through the three haloes of `data/inputs`, traced independently.
const BETA_ARCSEC: [f64; 2] = [1.003_378_6, 0.504_053_9];

/// A folder with these files of `data/inputs` and its points.
fn folder(names: &[&str]) -> Folder {
    let folder = Folder::with(&[]);
    let inputs = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/inputs");
    for name in names.iter().chain(&["points.csv"]) {
        fs::copy(inputs.join(name), folder.path(name)).unwrap();
    }
    folder
}

/// Traces through the table, checks β of the second point and returns what was said on stderr.
fn traced(folder: &Folder, haloes: &str) -> String {
    let output = folder.haloray(&format!("trace --haloes {haloes} {TRACE}"));
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{haloes}: {stderr}");
    let rays = Table::read(&folder.path("rays.csv"), "rays").unwrap();
    for (name, expected) in ["beta_x_arcsec", "beta_y_arcsec"].into_iter().zip(BETA_ARCSEC) {
        let found = rays.required_f64(name).unwrap()[1];
        assert!((found - expected).abs() < 1e-7, "{haloes} {name}: {found}");
    }
    stderr
}

#[test]
fn columns_in_degrees_are_converted_and_that_is_said() {
    const SAID: &str = "converted theta_x_arcsec from deg to arcsec, theta_y_arcsec from deg to arcsec";
    let names = [
        "haloes_unit_deg.fits",
        "haloes_unit_deg.h5",
        "astropy.h5",
        "astropy.ecsv",
        "astropy_comma.ecsv",
        "astropy.fits",
        "h5py_records.h5",
        "h5py_columns.h5",
    ];
    let folder = folder(&names);
    for name in names {
        let stderr = traced(&folder, name).replace("degree", "deg");
        let notes: Vec<&str> = stderr.lines().filter(|line| line.starts_with("note: ")).collect();
        assert!(notes.len() == 1 && notes[0].contains(SAID), "{name}: {stderr}");
    }
}

#[test]
fn tables_of_pandas_and_spreadsheets_are_read_and_what_was_left_out_is_said() {
    let folder = folder(&["haloes_trailing_comma.csv", "pandas.csv"]);
    assert!(
        traced(&folder, "haloes_trailing_comma.csv").contains("the empty column at the end was left out")
    );
    assert!(traced(&folder, "pandas.csv").contains("an index without a name, was left out"));
    let text = fs::read_to_string(folder.path("haloes_trailing_comma.csv")).unwrap().replace(",\n", "\n");
    fs::write(
        folder.path("semicolons.csv"),
        format!("\u{feff}{}", text.replace(',', ";").replace('\n', "\r\n")),
    )
    .unwrap();
    assert!(traced(&folder, "semicolons.csv").contains("semicolons separate its columns"));
    let quiet = folder.haloray(&format!("trace --quiet --haloes pandas.csv {TRACE}"));
    assert!(quiet.stderr.is_empty());
    fs::write(folder.path("units.csv"), format!("# halo units: deg\n{text}")).unwrap();
    let said = "its comment 'halo units: deg' is not read; columns have the units that their names end in";
    assert!(traced(&folder, "units.csv").contains(said));
}

#[test]
fn units_that_are_not_known_are_refused_with_column_unit_and_what_is_allowed() {
    let folder = folder(&[]);
    for (column, unit, wanted) in [
        (
            "theta_x_arcsec",
            "pix",
            "has the unit 'pix', but must be arcsec, arcmin, deg, rad, mas, uas or hourangle",
        ),
        ("m200c_msun", "1e10 Msun/h", "has the unit '1e10 Msun/h', but must be Msun: divide the masses by h"),
        ("m200c_msun", "kg", "but must be Msun (solMass)"),
        ("z", "km/s", "has the unit 'km/s', but must be without a unit"),
        ("c200c", "deg", "has the unit 'deg', but must be without a unit"),
    ] {
        let columns = ["z", "theta_x_arcsec", "theta_y_arcsec", "m200c_msun", "c200c"];
        let columns = columns.map(|name| Column::f64(name, (name == column).then_some(unit), vec![0.5]));
        let table = Table::new(columns.to_vec()).unwrap();
        for file in ["h.fits", "h.h5"] {
            table.write(&folder.path(file), "haloes", &Provenance::new(None, "")).unwrap();
            let trace = format!("trace --haloes {file} {TRACE}");
            folder.check_failure(2, &folder.haloray(&trace), &trace, &[&format!("column {column}"), wanted]);
        }
    }
}

#[test]
fn masses_in_ten_to_the_ten_suns_and_points_in_arcmin_are_converted() {
    let folder = folder(&[]);
    let masses = |unit: &str, mass: f64| {
        let column = |name, value| Column::f64(name, None, vec![value]);
        let columns = vec![
            column("z", 0.5),
            column("theta_x_arcsec", 3.0),
            column("theta_y_arcsec", 1.0),
            Column::f64("m200c_msun", Some(unit), vec![mass]),
            column("c200c", 8.0),
        ];
        let table = Table::new(columns).unwrap();
        table.write(&folder.path("h.h5"), "haloes", &Provenance::new(None, "")).unwrap();
        assert!(folder.haloray(&format!("trace --haloes h.h5 {TRACE}")).status.success());
        fs::read_to_string(folder.path("rays.csv")).unwrap()
    };
    assert_eq!(masses("solMass", 1e12), masses("1e10 Msun", 100.0));
    let point = |unit: &str, value: f64| {
        let column = |name| Column::f64(name, Some(unit), vec![value]);
        let table = Table::new(vec![column("theta_x_arcsec"), column("theta_y_arcsec")]).unwrap();
        table.write(&folder.path("p.fits"), "points", &Provenance::new(None, "")).unwrap();
        let trace = "trace --haloes h.h5 --points p.fits --z-source 1.5 -o rays.csv";
        assert!(folder.haloray(trace).status.success());
        fs::read_to_string(folder.path("rays.csv")).unwrap()
    };
    assert_eq!(point("arcsec", 30.0), point("arcmin", 0.5));
}

#[test]
fn damaged_and_absurd_hdf5_files_are_refused() {
    let folder = folder(&["vlen_unit_segv.h5", "declared_1e12_rows.h5"]);
    for (name, wanted) in [
        ("vlen_unit_segv.h5", "the attribute unit is damaged"),
        ("declared_1e12_rows.h5", "declares more than it or memory can hold"),
    ] {
        let trace = format!("trace --haloes {name} {TRACE}");
        folder.check_failure(2, &folder.haloray(&trace), &trace, &[name, wanted]);
    }
}

#[cfg(unix)]
#[test]
fn pipes_devices_and_folders_are_no_tables() {
    let folder = folder(&["pandas.csv"]);
    fs::create_dir(folder.path("folder.csv")).unwrap();
    std::os::unix::fs::symlink("/dev/zero", folder.path("zero.csv")).unwrap();
    std::os::unix::fs::symlink("/dev/zero", folder.path("zero.fits")).unwrap();
    std::os::unix::fs::symlink("/dev/zero", folder.path("zero.h5")).unwrap();
    assert!(std::process::Command::new("mkfifo").arg(folder.path("pipe.csv")).status().unwrap().success());
    for (name, wanted) in [
        ("folder.csv", "directory"),
        ("zero.csv", "a pipe or a device"),
        ("zero.fits", "a pipe or a device"),
        ("zero.h5", "a pipe or a device"),
        ("pipe.csv", "a pipe or a device"),
    ] {
        let trace = format!("trace --haloes {name} {TRACE}");
        folder.check_failure(2, &folder.haloray(&trace), &trace, &[name, wanted]);
    }
}
