//! Every kind of bad input once: exit code 2, the fault with its place and what is allowed, a hint, nothing written.

use std::fs;

use crate::folder::Folder;
use haloray::io::{Column, ExposureKeywords, ImageFile, Provenance, Table};

const HALOES: &str = "z,theta_x_arcsec,theta_y_arcsec,r_s_arcsec,alpha_rs_arcsec\n0.5,1,2,3,0.1\n";
const HEAVY: &str = "z,theta_x_arcsec,theta_y_arcsec,m200c_msun,c200c\n0.5,1,2,1e12,8\n";
const POINTS: &str = "theta_x_arcsec,theta_y_arcsec\n1,0\n0,1\n";
const TRACE: &str = "trace --haloes haloes.csv --points points.csv --z-source 1.5 -o rays.csv";

fn folder() -> Folder {
    Folder::with(&[("haloes.csv", HALOES), ("heavy.csv", HEAVY), ("points.csv", POINTS)])
}

/// Runs a command that must end with exit code 2, say these texts, and leave the folder as it was.
fn refuses(folder: &Folder, arguments: &str, wanted: &[&str]) {
    let before = folder.files();
    folder.check_failure(2, &folder.haloray(arguments), arguments, wanted);
    assert!(folder.files() == before, "{arguments} left something behind");
}

/// Refuses each configuration with the texts after it.
fn refuses_configurations(cases: &[(&str, &[&str])]) {
    let folder = folder();
    for (config, wanted) in cases {
        fs::write(folder.path("my.toml"), config).unwrap();
        let wanted = [&["my.toml: "], *wanted].concat();
        refuses(&folder, "simulate my.toml -o run", &wanted);
    }
}

/// Refuses each text as the file of that name with the texts after it.
fn refuses_tables(name: &str, cases: &[(&str, &[&str])]) {
    let folder = folder();
    for (text, wanted) in cases {
        fs::write(folder.path(name), text).unwrap();
        refuses(&folder, TRACE, &[&[name], *wanted].concat());
    }
}

#[test]
fn keys_types_and_syntax_of_a_configuration_are_refused_with_line_and_column() {
    refuses_configurations(&[
        (
            "seed = 1\n[haloes]\nradius_mpc = 10.0\n",
            &["line 3, column 1", "unknown field `radius_mpc`", "`radius_cmpc`"],
        ),
        ("[haloez]\n", &["line 1, column 2", "unknown field `haloez`", "`haloes`"]),
        ("[lens]\nslope = \"steep\"\n", &["line 2, column 9", "string \"steep\"", "a number"]),
        ("[image]\npixels = 5.5", &["line 2, column 10", "`5.5`", "a whole number"]),
        ("haloes = 3", &["line 1, column 10", "integer `3`", "a section with keys"]),
        ("[haloes]\nepoch = { frozen = 1.0 }", &["line 2", "`frozen`", "`evolving` or `frozen_z`"]),
        (
            "[line_of_sight]\nsheets = \"some\"",
            &["line 2, column 10", "`some`", "`on-axis`, `none`, `mean-density`"],
        ),
        ("[lens_light]\nmagnitude = 20.0", &["line 1, column 1", "missing field `radius_arcsec`"]),
        ("[haloes", &["line 1, column 8", "expected `]`"]),
        ("seed = 1\nseed = 2\n", &["line 2, column 1", "duplicate key"]),
    ]);
}

#[test]
fn numbers_of_a_configuration_outside_their_domain_are_refused_with_key_and_domain() {
    refuses_configurations(&[
        (
            "[line_of_sight]\nz_lens = 1.5",
            &["line 2, column 10", "line_of_sight.z_lens is 1.5", "below z_source = 1.5"],
        ),
        ("[line_of_sight]\nz_lens = nan", &["line 2", "z_lens is NaN", "a finite number, above 0"]),
        ("[line_of_sight]\nz_source = inf", &["line 2", "z_source is inf", "at most 20"]),
        ("seed = -1", &["line 1, column 8", "`-1`", "a whole number, zero or more"]),
        ("seed = 9223372036854775808", &["line 1, column 8", "at most 9223372036854775807"]),
        ("seed = 99999999999999999999", &["line 1, column 8", "a whole number"]),
        ("[cosmology]\nomega_m = 2.0", &["line 2, column 11", "omega_m is 2", "at most 1"]),
        ("[structure]\nsigma8 = -1.0", &["line 2, column 10", "structure.sigma8 is -1", "positive"]),
        ("[haloes]\nmass_min_msun = 1e2", &["line 2, column 17", "haloes.mass_min_msun is 100", "from 1e4"]),
        ("[haloes]\nradius_cmpc = -1.0", &["line 2", "haloes.radius_cmpc is -1", "positive"]),
        ("[haloes]\nmax_kappa = 0.0", &["line 2", "haloes.max_kappa is 0", "left out to keep all"]),
        ("[haloes]\nprofile = \"truncated-nfw\"", &["line 1", "haloes.truncation_over_r_s is missing"]),
        ("[lens]\ne1 = 0.1", &["line 1", "lens.e2 is missing", "given together with e1"]),
        ("[source]\ne1 = 0.8\ne2 = 0.8", &["line 2", "source.e1 is 0.8", "below 1"]),
        ("[source]\nmagnitude = -5000", &["line 2", "source.magnitude is -5000", "from -100 to 100"]),
        ("[image]\npixels = 0", &["line 2, column 10", "image.pixels is 0", "from 1 to 4096"]),
        ("[maps]\npoints = 1", &["line 2", "maps.points is 1", "from 2 to 2048"]),
        ("[instrument]\npsf_fwhm_arcsec = 1e9", &["line 2", "psf_fwhm_arcsec is 1000000000", "4096 pixels"]),
    ]);
}

#[test]
fn a_mass_definition_that_a_relation_does_not_cover_is_refused_with_its_line() {
    refuses_configurations(&[
        (
            "[haloes]\nmass_definition = \"fof\"",
            &["line 2, column 19", "tinker08", "fof", "200m to 3200m", "hint: sheth99"],
        ),
        (
            "[haloes]\n\nmass_function = \"sheth99\"",
            &["line 3, column 17", "sheth99", "200c", "allowed: fof", "mass_definition = \"fof\""],
        ),
        (
            "[haloes]\nmass_definition = \"500c\"",
            &["line 2, column 19", "haloes.mass_definition is 500c", "200c"],
        ),
        ("[haloes]\nmass_definition = \"large\"", &["line 2, column 19", "\"large\"", "\"200c\""]),
    ]);
}

#[test]
fn a_configuration_that_is_no_text_no_file_or_given_twice_is_refused() {
    let folder = folder();
    fs::write(folder.path("my.toml"), b"\x89HDF\xff\xfe\x00").unwrap();
    refuses(&folder, "simulate my.toml -o run", &["my.toml: is not a TOML file: not UTF-8 text"]);
    refuses(&folder, "simulate missing.toml -o run", &["cannot read missing.toml: No such file"]);
    refuses(&folder, "simulate . -o run", &["cannot read .: Is a directory"]);
    refuses(&folder, "simulate my.toml my.toml -o run", &["unexpected argument 'my.toml'"]);
}

#[test]
fn a_population_too_large_for_memory_is_refused_before_it_is_drawn() {
    let folder = folder();
    fs::write(folder.path("my.toml"), "[haloes]\nradius_cmpc = 1e5\nmin_point_shear = 0.0").unwrap();
    let wanted = ["expected number of haloes is 78815535337583", "at most 1e8", "haloes.min_point_shear"];
    refuses(&folder, "populate my.toml -o haloes.h5", &wanted);
}

#[test]
fn haloes_outside_their_domain_are_refused_with_line_and_column() {
    let angles = |row: &str| format!("{HALOES}{row}\n");
    let masses = |row: &str| format!("# mine\n{HEAVY}{row}\n");
    let cases: [(String, &[&str]); 13] = [
        (angles("inf,1,2,3,0.1"), &["line 3, column z: inf", "finite numbers only"]),
        (angles("0,1,2,3,0.1"), &["line 3, column z: 0", "above 0"]),
        (angles("-0.1,1,2,3,0.1"), &["line 3, column z: -0.1", "above 0"]),
        (angles("0.5,1,2,-3,0.1"), &["line 3, column r_s_arcsec: -3", "positive"]),
        (angles("0.5,1,2,3,-0.1"), &["line 3, column alpha_rs_arcsec: -0.1", "no negative mass"]),
        (angles("0.5,NaN,2,3,0.1"), &["line 3, column theta_x_arcsec: NaN", "finite numbers only"]),
        (angles("0.5,1,-inf,3,0.1"), &["line 3, column theta_y_arcsec: -inf", "finite numbers only"]),
        (angles("0.5,1,2,3,1e400"), &["line 3, column alpha_rs_arcsec: inf", "finite numbers only"]),
        (angles("0.5,1,two,3,0.1"), &["line 3, column theta_y_arcsec: \"two\" is not a number"]),
        (angles("0.5,1,,3,0.1"), &["line 3, column theta_y_arcsec: is empty", "a number is wanted"]),
        (angles("0.5,1,2,0.1"), &["line 3: has 4 fields, but the header has 5"]),
        (masses("0.5,1,2,-1e300,8"), &["line 4, column m200c_msun: -1e300", "no negative mass"]),
        (masses("0.5,1,2,1e12,0"), &["line 4, column c200c: 0", "positive"]),
    ];
    let cases: Vec<(&str, &[&str])> = cases.iter().map(|(text, wanted)| (text.as_str(), *wanted)).collect();
    refuses_tables("haloes.csv", &cases);
}

#[test]
fn tables_without_what_is_needed_are_refused_with_the_columns_wanted() {
    refuses_tables(
        "haloes.csv",
        &[
            ("", &["is empty; a header line", "hint: tables are"]),
            ("z,theta_x_arcsec\n", &["table: has no rows", "hint: a halo table has z,"]),
            ("z,theta_x_arcsec\n0.5,1\n", &["neither r_s_arcsec,alpha_rs_arcsec nor m200c_msun,c200c"]),
            (&HALOES.replace("theta_y", "y"), &["column theta_y_arcsec: is missing", "y_arcsec"]),
            (&HALOES.replace("theta_y", "theta_x"), &["line 1: two columns are called theta_x_arcsec"]),
            (&HALOES.replace(',', "|"), &["the columns present are z|theta_x_arcsec"]),
            ("0.5,1,2\n0.5,2,3\n", &["line 1: the first line must hold the column names"]),
            (&HALOES.replace("alpha_rs", "r_trunc"), &["column alpha_rs_arcsec: is missing"]),
        ],
    );
    refuses_tables(
        "points.csv",
        &[
            ("", &["is empty"]),
            ("theta_x_arcsec,theta_y_arcsec\n", &["table: has no rows"]),
            ("theta_x_arcsec,theta_y_arcsec\n1,here\n", &["line 2, column theta_y_arcsec: \"here\""]),
            ("theta_x_arcsec,theta_y_arcsec\n1,nan\n", &["line 2, column theta_y_arcsec: NaN"]),
            ("x,y\n1,2\n", &["column theta_x_arcsec: is missing; the columns present are x, y"]),
        ],
    );
}

#[test]
fn binary_tables_with_bad_numbers_or_cut_short_are_refused() {
    let folder = folder();
    let columns = ["z", "theta_x_arcsec", "theta_y_arcsec", "r_s_arcsec", "alpha_rs_arcsec"];
    for name in ["haloes.h5", "haloes.fits"] {
        let trace = TRACE.replace("haloes.csv", name);
        for (bad, shown) in [(f64::NAN, "NaN"), (f64::INFINITY, "inf"), (-1.0, "-1")] {
            let column = |(i, name): (usize, &&str)| {
                Column::f64(name, None, vec![0.5, if i == 3 { bad } else { 0.5 }])
            };
            let table = Table::new(columns.iter().enumerate().map(column).collect()).unwrap();
            let table = table.with_gaps_in(columns.into_iter());
            table.write(&folder.path(name), "haloes", &Provenance::new(None, "")).unwrap();
            refuses(&folder, &trace, &[name, &format!("row 2, column r_s_arcsec: {shown}")]);
        }
        let bytes = fs::read(folder.path(name)).unwrap();
        fs::write(folder.path(name), &bytes[..bytes.len() - 2850]).unwrap();
        refuses(&folder, &trace, &[name, "truncated", "hint: the file is damaged"]);
        fs::write(folder.path(name), "").unwrap();
        refuses(&folder, &trace, &[name, "is empty"]);
        fs::write(folder.path(name), HALOES).unwrap();
        refuses(&folder, &trace, &[name, "is not a"]);
    }
}

#[test]
fn inputs_that_are_no_files_of_a_known_kind_are_refused() {
    let folder = folder();
    fs::create_dir(folder.path("folder.csv")).unwrap();
    for (input, wanted) in [
        ("missing.csv", "cannot read missing.csv: No such file"),
        ("folder.csv", "cannot read folder.csv: Is a directory"),
        ("haloes.txt", "haloes.txt: the extension does not name a table format; allowed: .csv"),
    ] {
        refuses(&folder, &TRACE.replace("haloes.csv", input), &[wanted]);
        refuses(&folder, &TRACE.replace("points.csv", input), &[wanted]);
        refuses(&folder, &format!("map --haloes {input} -o maps"), &[wanted]);
        refuses(&folder, &format!("image --haloes {input} -o image.fits"), &[wanted]);
    }
    fs::write(folder.path("my.toml"), "[haloes]\ncatalogue = \"missing.csv\"").unwrap();
    refuses(&folder, "simulate my.toml -o run", &["cannot read missing.csv", "looked for beside it"]);
}

#[test]
fn angles_reduced_to_another_source_than_the_masses_say_are_refused() {
    let folder = folder();
    let wanted = ["mixed.csv", "contradict each other for a source at z = 2", "leave out either"];
    let text =
        "z,theta_x_arcsec,theta_y_arcsec,r_s_arcsec,alpha_rs_arcsec,m200c_msun,c200c\n0.5,1,2,3,0.5,1e12,8\n";
    fs::write(folder.path("mixed.csv"), text).unwrap();
    refuses(&folder, &TRACE.replace("haloes.csv", "mixed.csv").replace("1.5", "2"), &wanted);
}

#[test]
fn the_shear_cut_on_a_catalogue_without_masses_is_refused() {
    let folder = folder();
    fs::write(folder.path("my.toml"), "[haloes]\ncatalogue = \"haloes.csv\"\ncut_imported = true").unwrap();
    refuses(
        &folder,
        "simulate my.toml -o run",
        &["haloes.csv: column m200c_msun: is missing", "cut_imported"],
    );
}

#[test]
fn a_halo_on_the_very_axis_is_refused_before_anything_is_traced() {
    let folder = folder();
    let text = "z,theta_x_arcsec,theta_y_arcsec,m200c_msun,c200c\n0.4,3,2,1e11,8\n0.3,0,0,1e10,10\n";
    fs::write(folder.path("axis.csv"), text).unwrap();
    let wanted = ["position of halo 2 is (0, 0), but must be off the axis ray", "Δ_h no value"];
    refuses(&folder, "simulate --preset consistent --set haloes.catalogue=axis.csv -o run", &wanted);
}

#[test]
fn point_spread_functions_that_are_none_are_refused() {
    let folder = folder();
    let image = |nx: usize, ny: usize, value: f64, pixel_scale_arcsec: f64| ImageFile {
        data: vec![value; nx * ny],
        nx,
        ny,
        pixel_scale_arcsec,
        keywords: ExposureKeywords::default(),
        psf: None,
        mask: None,
    };
    fs::write(folder.path("my.toml"), "[instrument]\npsf_file = \"psf.fits\"").unwrap();
    for (image, wanted) in [
        (image(4, 4, 1.0, 0.08), "4×4, but must be square with an odd number of pixels"),
        (image(5, 3, 1.0, 0.08), "5×3, but must be square with an odd number of pixels"),
        (image(3, 3, -1.0, 0.08), "sum of the PSF kernel is -9, but must be positive"),
        (image(3, 3, 1.0, 0.05), "pixels of 0.05 arcsec, but must have those of the image, 0.08 arcsec"),
    ] {
        image.write(&folder.path("psf.fits"), &Provenance::new(None, "")).unwrap();
        refuses(&folder, "image my.toml -o image.fits", &["psf.fits: ", wanted, "hint: a PSF kernel"]);
    }
    image(3, 3, 1.0, 0.08).write(&folder.path("psf.fits"), &Provenance::new(None, "")).unwrap();
    let mut bytes = fs::read(folder.path("psf.fits")).unwrap();
    let pixel = bytes.windows(8).position(|part| part == 1_f64.to_be_bytes()).unwrap();
    bytes[pixel..pixel + 8].copy_from_slice(&f64::NAN.to_be_bytes());
    fs::write(folder.path("psf.fits"), bytes).unwrap();
    refuses(&folder, "image my.toml -o image.fits", &["psf.fits: ", "PSF holds NaN; finite numbers only"]);
    fs::write(folder.path("psf.fits"), "P2 3 3").unwrap();
    refuses(&folder, "simulate my.toml -o run", &["psf.fits: is not a FITS file"]);
    // After --fit the file is the configuration all the same.
    refuses(&folder, "simulate --fit my.toml -o run", &["psf.fits: is not a FITS file"]);
    fs::remove_file(folder.path("psf.fits")).unwrap();
    refuses(&folder, "simulate my.toml -o run", &["cannot read psf.fits"]);
}

#[test]
fn options_outside_their_domain_are_refused_by_name() {
    let folder = folder();
    for (option, wanted) in [
        ("--z-source nan", "--z-source is NaN, but must be a finite number, above 0"),
        ("--z-source 0", "--z-source is 0, but must be above 0"),
        ("--z-source -1", "--z-source is -1, but must be above 0"),
        ("--z-source inf", "--z-source is inf"),
        ("--z-source far", "invalid value 'far' for '--z-source"),
        ("--z-source 1.5 --to-z 2", "--to-z is 2, but must be above 0 and at most --z-source = 1.5"),
        ("--z-source 1.5 --from-z 0.4 --to-z 0.3", "--from-z is 0.4, but must be above 0 and below"),
        ("--z-source 1.5 --accuracy nonsense", "'nonsense' for '--accuracy <exact|ARCSEC>': must be `exact`"),
        ("--z-source 1.5 --accuracy -1", "'-1' for '--accuracy <exact|ARCSEC>': must be `exact`"),
        ("--z-source 1.5 --order 3", "'3' for '--order <0|1|2>': must be a whole number from 0 to 2"),
        ("--z-source 1.5 --sheets mean-density", "[possible values: on-axis, none]"),
        ("--z-source 1.5 --omega-m 2", "--omega-m is 2, but must be above 0 and at most 1"),
        ("--z-source 1.5 --h0-km-s-mpc -70", "--h0-km-s-mpc is -70, but must be from 10 to 1000"),
        ("--z-source 1.5 --threads 0", "'0' for '--threads <N>': must be a whole number from 1 to 1024"),
        ("", "--z-source <Z>"),
    ] {
        refuses(&folder, &TRACE.replace("--z-source 1.5", option), &[wanted, "hint: `--help`"]);
    }
    for (command, wanted) in [
        ("simulate --seed -1 -o run", "'-1' for '--seed <N>': must be a whole number from 0 to 92233"),
        ("populate --seed 99999999999999999999 -o a.csv", "must be a whole number from 0 to 92233"),
        ("simulate --preset mine -o run", "[possible values: paper, consistent]"),
        ("simulate", "--output <DIR>"),
        ("map --grid-points 1 -o maps", "must be a whole number from 2 to 2048"),
        ("map --half-width-arcsec -1 -o maps", "--half-width-arcsec is -1, but must be positive"),
        (
            "ensemble -n 1e4 -o many",
            "'1e4' for '--number <N>': must be a whole number from 1 to 1099511627775, in digits",
        ),
        (
            "ensemble -n 4 --submit slurm --time 1h -o many",
            "'1h' for '--time <D-HH:MM>': must be minutes, or a time",
        ),
        ("ensemble -n 4 --submit slurm --time 1-2:3:4:5 -o many", "must be minutes, or a time"),
        ("ensemble -n 4 --submit slurm --time 1:30 -o many", "must be minutes, or a time as 1:30:00"),
        ("ensemble -n 4 --submit slurm --memory 1 -o many", "must be a whole number with K, M, G or T"),
        ("ensemble -n 4 --submit slurm --memory 1x -o many", "must be a whole number with K, M, G or T"),
        ("completions tcsh", "[possible values: bash, elvish, fish, powershell, zsh]"),
        ("observe", "unrecognized subcommand 'observe'"),
    ] {
        refuses(&folder, command, &[wanted, "hint: `--help`"]);
    }
}

#[test]
fn what_a_misspelt_or_misplaced_key_was_to_be_is_said() {
    let folder = folder();
    for (assignment, wanted) in [
        ("haloes.min_point_sheer=1e-5", "did you mean `min_point_shear`? unknown field"),
        ("min_point_shear=1e-5", "did you mean `haloes.min_point_shear`? unknown field"),
        ("halos.draw=direct", "did you mean `haloes`? unknown field"),
        ("haloes.draw=brute_force", "did you mean `brute-force`? unknown variant"),
        ("cosmology.omega_l=0.7", "did you mean `omega_m`? unknown field"),
        ("haloes.wisdom=1", "1: unknown field `wisdom`"),
    ] {
        refuses(&folder, &format!("simulate --set {assignment} -o run"), &["error: --set ", wanted]);
    }
    std::fs::write(folder.path("my.toml"), "[haloes]\nmin_point_sheer = 1e-5\n").unwrap();
    refuses(
        &folder,
        "simulate my.toml -o run",
        &["my.toml: line 2, column 1: did you mean `min_point_shear`?"],
    );
}

#[test]
fn two_words_on_the_same_key_and_words_without_effect_are_refused() {
    let folder = folder();
    for (command, wanted) in [
        ("simulate --seed 3 --set seed=4 -o run", "--seed is 3, but must be left out beside --set seed=4"),
        (
            "simulate --draw direct --set haloes.draw=\"direct\" -o run",
            "--draw is direct, but must be left out beside --set haloes.draw=\"direct\"",
        ),
        (
            "map --haloes haloes.csv --set haloes.catalogue=haloes.csv -o maps",
            "--haloes is haloes.csv, but must be left out beside --set haloes.catalogue=haloes.csv",
        ),
        ("map --haloes haloes.csv --draw brute-force -o maps", "--draw is brute-force, but must be left out"),
        ("map --haloes haloes.csv --seed 3 -o maps", "--seed is 3, but must be left out beside --haloes"),
    ] {
        refuses(&folder, command, &[wanted]);
    }
}

#[test]
fn a_file_of_the_users_own_is_replaced_on_request_alone() {
    let folder = folder();
    fs::write(folder.path("rays.csv"), "my notes").unwrap();
    let wanted = "cannot write to rays.csv: it is there already, and no unchanged file of haloray; give another name, or allow it";
    refuses(&folder, TRACE, &[wanted]);
    assert!(folder.haloray(&format!("{TRACE} --overwrite")).status.success());
    assert!(folder.haloray(TRACE).status.success(), "its own file is replaced");
}

#[test]
fn outputs_that_cannot_be_written_are_refused_before_any_work() {
    let folder = folder();
    fs::create_dir(folder.path("taken.csv")).unwrap();
    for (output, wanted) in [
        ("missing/rays.csv", "cannot write to missing/rays.csv: No such file"),
        ("taken.csv", "cannot write to taken.csv: it is a folder"),
        ("points.csv/rays.csv", "cannot write to points.csv/rays.csv: Not a directory"),
        ("points.csv", "cannot write to points.csv: it is an input of this command"),
        ("haloes.csv", "cannot write to haloes.csv: it is an input of this command"),
        ("rays.txt", "rays.txt: the extension does not name a table format; allowed: .csv"),
        ("rays", "rays: the extension does not name a table format"),
    ] {
        refuses(&folder, &TRACE.replace("rays.csv", output), &[wanted]);
    }
    fs::write(folder.path("plain"), "a file").unwrap();
    for (command, wanted) in
        [("map", "a file ending in .h5 or .hdf5"), ("image", "a file ending in .fits or .fit")]
    {
        refuses(&folder, &format!("{command} -o new.csv"), &["new.csv: -o takes a folder or", wanted]);
    }
    refuses(
        &folder,
        "image --noise-free -o images",
        &["--noise-free is given, but must be left out with a folder"],
    );
    for command in ["simulate", "map", "image"] {
        for (output, wanted) in [
            ("missing/run", "cannot write to missing/run: No such file"),
            ("plain", "cannot write to plain: it is a file; a folder is wanted"),
            ("points.csv/run", "cannot write to points.csv/run: Not a directory"),
        ] {
            refuses(&folder, &format!("{command} -o {output}"), &[wanted, "hint: choose another place"]);
        }
    }
}

#[cfg(unix)]
#[test]
fn write_protected_places_are_refused_before_any_work() {
    use std::os::unix::fs::PermissionsExt;
    let folder = folder();
    let protect = |name: &str, mode: u32| {
        fs::set_permissions(folder.path(name), fs::Permissions::from_mode(mode)).unwrap();
    };
    fs::write(folder.path("former.csv"), "former").unwrap();
    protect("former.csv", 0o444);
    let former = TRACE.replace("rays.csv", "former.csv");
    refuses(&folder, &former, &["cannot write to former.csv: the existing file is write-protected"]);

    fs::create_dir(folder.path("protected")).unwrap();
    protect("protected", 0o555);
    if fs::write(folder.path("protected/probe"), "").is_ok() {
        println!("a protected folder is not tried: this user may write everywhere");
        return;
    }
    for command in ["simulate -o protected", "simulate -o protected/run", "populate -o protected/haloes.csv"]
    {
        refuses(&folder, command, &["cannot write to protected", "Permission denied"]);
    }
    protect("protected", 0o755);
}

#[test]
fn columns_that_a_format_cannot_hold_are_refused_by_name() {
    let folder = folder();
    fs::write(folder.path("points.csv"), "theta_x_arcsec,theta_y_arcsec,S/N,γ\n1,0,7,8\n").unwrap();
    let wanted = ["rays.h5: column S/N: HDF5 cannot hold '/'", "write .csv"];
    refuses(&folder, &TRACE.replace("rays.csv", "rays.h5"), &wanted);
    let wanted = ["rays.fits: column γ: FITS cannot hold \"γ\", only plain ASCII"];
    refuses(&folder, &TRACE.replace("rays.csv", "rays.fits"), &wanted);
}

#[test]
fn a_calibration_asks_for_priors_to_draw_from() {
    let folder = folder();
    for (model, wanted) in [
        ("power-law", ["amplitude of a light", "mean ≥ 5 sd: systems are drawn from it"]),
        ("nothing", ["the model is nothing", "power-law"]),
        ("none.toml", ["none.toml", "No such file"]),
    ] {
        refuses(&folder, &format!("study calibration --model {model} -n 2 -o out"), &wanted);
    }
}
