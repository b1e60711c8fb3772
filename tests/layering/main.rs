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

/// Imports that close a circle or go against an order, and are to go. **This list only shrinks.**
const KNOWN: &[(&str, &str)] = &[];

fn library() -> Arrows {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    House::read(&source, "lib.rs", &["bin"]).arrows()
}

fn without_known(arrows: &Arrows) -> Arrows {
    let mut arrows = arrows.clone();
    arrows.iter_mut().for_each(|(from, to)| to.retain(|to| !KNOWN.contains(&(from.as_str(), to.as_str()))));
    arrows
}

/// Whatever is wrong with these imports.
fn faults(arrows: &Arrows) -> Vec<String> {
    let against = ORDERS.iter().flat_map(|order| order.arrows_against(arrows));
    against.chain(circles(arrows)).chain(circles_of_neighbours(arrows)).collect()
}

#[test]
fn imports_follow_the_orders_and_close_no_circle() {
    let found = faults(&without_known(&library()));
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

#[test]
fn the_list_of_known_faults_shrinks() {
    let arrows = library();
    let sound = without_known(&arrows);
    let is_at_fault = |(from, to): &(&str, &str)| {
        let mut with = sound.clone();
        let is_there = arrows.get(*from).is_some_and(|imported| imported.contains(*to));
        is_there && with.get_mut(*from).unwrap().insert((*to).to_owned()) && !faults(&with).is_empty()
    };
    let stale: Vec<_> = KNOWN.iter().filter(|known| !is_at_fault(known)).collect();
    assert!(stale.is_empty(), "take these off the list, they do no harm any more: {stale:#?}");
}
