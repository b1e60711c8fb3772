//! The rooms of the house stand in one order, the parts of some rooms too, and no two files import each other.

mod circles;
mod house;
mod imports;
mod orders;
mod synthetic;
mod tokens;

use std::path::Path;

use circles::{circles, circles_of_neighbours, leads};
use house::{Arrows, House};
use orders::ORDERS;

/// Imports that close a circle and are to go. **This list only shrinks.**
const KNOWN: &[(&str, &str)] = &[
    ("cosmology/eisenstein98.rs", "cosmology/linear.rs"),
    ("halo/concentration/mod.rs", "halo/concentration/diemer15.rs"),
    ("halo/concentration/mod.rs", "halo/concentration/diemer19.rs"),
    ("halo/concentration/mod.rs", "halo/concentration/duffy08.rs"),
    ("halo/mass_function/mod.rs", "halo/mass_function/press74.rs"),
    ("halo/mass_function/mod.rs", "halo/mass_function/sheth99.rs"),
    ("halo/mass_function/mod.rs", "halo/mass_function/tinker08.rs"),
    ("inference/diagnose/convergence/mod.rs", "inference/diagnose/convergence/autocorrelation_time.rs"),
    ("inference/diagnose/convergence/mod.rs", "inference/diagnose/convergence/effective_size.rs"),
    ("inference/diagnose/convergence/mod.rs", "inference/diagnose/convergence/split_r_hat.rs"),
    ("inference/sample/ensemble/mod.rs", "inference/sample/ensemble/slice.rs"),
    ("inference/sample/ensemble/mod.rs", "inference/sample/ensemble/stretch.rs"),
    ("inference/sample/valley/mod.rs", "inference/sample/valley/chain_block.rs"),
    ("inference/sample/valley/mod.rs", "inference/sample/valley/slow_directions.rs"),
    ("inference/sample/valley/position.rs", "inference/sample/valley/importance.rs"),
    ("mapping/multiplane/adaptive/survey.rs", "mapping/multiplane/adaptive/tile.rs"),
    ("mapping/multiplane/segment.rs", "mapping/multiplane/line_of_sight.rs"),
    ("numerics/elementary.rs", "numerics/real.rs"),
    ("plot/frame.rs", "plot/colour_bar.rs"),
    ("plot/layout.rs", "plot/figure.rs"),
    ("plot/figures/mod.rs", "plot/figures/flexion_maps.rs"),
    ("plot/figures/mod.rs", "plot/figures/images.rs"),
    ("plot/figures/mod.rs", "plot/figures/mosaic.rs"),
    ("plot/figures/mod.rs", "plot/figures/reconstruction.rs"),
    ("plot/figures/mod.rs", "plot/figures/recovery.rs"),
    ("plot/figures/mod.rs", "plot/figures/tidal_maps.rs"),
    ("plot/figures/mod.rs", "plot/figures/tidal_residuals.rs"),
    ("profile/mass/mod.rs", "profile/mass/epl.rs"),
    ("profile/mass/mod.rs", "profile/mass/external.rs"),
    ("profile/mass/mod.rs", "profile/mass/nfw.rs"),
    ("profile/mass/mod.rs", "profile/mass/point_mass.rs"),
    ("profile/mass/mod.rs", "profile/mass/sersic.rs"),
    ("profile/mass/mod.rs", "profile/mass/truncated_nfw.rs"),
    ("profile/mass/response.rs", "profile/mass/epl.rs"),
    ("profile/mass/response.rs", "profile/mass/nfw.rs"),
    ("profile/mass/response.rs", "profile/mass/sersic.rs"),
];

fn library() -> Arrows {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    House::read(&source, "lib.rs", &["bin"]).arrows()
}

fn is_known(from: &str, to: &str) -> bool {
    KNOWN.contains(&(from, to))
}

#[test]
fn every_part_imports_only_parts_before_it() {
    let arrows = library();
    let against: Vec<String> = ORDERS.iter().flat_map(|order| order.arrows_against(&arrows)).collect();
    assert!(against.is_empty(), "against the order:\n{}", against.join("\n"));
}

#[test]
fn every_part_has_its_place() {
    let arrows = library();
    for order in &ORDERS {
        let unnamed = order.unnamed(arrows.keys());
        assert!(unnamed.is_empty(), "without a place in the order of src/{}: {unnamed:?}", order.folder);
    }
    for room in ORDERS[0].parts {
        let found =
            arrows.keys().any(|file| orders::part_of("", file).unwrap().trim_end_matches(".rs") == *room);
        assert!(found, "the room {room} is gone");
    }
}

#[test]
fn no_two_files_import_each_other() {
    let mut arrows = library();
    arrows.iter_mut().for_each(|(from, imported)| imported.retain(|to| !is_known(from, to)));
    let found = circles(&arrows);
    assert!(found.is_empty(), "{}", found.join("\n"));
    let found = circles_of_neighbours(&arrows);
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn the_list_of_known_circles_shrinks() {
    let arrows = library();
    let closes = |from: &str, to: &str| {
        arrows.get(from).is_some_and(|imported| imported.contains(to)) && leads(to, from, &arrows)
    };
    let stale: Vec<_> = KNOWN.iter().filter(|(from, to)| !closes(from, to)).collect();
    assert!(stale.is_empty(), "take these off the list, they close no circle any more: {stale:#?}");
}
