//! The rooms of the house stand in one order, the parts of some rooms too, and no two files import each other.

mod circles;
mod house;
mod imports;
mod orders;
mod synthetic;
mod tokens;

use std::path::Path;

use circles::{circles, circles_of_neighbours};
use house::{Arrows, House};
use orders::{ORDERS, part_of};

/// The arrows of the crate whose root file lies in the folder `inside` of `src`.
fn arrows(inside: &str, root: &str, without: &[&str]) -> Arrows {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src").join(inside);
    House::read(&source, root, without).arrows()
}

fn library() -> Arrows {
    arrows("", "lib.rs", &["bin"])
}

/// Whatever is wrong with these imports.
fn faults(arrows: &Arrows) -> Vec<String> {
    let against = ORDERS.iter().flat_map(|order| order.arrows_against(arrows));
    against.chain(circles(arrows)).chain(circles_of_neighbours(arrows)).collect()
}

#[test]
fn imports_follow_the_orders_and_close_no_circle() {
    let found = faults(&library());
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn subcommands_close_no_circle() {
    let arrows = arrows("bin/haloray", "main.rs", &[]);
    assert!(arrows["main.rs"].len() > 10, "{:?}", arrows["main.rs"]);
    let found = circles(&arrows);
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn every_part_has_its_place() {
    let arrows = library();
    for order in &ORDERS {
        let unnamed = order.unnamed(arrows.keys());
        assert!(unnamed.is_empty(), "without a place in the order of src/{}: {unnamed:?}", order.folder);
        let is_there = |part: &str| {
            arrows.keys().any(|file| {
                part_of(order.folder, file).is_some_and(|found| found.trim_end_matches(".rs") == part)
            })
        };
        let gone: Vec<_> = order.parts.iter().filter(|part| !is_there(part)).collect();
        assert!(gone.is_empty(), "in the order of src/{} and not there: {gone:?}", order.folder);
    }
}
