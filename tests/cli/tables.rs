//! Tables of haloes and rays end to end: formats, columns, a halo by hand, a user's own catalogue.

use std::fs;

use crate::folder::Folder;
use crate::quick_run::{SMALL, column, folder, numbers, succeeds};
use haloray::io::{Column, ImageFile, Provenance, RunFileReader, Table, Values};

const FORMATS: [&str; 3] = ["csv", "h5", "fits"];

fn read(folder: &Folder, name: &str) -> Table {
    Table::read(&folder.path(name), "rays").unwrap()
}

#[test]
fn haloes_points_and_rays_mean_the_same_in_every_format() {
    let folder = folder();
    let points = Table::read(&folder.path("points.csv"), "points").unwrap();
    for format in FORMATS {
        points.write(&folder.path(format!("p.{format}")), "points", &Provenance::new(None, "")).unwrap();
        succeeds(&folder, &format!("populate small.toml -o haloes.{format}"));
        succeeds(
            &folder,
            &format!(
                "trace --haloes haloes.{format} --points p.{format} --z-source 1.5 --order 2 -o rays.{format}"
            ),
        );
    }
    let (haloes, rays) = (read(&folder, "haloes.csv"), read(&folder, "rays.csv"));
    assert!(haloes.row_count() > 4000);
    for format in &FORMATS[1..] {
        for (expected, name) in [(&haloes, "haloes"), (&rays, "rays")] {
            let found = read(&folder, &format!("{name}.{format}"));
            for c in expected.columns() {
                assert!(column(&found, &c.name) == c.values, "{name}.{format}: {}", c.name);
            }
        }
    }
}

#[test]
fn columns_of_traced_rays_have_the_documented_names_and_order() {
    let folder = folder();
    succeeds(&folder, "populate small.toml -o haloes.h5");
    let (beta, a) = (",beta_x_arcsec,beta_y_arcsec", ",a_xx,a_xy,a_yx,a_yy");
    let b = ",b_xxx,b_xxy,b_xyy,b_yxx,b_yxy,b_yyy";
    for (options, results) in [
        ("", beta.to_string()),
        ("--order 1", format!("{beta}{a}")),
        ("--order 2", format!("{beta}{a}{b}")),
        ("--order 1 --delay", format!("{beta}{a},delay_days")),
    ] {
        succeeds(
            &folder,
            &format!("trace --haloes haloes.h5 --points points.csv --z-source 1.5 {options} -o r.csv"),
        );
        let text = fs::read_to_string(folder.path("r.csv")).unwrap();
        let header = format!("theta_x_arcsec,theta_y_arcsec,id,note{results}");
        assert_eq!(text.lines().next(), Some(header.as_str()));
        assert!(text.lines().nth(2).unwrap().starts_with("-0.3,1.2,8,\"north, west\","), "{text}");
        assert!(folder.path("r.csv.provenance.toml").is_file());
    }
}

/// NFW: α(r) = α_Rs g(x)/(x g(1)), κ(r) = α_Rs f(x)/(2 r_s g(1)), x = r/r_s (Golse & Kneib 2002).
fn nfw_deflection_and_convergence(r: f64, r_s: f64, alpha_rs: f64) -> [f64; 2] {
    let x = r / r_s;
    let h = if x < 1.0 {
        (1.0 / x).acosh() / (1.0 - x * x).sqrt()
    } else {
        (1.0 / x).acos() / (x * x - 1.0).sqrt()
    };
    let (g, g1, f) = ((x / 2.0).ln() + h, 1.0 - 2f64.ln(), (1.0 - h) / (x * x - 1.0));
    [alpha_rs * g / (x * g1), alpha_rs * f / (2.0 * r_s * g1)]
}

#[test]
fn one_halo_deflects_as_computed_by_hand_with_and_without_its_sheet() {
    /// Rounding of the closed forms above.
    const TOLERANCE: f64 = 1e-13;
    let haloes = "z,theta_x_arcsec,theta_y_arcsec,r_s_arcsec,alpha_rs_arcsec\n0.7,-3,0,2,0.05\n";
    let points = "theta_x_arcsec,theta_y_arcsec\n1,0\n-2.5,0\n";
    let folder = Folder::with(&[("haloes.csv", haloes), ("points.csv", points)]);
    let [_, sheet] = nfw_deflection_and_convergence(3.0, 2.0, 0.05);
    for (option, kappa_sheet) in [("none", 0.0), ("on-axis", -sheet)] {
        let trace = "trace --haloes haloes.csv --points points.csv --z-source 1.5 --order 1 -o rays.csv";
        succeeds(&folder, &format!("{trace} --sheets {option}"));
        let rays = read(&folder, "rays.csv");
        for (i, x) in [1.0, -2.5].into_iter().enumerate() {
            let r = x + 3.0;
            let [alpha, kappa] = nfw_deflection_and_convergence(r, 2.0, 0.05);
            for (name, expected) in [
                ("beta_x_arcsec", x * (1.0 - kappa_sheet) - alpha),
                ("beta_y_arcsec", 0.0),
                ("a_xx", 1.0 - kappa_sheet - (2.0 * kappa - alpha / r)),
                ("a_xy", 0.0),
                ("a_yx", 0.0),
                ("a_yy", 1.0 - kappa_sheet - alpha / r),
            ] {
                let found = numbers(&rays, name)[i];
                assert!((found - expected).abs() < TOLERANCE, "{option} {name}: {found} against {expected}");
            }
        }
    }
}

#[test]
fn own_columns_of_a_catalogue_reach_every_table() {
    let haloes = "z,theta_x_arcsec,theta_y_arcsec,m200c_msun,c200c,id,name\n0.5,1,2,1e12,8,7,halo a\n0.6,3,1,1e11,9,8,b\n";
    let folder = folder();
    fs::write(folder.path("mine.csv"), haloes).unwrap();
    fs::write(folder.path("my.toml"), format!("{SMALL}[line_of_sight]\nsheets = \"none\"\n")).unwrap();
    let config =
        fs::read_to_string(folder.path("my.toml")).unwrap().replace("min_", "catalogue = \"mine.csv\"\nmin_");
    fs::write(folder.path("my.toml"), config).unwrap();
    succeeds(&folder, "simulate my.toml -o run");
    for name in ["copy.csv", "copy.h5", "copy.fits"] {
        assert!(succeeds(&folder, &format!("populate my.toml -o {name}")).starts_with("2 haloes written to"));
    }
    for name in ["copy.csv", "copy.h5", "copy.fits", "run/run.h5"] {
        let table = Table::read(&folder.path(name), "haloes").unwrap();
        assert_eq!(numbers(&table, "id"), [7.0, 8.0], "{name}");
        assert_eq!(column(&table, "name"), Values::Text(vec!["halo a".into(), "b".into()]), "{name}");
    }
}

/// Pixels of an image written by `haloray image`.
fn image(folder: &Folder, options: &str) -> Vec<f64> {
    succeeds(folder, &format!("image {options} --noise-free -o image.fits"));
    ImageFile::read(&folder.path("image.fits")).unwrap().data
}

#[test]
fn a_catalogue_by_angles_and_one_by_masses_give_the_same_pictures() {
    let folder = folder();
    succeeds(&folder, "populate small.toml -o all.csv");
    let all = read(&folder, "all.csv");
    let without = |names: [&str; 2]| {
        let kept = all.columns().iter().filter(|c| !names.contains(&c.name.as_str())).cloned();
        Table::new(kept.collect()).unwrap()
    };
    let masses = without(["r_s_arcsec", "alpha_rs_arcsec"]);
    let angles = without(["m200c_msun", "c200c"]);
    for (name, table) in [("masses.csv", masses), ("angles.csv", angles)] {
        table.write(&folder.path(name), "haloes", &Provenance::new(None, "")).unwrap();
        let text = SMALL.replace("[haloes]", &format!("[haloes]\ncatalogue = \"{name}\""));
        fs::write(folder.path(name.replace("csv", "toml")), text).unwrap();
    }
    let drawn = image(&folder, "small.toml");
    for options in ["masses.toml", "angles.toml", "small.toml --haloes masses.csv"] {
        assert!(image(&folder, options) == drawn, "{options}");
    }
    for (options, name) in [("small.toml", "a.h5"), ("small.toml --haloes angles.csv", "b.h5")] {
        succeeds(&folder, &format!("map {options} -o {name}"));
    }
    let kappa =
        |name: &str| RunFileReader::open(&folder.path(name)).unwrap().read_2d("maps", "kappa").unwrap();
    assert!(kappa("a.h5") == kappa("b.h5"));
    succeeds(&folder, "simulate angles.toml -o run");
    assert!(ImageFile::read(&folder.path("run/image_all_haloes_noise_free.fits")).unwrap().data == drawn);
}

#[test]
fn an_imported_catalogue_is_cut_limited_and_truncated_only_when_asked() {
    let folder = folder();
    succeeds(&folder, "populate small.toml -o all.csv");
    let populate = |keys: &str| {
        fs::write(folder.path("my.toml"), format!("[haloes]\ncatalogue = \"all.csv\"\n{keys}")).unwrap();
        succeeds(&folder, "populate my.toml -o out.h5");
        read(&folder, "out.h5")
    };
    let all = read(&folder, "all.csv").row_count();
    assert_eq!(populate("min_point_shear = 1e-4\n").row_count(), all);
    let cut = populate("min_point_shear = 1e-4\ncut_imported = true\n").row_count();
    assert!(cut > 0 && cut < all / 2, "{cut}");
    let limited = populate("max_kappa = 1e-4\n").row_count();
    assert!(limited > 0 && limited < all, "{limited}");
    let truncated = populate("profile = \"truncated-nfw\"\ntruncation_over_r_s = 4.0\n");
    let ratio = |i: usize| numbers(&truncated, "r_trunc_arcsec")[i] / numbers(&truncated, "r_s_arcsec")[i];
    assert!((ratio(0) - 4.0).abs() < 1e-15 && truncated.row_count() == all);
}

#[test]
fn another_seed_gives_other_haloes() {
    let folder = folder();
    for seed in [1, 2] {
        succeeds(&folder, &format!("populate small.toml --seed {seed} -o {seed}.csv"));
    }
    assert!(numbers(&read(&folder, "1.csv"), "z") != numbers(&read(&folder, "2.csv"), "z"));
}

#[test]
fn a_run_file_serves_as_halo_table() {
    let folder = folder();
    succeeds(&folder, "simulate small.toml -o run");
    succeeds(&folder, "populate small.toml -o haloes.h5");
    for (haloes, rays) in [("run/run.h5", "a.csv"), ("haloes.h5", "b.csv")] {
        succeeds(&folder, &format!("trace --haloes {haloes} --points points.csv --z-source 1.5 -o {rays}"));
    }
    assert_eq!(fs::read(folder.path("a.csv")).unwrap(), fs::read(folder.path("b.csv")).unwrap());
}

#[test]
fn columns_called_like_results_are_replaced_by_them() {
    let folder = folder();
    let table = Table::new(vec![
        Column::f64("theta_x_arcsec", None, vec![1.0]),
        Column::f64("theta_y_arcsec", None, vec![0.0]),
        Column::f64("beta_x_arcsec", None, vec![99.0]),
    ]);
    table.unwrap().write(&folder.path("p.h5"), "points", &Provenance::new(None, "")).unwrap();
    succeeds(&folder, "populate small.toml -o haloes.csv");
    succeeds(&folder, "trace --haloes haloes.csv --points p.h5 --z-source 1.5 -o rays.h5");
    let rays = read(&folder, "rays.h5");
    assert!(numbers(&rays, "beta_x_arcsec")[0] < 50.0);
    assert_eq!(rays.columns().len(), 4);
}

#[test]
fn tables_have_the_same_bytes_for_every_number_of_threads() {
    let folders = [folder(), folder()];
    for (folder, threads) in folders.iter().zip(["--threads 1", "--threads 2"]) {
        succeeds(folder, &format!("populate small.toml --seed 6 -o points.csv --overwrite {threads}"));
        for format in FORMATS {
            succeeds(folder, &format!("populate small.toml --seed 5 -o h.{format} {threads}"));
            let trace = format!("trace --haloes h.{format} --points points.csv --z-source 1.5 --order 2");
            succeeds(folder, &format!("{trace} -o r.{format} {threads}"));
        }
    }
    assert!(folders[0].files() == folders[1].files());
}

#[test]
fn a_ray_through_the_very_centre_of_a_halo_is_warned_of_and_one_that_is_bent_past_it_is_not() {
    let folder = folder();
    let head = "z,theta_x_arcsec,theta_y_arcsec,r_s_arcsec,alpha_rs_arcsec\n";
    let (far, near) = ("0.9,1,2,3,0.5\n", "0.2,4,2,3,0.5\n");
    fs::write(folder.path("points.csv"), "theta_x_arcsec,theta_y_arcsec\n0,0\n1,2\n").unwrap();
    let warned = |rows: &str, order: u8| {
        fs::write(folder.path("one.csv"), format!("{head}{rows}")).unwrap();
        let trace = "trace --haloes one.csv --points points.csv --z-source 1.5 -o rays.csv --overwrite";
        let output = folder.haloray(&format!("{trace} --order {order}"));
        assert!(output.status.success());
        String::from_utf8_lossy(&output.stderr).contains("1 ray meets the centre of a lens (row 2 first)")
    };
    assert!(warned(far, 1) && warned(far, 2));
    assert!(!warned(far, 0) && !warned(&format!("{far}{near}"), 1));
}

#[test]
fn a_table_of_no_haloes_is_written_but_not_traced() {
    let folder = folder();
    fs::write(folder.path("none.toml"), SMALL.replace("1e-5", "1e9")).unwrap();
    for format in FORMATS {
        assert!(succeeds(&folder, &format!("populate none.toml -o none.{format}")).starts_with("0 haloes"));
        let trace = format!("trace --haloes none.{format} --points points.csv --z-source 1.5 -o rays.csv");
        folder.check_failure(2, &folder.haloray(&trace), &trace, &["table: has no rows"]);
    }
}
