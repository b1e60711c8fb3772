//! Sightlines from light cones of haloes: every format, the wrap and the poles, units, what is refused, ensembles.

use std::fs;

use haloray::cosmology::Background;
use haloray::io::{Column, Provenance, Table};

use crate::folder::Folder;
use crate::quick_run::{numbers, succeeds};

const RADIUS_CMPC: f64 = 11.62;
/// Footprint and number of the sightlines of most tests, through RA 0.
const FOUR: &str = "-n 4 --footprint 359.5,0.5,-0.5,0.5 --z-lens 0.5 --z-source 1.5 --quiet";

/// Numbers between 0 and 1 that look random: the fractional parts of multiples of an irrational number.
fn fractions(number: usize, of: f64) -> impl Iterator<Item = f64> {
    (0..number).map(move |i| (i as f64 * of).fract())
}

/// Haloes within 1.2° of a pole of the coordinates that `turned` gives: RA, Dec, z, mass, concentration (some missing).
fn cone(number: usize, turned: impl Fn(f64, f64) -> [f64; 2]) -> Vec<Column> {
    let places: Vec<[f64; 2]> = fractions(number, 0.754_877_666)
        .zip(fractions(number, 0.569_840_291))
        .map(|(u, v)| turned(2.4 * u - 1.2, 2.4 * v - 1.2))
        .collect();
    // Every redshift several times, some behind the source.
    let z = fractions(number, 0.618_033_989).map(|u| 0.03 + (160.0 * u).floor() / 100.0).collect();
    let mass = fractions(number, 0.414_213_562).map(|u| 1e11 * (1e-4 + u).powf(-0.9)).collect();
    let c =
        fractions(number, 0.236_067_977).map(|u| if u < 0.2 { f64::NAN } else { 4.0 + 8.0 * u }).collect();
    vec![
        Column::f64("ra_deg", Some("deg"), places.iter().map(|p| p[0]).collect()),
        Column::f64("dec_deg", Some("deg"), places.iter().map(|p| p[1]).collect()),
        Column::f64("z", None, z),
        Column::f64("m200c_msun", Some("solMass"), mass),
        Column::f64("c200c", None, c),
    ]
}

fn around_ra_0(x: f64, y: f64) -> [f64; 2] {
    [x.rem_euclid(360.0), y]
}

fn around_the_pole(x: f64, y: f64) -> [f64; 2] {
    [y.atan2(x).to_degrees(), 90.0 - x.hypot(y)]
}

fn write(folder: &Folder, name: &str, columns: Vec<Column>) {
    let table = Table::new(columns).unwrap().with_gaps_in(["c200c"].into_iter());
    table.write(&folder.path(name), "haloes", &Provenance::new(None, "")).unwrap();
}

fn haloes(folder: &Folder, output: &str, number: u64) -> Table {
    Table::read(&folder.path(format!("{output}/haloes/{number:05}.h5")), "haloes").unwrap()
}

fn index(folder: &Folder, output: &str) -> Table {
    Table::read(&folder.path(format!("{output}/sightlines.csv")), "").unwrap()
}

/// Members of a cylinder by haversine and bearing: row, θ_x, θ_y.
fn by_brute_force(columns: &[Column], [ra0, dec0]: [f64; 2]) -> Vec<(f64, f64, f64)> {
    let background = Background::paper();
    let values: Vec<Vec<f64>> =
        columns.iter().map(|c| numbers(&Table::new(vec![c.clone()]).unwrap(), &c.name)).collect();
    let mut found = Vec::new();
    let places = values[0].iter().zip(&values[1]).zip(&values[2]);
    for (row, ((&ra_deg, &dec_deg), &z)) in places.enumerate() {
        let [ra, dec, a0, d0] = [ra_deg, dec_deg, ra0, dec0].map(f64::to_radians);
        let haversine =
            ((dec - d0) / 2.0).sin().powi(2) + d0.cos() * dec.cos() * ((ra - a0) / 2.0).sin().powi(2);
        let separation = 2.0 * haversine.sqrt().asin();
        if z < 1.5 && background.comoving_distance_mpc(z) * separation <= RADIUS_CMPC {
            let (east, north) =
                (dec.cos() * (ra - a0).sin(), d0.cos() * dec.sin() - d0.sin() * dec.cos() * (ra - a0).cos());
            let (arcsec, bearing) = (separation.to_degrees() * 3600.0, east.atan2(north));
            found.push((row as f64, -arcsec * bearing.sin(), arcsec * bearing.cos()));
        }
    }
    found
}

#[test]
fn every_format_gives_what_brute_force_gives_across_the_wrap() {
    let folder = Folder::with(&[]);
    let columns = cone(6000, around_ra_0);
    for format in ["csv", "h5", "fits"] {
        write(&folder, &format!("cone.{format}"), columns.clone());
        succeeds(&folder, &format!("extract cone.{format} {FOUR} -o {format}"));
    }
    let index = index(&folder, "h5");
    let mut total = 0;
    for number in 0..4 {
        let found = haloes(&folder, "h5", number);
        for format in ["csv", "fits"] {
            assert_eq!(haloes(&folder, format, number).columns(), found.columns(), "{format}");
        }
        let centre = ["ra_deg", "dec_deg"].map(|name| numbers(&index, name)[number as usize]);
        assert!(!(0.5..=359.5).contains(&centre[0]) && centre[1].abs() <= 0.5, "{centre:?}");
        let expected = by_brute_force(&columns, centre);
        assert_eq!(numbers(&found, "lightcone_row"), expected.iter().map(|e| e.0).collect::<Vec<_>>());
        let [x, y] = ["theta_x_arcsec", "theta_y_arcsec"].map(|name| numbers(&found, name));
        for (i, (_, ex, ey)) in expected.iter().enumerate() {
            assert!((x[i] - ex).hypot(y[i] - ey) < 1e-6, "{} {} {ex} {ey}", x[i], y[i]);
        }
        assert!(numbers(&found, "c200c").iter().all(|c| (2.0..30.0).contains(c)));
        assert_eq!(numbers(&index, "number_of_haloes")[number as usize], expected.len() as f64);
        total += expected.len();
    }
    assert!(total > 200, "{total}");
    let said = String::from_utf8(folder.haloray("extract cone.h5 -n 1 -o derived").stderr).unwrap();
    assert!(
        said.contains("footprint from the haloes: RA 358.8") && said.contains("M200c in m200c_msun"),
        "{said}"
    );
}

#[test]
fn a_sightline_is_the_same_alone_in_parts_and_on_any_number_of_threads() {
    let folder = Folder::with(&[]);
    let columns = cone(3000, around_the_pole);
    let part = |rows: std::ops::Range<usize>| -> Vec<Column> {
        let cut = |c: &Column| {
            let all = numbers(&Table::new(vec![c.clone()]).unwrap(), &c.name);
            Column::f64(&c.name, c.unit.as_deref(), all[rows.clone()].to_vec())
        };
        columns.iter().map(cut).collect()
    };
    write(&folder, "cone.h5", columns.clone());
    write(&folder, "a.fits", part(0..1000));
    write(&folder, "b.csv", part(1000..3000));
    let options = "--footprint 0,360,89.2,90 --z-lens 0.5 --z-source 1.5 --quiet";
    succeeds(&folder, &format!("extract cone.h5 -n 4 {options} --threads 1 -o all"));
    succeeds(&folder, &format!("extract a.fits b.csv --first 2 -n 2 {options} --threads 3 -o last"));
    for number in 2..4 {
        assert_eq!(haloes(&folder, "last", number).columns(), haloes(&folder, "all", number).columns());
    }
    let index = index(&folder, "all");
    for number in 0..4 {
        let centre = ["ra_deg", "dec_deg"].map(|name| numbers(&index, name)[number]);
        let rows: Vec<f64> = by_brute_force(&columns, centre).iter().map(|found| found.0).collect();
        assert_eq!(numbers(&haloes(&folder, "all", number as u64), "lightcone_row"), rows, "{centre:?}");
    }
}

#[test]
fn radians_and_masses_per_h_of_another_definition_are_converted() {
    /// colossus 1.4.0: Mvir = 1e12 Msun, cvir = 9 at z = 0.5 of a flat cosmology with H0 67.4 and Ωm 0.315.
    const M200C_C200C: [f64; 2] = [9.149_176_643e11, 7.749_116_83];
    let folder = Folder::with(&[(
        "cone.csv",
        "ra_rad,dec_rad,redshift,Mvir,cvir\n0.01,0.0,0.5,0.674e12,9\n0.0101,0.0001,0.5,0.674e12,\n0.02,0.01,0.6,1e10,\n",
    )]);
    let options = "--mass-unit Msun/h --h 0.674 --footprint 0.56,0.58,-0.01,0.01 --z-lens 0.5 --z-source 1.5";
    succeeds(&folder, &format!("extract cone.csv -n 1 {options} --quiet -o out"));
    let found = haloes(&folder, "out", 0);
    let [m, c] = ["m200c_msun", "c200c"].map(|name| numbers(&found, name));
    assert_eq!(m.len(), 2);
    assert!(
        (m[0] / M200C_C200C[0] - 1.0).abs() < 1e-6 && (c[0] / M200C_C200C[1] - 1.0).abs() < 1e-6,
        "{m:?} {c:?}"
    );
    // The other has the same mass and the concentration of the configured relation.
    assert!(
        m[1] != m[0] && (0.8..0.95).contains(&(m[1] / 1e12)) && (5.0..10.0).contains(&c[1]),
        "{m:?} {c:?}"
    );
}

#[test]
fn what_is_not_clear_or_no_halo_is_refused_with_its_place() {
    let good = "ra_deg,dec_deg,z,m200c_msun,c200c\n10,0,0.5,1e12,8\n10.1,0.1,0.6,1e12,\n";
    let cone = |head: &str, row: &str| good.replace("ra_deg,dec_deg,z,m200c_msun,c200c", head) + row + "\n";
    let plain = "ra_deg,dec_deg,z,m200c_msun,c200c";
    for (name, text, options, wanted) in [
        (
            "a.csv",
            cone(plain, "10,0,nan,1e12,8"),
            "",
            "line 4, column z: is no number, but must be finite and positive",
        ),
        ("a.csv", cone(plain, "10,0,-0.001,1e12,8"), "", "line 4, column z: is -0.001"),
        (
            "a.csv",
            cone(plain, "10,91,0.4,1e12,8"),
            "",
            "line 4, column dec_deg: is 91, but must be from -90 to 90",
        ),
        ("a.csv", cone(plain, "400,0,0.4,1e12,8"), "", "line 4, column ra_deg: is 400"),
        ("a.csv", cone(plain, "10,0,0.4,-1e12,8"), "", "line 4, column m200c_msun: is -1000000000000"),
        (
            "a.csv",
            cone(plain, "10,0,0.4,1e12,-1"),
            "",
            "line 4, column c200c: is -1, but must be positive, or no number",
        ),
        ("a.csv", cone(plain, "10,0,0.4,abc,8"), "", "line 4, column m200c_msun: \"abc\" is not a number"),
        ("a.csv", cone("ra,dec,z,m200c_msun,c200c", ""), "", "column ra: states no unit"),
        ("a.csv", cone("ra_deg,dec_deg,z,mass,c200c", ""), "", "none is known as the mass"),
        (
            "a.csv",
            cone("ra_deg,dec_deg,z,m200c_msun_h,c200c", ""),
            "",
            "say h = H0/100 of the simulation with --h",
        ),
        ("a.csv", cone(plain, ""), "--h 0.7", "without h, but h = 0.7 is said"),
        ("a.csv", cone(plain, ""), "--footprint 5,5,0,1", "--footprint is 5, 5, 0, 1"),
        ("a.csv", cone(plain, ""), "--behind-mass 1e14,1e13", "--behind-mass is 10000000000000"),
        (
            "a.csv",
            cone(plain, ""),
            "--behind-mass 1e13,1e14",
            "is 0, but must be at least 1: ask for fewer sightlines",
        ),
        ("a.csv", cone(plain, ""), "--z-lens 2", "line_of_sight.z_lens is 2"),
        ("a.csv", cone(plain, ""), "./a.csv", "is given twice"),
        ("a.csv", cone(plain, ""), "--behind-delta-z 0.1", "left out without --behind-mass"),
        ("a.parquet", cone(plain, ""), "", "Parquet is not read"),
    ] {
        let folder = Folder::with(&[(name, &text)]);
        let output = folder.haloray(&format!("extract {name} -n 1 {options} -o out"));
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{wanted}: {said}");
        assert!(said.contains(wanted), "{wanted}: {said}");
        assert_eq!(folder.files().len(), 1, "{said}");
    }
}

#[test]
fn bad_rows_are_left_out_and_counted_where_that_is_asked_for() {
    let text =
        "ra_deg,dec_deg,z,m200c_msun\n10,0,0.5,1e12\nnan,0,0.5,1e12\n10,0.001,0.5,0\n10.01,0.01,0.7,1e12\n";
    let folder = Folder::with(&[("cone.csv", text)]);
    let output = folder.haloray("extract cone.csv -n 1 --skip-bad-rows --quiet -o out");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && said.contains("2 rows were left out"), "{said}");
    assert_eq!(numbers(&haloes(&folder, "out", 0), "lightcone_row"), [0.0, 3.0]);
    let before = folder.files();
    folder.haloray("extract cone.csv -n 3 --skip-bad-rows --quiet -o out");
    assert_eq!(index(&folder, "out").row_count(), 3);
    folder.haloray("extract cone.csv -n 1 --skip-bad-rows --quiet -o out");
    assert!(folder.files() == before, "the next run replaces the files of the one before, and those alone");
}

#[test]
fn sightlines_behind_haloes_point_at_them_and_leave_them_out() {
    let folder = Folder::with(&[]);
    let columns = cone(3000, around_ra_0);
    write(&folder, "cone.h5", columns.clone());
    let options = "--z-lens 0.5 --z-source 1.5 --behind-mass 2e11,1e14 --behind-delta-z 0.05 --quiet";
    succeeds(&folder, &format!("extract cone.h5 -n 6 {options} -o all"));
    succeeds(&folder, &format!("extract cone.h5 -n 2 --first 3 {options} -o some"));
    let index = index(&folder, "all");
    let [rows, masses, z] =
        ["lens_halo_row", "lens_halo_m200c_msun", "lens_halo_z"].map(|name| numbers(&index, name));
    let mut different = rows.clone();
    different.sort_by(f64::total_cmp);
    different.dedup();
    assert_eq!(different.len(), 6);
    for number in 0..6 {
        let row = rows[number] as usize;
        let own: Vec<f64> =
            columns.iter().map(|c| numbers(&Table::new(vec![c.clone()]).unwrap(), &c.name)[row]).collect();
        assert_eq!([own[2], own[3]], [z[number], masses[number]]);
        assert!((own[2] - 0.5).abs() <= 0.05 && (2e11..=1e14).contains(&own[3]));
        let centre = ["ra_deg", "dec_deg"].map(|name| numbers(&index, name)[number]);
        let expected: Vec<f64> =
            by_brute_force(&columns, centre).iter().map(|e| e.0).filter(|r| *r != rows[number]).collect();
        assert_eq!(numbers(&haloes(&folder, "all", number as u64), "lightcone_row"), expected);
    }
    for number in 3..5 {
        assert_eq!(haloes(&folder, "some", number).columns(), haloes(&folder, "all", number).columns());
    }
}

#[test]
fn an_ensemble_takes_its_sightlines_from_a_light_cone_in_any_shard() {
    let config = "[haloes]\nlightcone = { files = [\"cone.h5\"], footprint_deg = [359.5, 0.5, -0.5, 0.5] }\n";
    let folder = Folder::with(&[("cone.toml", config)]);
    write(&folder, "cone.h5", cone(6000, around_ra_0));
    succeeds(&folder, "ensemble cone.toml -n 4 --quiet --no-figures -o whole");
    fs::create_dir(folder.path("parts")).unwrap();
    succeeds(&folder, "ensemble cone.toml -n 4 --shard 1/2 --quiet --no-figures --threads 1 -o parts/1");
    succeeds(&folder, "ensemble cone.toml -n 4 --shard 2/2 --quiet --no-figures -o parts/2");
    succeeds(&folder, "merge parts --quiet --no-figures -o merged");
    let bytes = |name: &str| fs::read(folder.path(name)).unwrap();
    assert!(bytes("whole/sightlines.h5") == bytes("merged/sightlines.h5"));

    succeeds(&folder, "extract --config cone.toml -n 4 --quiet -o taken");
    succeeds(&folder, "ensemble -n 4 --set haloes.lightcone=taken --quiet --no-figures -o again");
    let table = |name: &str| Table::read(&folder.path(name), "sightlines").unwrap();
    let (whole, again) = (table("whole/sightlines.h5"), table("again/sightlines.h5"));
    for name in ["number_of_haloes", "gamma1_los", "gamma2_os", "delta_tot"] {
        let values = numbers(&whole, name);
        assert_eq!(values, numbers(&again, name), "{name}");
        assert!(values.iter().all(|value| value.is_finite() && *value != 0.0), "{name}: {values:?}");
    }

    succeeds(&folder, "populate cone.toml --sightline 2 --quiet -o two.h5");
    succeeds(&folder, "populate --set haloes.catalogue=taken/haloes/00002.h5 --quiet -o table.h5");
    let (two, taken) =
        (Table::read(&folder.path("two.h5"), "haloes"), Table::read(&folder.path("table.h5"), "haloes"));
    assert_eq!(two.unwrap().columns(), taken.unwrap().columns());
    let refused = folder.haloray("ensemble -n 9 --set haloes.lightcone=taken -o refused");
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(refused.status.code() == Some(2) && said.contains("has no sightline 4; it holds 4"), "{said}");
    let drawn = folder.haloray("study tidal cone.toml -n 1 -o refused");
    assert!(String::from_utf8_lossy(&drawn.stderr).contains("draws its haloes"));
}

#[test]
fn shards_of_light_cones_with_other_haloes_are_not_merged() {
    let cone = |mass: &str| {
        format!("ra_deg,dec_deg,z,m200c_msun,c200c\n10,0,0.5,{mass},8\n10.01,0.01,0.6,{mass},9\n")
    };
    let folder = Folder::with(&[("cone.csv", &cone("1e11"))]);
    let job = "ensemble --preset consistent -n 2 --set haloes.lightcone=cone.csv --no-figures --quiet";
    std::fs::create_dir_all(folder.path("parts")).unwrap();
    assert!(folder.haloray(&format!("{job} --shard 1/2 -o parts/1")).status.success());
    std::fs::write(folder.path("cone.csv"), cone("1e13")).unwrap();
    assert!(folder.haloray(&format!("{job} --shard 2/2 -o parts/2")).status.success());
    let merged = folder.haloray("merge parts --no-figures -o whole");
    let said = String::from_utf8_lossy(&merged.stderr);
    assert!(
        merged.status.code() == Some(2) && said.contains("another content of the files it names"),
        "{said}"
    );
}
