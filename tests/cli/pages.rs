//! The page of a run: what it must hold, that it repeats, and what the terminal says beside it.

use std::fs;

use crate::folder::Folder;
use crate::quick_run::{folder, succeeds};
use crate::small_image::{self, MODEL};
use haloray::io::Provenance;

fn read(folder: &Folder, name: &str) -> String {
    fs::read_to_string(folder.path(name)).unwrap()
}

/// What every page must be: one file that fetches nothing and names no place.
fn check_page(folder: &Folder, html: &str) {
    assert!(html.starts_with("\n<!DOCTYPE html>") || html.starts_with("<!DOCTYPE html>"), "{}", &html[..80]);
    assert!(html.len() < 5_000_000, "{} bytes", html.len());
    for fetched in ["src=\"http", "href=\"http", "@import", "url(http"] {
        assert!(!html.contains(fetched), "{fetched}");
    }
    assert!(!html.contains(&folder.path("").display().to_string()), "a path is in the page");
    assert_eq!(html.matches("<h1>").count(), 1);
    let mut ids: Vec<&str> = html.split(" id=\"").skip(1).filter_map(|rest| rest.split('"').next()).collect();
    let all = ids.len();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), all, "an id is there twice");
}

#[test]
fn the_page_of_a_run_holds_what_a_person_wants_and_repeats_from_the_saved_files() {
    let folder = folder();
    succeeds(&folder, "simulate small.toml -o run");
    let html = read(&folder, "run/report.html");
    check_page(&folder, &html);
    for wanted in [
        "<h1>haloray simulate</h1>",
        "One point stands for each pixel",
        "haloes on the line of sight",
        "haloray simulate config.toml -o simulate_again",
        "min_point_shear = 0.00001",
        "Tinker J. et al., 2008",
        "all − tidal, noisy",
        "term-LOS",
    ] {
        assert!(html.contains(wanted), "no {wanted}");
    }
    assert_eq!(html.matches("<figure ").count(), 6);
    assert!(html.find("One point stands") < html.find("haloes on the line of sight"), "warnings come first");
    // Made again it is the same, and the next run may still replace it.
    fs::write(folder.path("run/mine.csv"), "a\n1\n").unwrap();
    fs::remove_file(folder.path("run/report.html")).unwrap();
    assert_eq!(succeeds(&folder, "report run"), "run/report.html\n");
    assert!(read(&folder, "run/report.html") == html, "the page differs from the first");
    succeeds(&folder, "simulate small.toml --seed 2 -o run");
    fs::create_dir(folder.path("foreign")).unwrap();
    fs::write(folder.path("foreign/summary.json"), "{\"a\": 1}").unwrap();
    fs::write(folder.path("foreign/report.html"), "mine").unwrap();
    folder.check_failure(2, &folder.haloray("report foreign"), "report foreign", &["it is there already"]);
    assert_eq!(fs::read_to_string(folder.path("foreign/report.html")).unwrap(), "mine");
    let refused = folder.haloray("report .");
    folder.check_failure(2, &refused, "report .", &["no results of haloray"]);
}

#[test]
fn the_page_of_a_fit_warns_first_and_shows_the_posterior_and_the_residual() {
    let folder = Folder::with(&[("small.toml", MODEL)]);
    let image = small_image::image([0.0, 0.0], 0);
    image.write(&folder.path("image.fits"), &Provenance::new(None, "")).unwrap();
    let output = folder.haloray("fit image.fits --model small.toml -o fit --max-draws 20 --json");
    assert_eq!(output.status.code(), Some(1), "{}", String::from_utf8_lossy(&output.stderr));
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&json["folder"], &json["summary"]["converged"]), (&"fit".into(), &false.into()));
    let html = read(&folder, "fit/report.html");
    check_page(&folder, &html);
    for wanted in [
        "have not converged",
        "lens.theta_E",
        "R-hat",
        "Posterior, parameter by parameter",
        "residual",
        "--max-draws 20",
    ] {
        assert!(html.contains(wanted), "no {wanted}");
    }
    assert!(html.find("have not converged") < html.find("<h2 id=\"posterior\""));
    assert_eq!(succeeds(&folder, "report fit"), "fit/report.html\n");
    assert!(read(&folder, "fit/report.html") == html);
}

#[test]
fn figures_are_left_out_or_pictures_alone_where_that_is_wanted() {
    let folder = folder();
    succeeds(&folder, "study cut small.toml --cuts 1e-4,1e-5 --no-figures -o none");
    let html = read(&folder, "none/report.html");
    check_page(&folder, &html);
    assert!(!html.contains("<figure") && !folder.path("none/cut.svg").exists());
    succeeds(&folder, "study cut small.toml --cuts 1e-4,1e-5 --format png -o png");
    assert!(
        read(&folder, "png/report.html")
            .contains("<img alt=\"What the shear cut changes\" src=\"data:image/png")
    );
    assert!(folder.path("png/cut.png").is_file() && !folder.path("png/cut.svg").exists());
}

#[test]
fn a_style_and_a_format_hold_for_every_figure_and_the_page_takes_its_colour() {
    let folder = folder();
    succeeds(&folder, "study cut small.toml --cuts 1e-4,1e-5 --format svg,pdf -o screen");
    succeeds(&folder, "study cut small.toml --cuts 1e-4,1e-5 --style dark --format svg -o dark");
    succeeds(&folder, "study cut small.toml --cuts 1e-4,1e-5 --style paper --format svg -o paper");
    let [screen, dark, paper] =
        ["screen", "dark", "paper"].map(|name| read(&folder, &format!("{name}/cut.svg")));
    assert!(screen.contains("fill=\"#ffffff\"") && dark.contains("fill=\"#14161a\""));
    let width =
        |svg: &str| svg.split(" width=\"").nth(1).and_then(|rest| rest.split('"').next()).map(String::from);
    assert_eq!(width(&paper).as_deref(), Some("174mm"));
    assert_eq!(width(&screen), width(&paper));
    assert!(fs::read(folder.path("screen/cut.pdf")).unwrap().starts_with(b"%PDF-"));
    assert!(!folder.path("screen/cut.png").exists());
    assert!(read(&folder, "dark/report.html").contains("--card:#14161a"));
    assert!(!read(&folder, "screen/report.html").contains("--card:#"));
}

#[test]
fn maps_images_and_images_of_point_sources_have_pages() {
    let folder = folder();
    let model = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/point_source/model.json");
    fs::copy(model, folder.path("model.json")).unwrap();
    for (command, wanted) in [
        ("map small.toml -o map", "haloray map config.toml -o map_again"),
        ("image small.toml -o image", "haloray image config.toml -o image_again"),
        (
            "images model.json --source 0.1,0.05 --omega-m 0.3 -o images",
            "--source 0.1,0.05 --omega-m 0.3 -o images_again",
        ),
    ] {
        succeeds(&folder, command);
        let html = read(&folder, &format!("{}/report.html", command.split(' ').next().unwrap()));
        check_page(&folder, &html);
        assert!(html.contains(wanted) && html.contains("<figure "), "{command}");
        // Only one of them makes an image out of points.
        assert_eq!(
            html.contains("One point stands for each pixel"),
            command.starts_with("image "),
            "{command}"
        );
    }
}

#[test]
fn every_study_has_a_page_and_a_configuration_that_repeats_it() {
    let folder = folder();
    succeeds(&folder, "study cut small.toml --cuts 1e-4,1e-5 -o cut");
    let html = read(&folder, "cut/report.html");
    check_page(&folder, &html);
    // The lens's ring lies outside so small a field: nothing changes there.
    assert!(!html.contains("The cut has not converged") && html.contains("largest pixel over noise"));
    fs::copy(folder.path("cut/config.toml"), folder.path("config.toml")).unwrap();
    let repeat = html.split("haloray study cut ").nth(1).and_then(|rest| rest.split('\n').next()).unwrap();
    succeeds(&folder, &format!("study cut {}", repeat.replace("&#x2f;", "/")));
    assert!(read(&folder, "cut_again/report.html") == html);
}

#[test]
fn any_key_of_the_configuration_can_be_set_from_the_command_line() {
    let folder = folder();
    succeeds(&folder, "populate small.toml --set haloes.min_point_shear=1e-4 --set seed=5 -o set.csv");
    fs::write(folder.path("same.toml"), "seed = 5\n[haloes]\nmin_point_shear = 1e-4\n").unwrap();
    succeeds(&folder, "populate same.toml -o file.csv");
    assert_eq!(read(&folder, "set.csv"), read(&folder, "file.csv"));
    for (assignment, wanted) in [
        ("haloes.min_shear=1", "min_point_shear"),
        ("haloes.radius_cmpc=wide", "expected a number"),
        ("line_of_sight.z_lens=9", "line_of_sight.z_lens"),
        ("seed", "KEY=VALUE"),
    ] {
        let command = format!("populate small.toml --set {assignment} -o x.csv");
        folder.check_failure(2, &folder.haloray(&command), &command, &[wanted, "--set"]);
    }
}
