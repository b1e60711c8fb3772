//! `haloray study validity`: what its table and summary hold, for any number of threads and of sightlines.

use haloray::io::{Table, Values};

use crate::folder::Folder;
use crate::quick_run::succeeds;

/// A few hundred haloes a sightline, images of few large pixels.
const SMALL: &str = "[haloes]\nmin_point_shear = 1e-4\n[image]\npixels = 20\n[maps]\npoints = 9\n\
                     [instrument]\npixel_scale_arcsec = 0.2\npsf_fwhm_arcsec = 0.2\n[source]\nsersic_index = 1\n";
const COMMAND: &str = "study validity small.toml --views all,0.1 --starts truth --models tidal-minimal --estimate laplace --quiet";

fn words(table: &Table, name: &str) -> Vec<String> {
    match &table.column(name).unwrap().values {
        Values::Text(words) => words.clone(),
        Values::F64(numbers) => numbers.iter().map(ToString::to_string).collect(),
    }
}

#[test]
fn every_image_stands_beside_its_twin_whatever_the_threads_and_the_number() {
    let folder = Folder::with(&[("small.toml", SMALL)]);
    succeeds(&folder, &format!("{COMMAND} -n 3 --vary source.radius_arcsec=0.5 -o whole"));
    let table = Table::read(&folder.path("whole/validity.csv"), "").unwrap();
    // Two cases, two views, images and twins.
    assert_eq!(table.row_count(), 3 * 2 * 2 * 2);
    let (mocks, cases) = (words(&table, "mock"), words(&table, "case"));
    assert!(cases.contains(&"source.radius_arcsec=0.5".into()) && cases.contains(&"base".into()));
    let numbers = |name: &str| table.required_f64(name).unwrap().to_vec();
    let (axis, ring) = (numbers("gamma1_los_axis"), numbers("gamma1_los_ring"));
    let (excess, h0) = (numbers("chi2_excess"), numbers("h0_ratio_axis"));
    for row in 0..table.row_count() {
        // All definitions of a twin are one, and its delays are those of its tensors.
        let is_twin = mocks[row] == "tidal";
        assert_eq!(
            (axis[row] == ring[row], excess[row] == 0.0, h0[row] == 1.0),
            (is_twin, is_twin, is_twin),
            "{row}"
        );
    }
    // What is fitted to a twin is what it was made of.
    let (fit, variance) = (numbers("gamma1_los_fit"), numbers("covariance_11"));
    let near = (0..table.row_count()).filter(|&row| mocks[row] == "tidal");
    let near = near.filter(|&row| (fit[row] - axis[row]).abs() < 4.0 * variance[row].sqrt()).count();
    assert!(near >= 11, "{near} of 12 twins");
    let text = std::fs::read_to_string(folder.path("whole/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(
        (summary["number_of_sightlines"].as_u64(), summary["groups"].as_array().unwrap().len()),
        (Some(3), 8)
    );
    // One thread, and fewer sightlines, give the same rows.
    succeeds(&folder, &format!("{COMMAND} -n 3 --vary source.radius_arcsec=0.5 -o again --threads 1"));
    let files = folder.files();
    let same = files.iter().filter(|(name, bytes)| name.starts_with("whole") && !bytes.is_empty());
    for (name, bytes) in same {
        let other = std::path::Path::new("again").join(name.strip_prefix("whole").unwrap());
        assert!(files[&other] == *bytes, "{}", name.display());
    }
    succeeds(&folder, &format!("{COMMAND} -n 1 --no-delays -o one"));
    let one = Table::read(&folder.path("one/validity.csv"), "").unwrap();
    assert_eq!(one.required_f64("gamma1_los_fit").unwrap()[0].to_bits(), fit[0].to_bits());
}

#[test]
fn what_cannot_be_studied_is_refused_before_any_work() {
    let folder = Folder::with(&[("small.toml", SMALL)]);
    let before = folder.files();
    for (options, wanted) in [
        ("--views 0", "positive and finite"),
        ("--views most", "all or a limit of Δ_h"),
        ("--views all,all", "all twice"),
        ("--models haloes", "gamma1_los and gamma2_los are free"),
        ("--models none", "none"),
        ("--vary source.radius_arcsec", "KEY=VALUE,…"),
        ("--vary source.nothing=1", "nothing"),
        ("--vary source.radius_arcsec=0.1,", "KEY=VALUE,…"),
    ] {
        let command = format!("study validity small.toml -n 1 {options} -o bad");
        folder.check_failure(2, &folder.haloray(&command), &command, &[wanted]);
        assert!(folder.files() == before, "{command}");
    }
}
