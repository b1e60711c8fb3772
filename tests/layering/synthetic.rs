//! The checks catch what they are for: made-up houses, one sound and each other with one fault.

use crate::circles::{circles, circles_of_neighbours};
use crate::house::{Arrows, House};
use crate::orders::{ORDERS, Order};

const PLAN: Order = Order { folder: "barn", parts: &["hay", "loft", "roof"] };

/// A sound house: hay ← loft ← roof, handed on by the room's front and used through it.
const SOUND: [(&str, &str); 7] = [
    ("lib.rs", "pub mod barn;\npub mod yard;\npub use barn::Hay;"),
    ("barn/mod.rs", "mod hay;\nmod loft;\nmod roof;\npub use hay::Hay;\npub use loft::ladder::Ladder;"),
    (
        "barn/hay.rs",
        "pub struct Hay;\n#[cfg(test)]\nmod tests { use super::*; use crate::barn::roof::Roof; }",
    ),
    ("barn/loft/mod.rs", "pub mod ladder;\nuse super::Hay;\npub struct Loft(Hay);"),
    ("barn/loft/ladder.rs", "/// Leads to [`crate::barn::roof::Roof`].\npub struct Ladder;"),
    (
        "barn/roof.rs",
        "use crate::barn::{hay, Ladder};\npub struct Roof(hay::Hay, super::loft::Loft, Ladder);",
    ),
    ("yard.rs", "use crate::Hay;\npub fn cart(_: Hay) -> crate::barn::Ladder { crate::barn::Ladder }"),
];

/// The sound house with text added to files.
fn with(added: &[(&str, &str)]) -> Arrows {
    let text = |file: &str, text: &str| {
        let more = added.iter().filter(|(name, _)| *name == file).map(|(_, more)| *more);
        std::iter::once(text).chain(more).collect::<Vec<_>>().join("\n")
    };
    let texts = SOUND.map(|(file, sound)| (file, text(file, sound)));
    House::of(texts.iter().map(|(file, text)| (*file, text.as_str())), "lib.rs").arrows()
}

fn imports(arrows: &Arrows, from: &str) -> Vec<String> {
    arrows[from].iter().cloned().collect()
}

#[test]
fn a_sound_house_passes_and_its_arrows_are_seen() {
    let arrows = with(&[]);
    assert_eq!(PLAN.arrows_against(&arrows), [""; 0]);
    assert_eq!(circles(&arrows), [""; 0]);
    assert_eq!(circles_of_neighbours(&arrows), [""; 0]);
    assert_eq!(PLAN.unnamed(arrows.keys()), [""; 0]);
    assert_eq!(imports(&arrows, "barn/roof.rs"), ["barn/hay.rs", "barn/loft/ladder.rs", "barn/loft/mod.rs"]);
    assert_eq!(imports(&arrows, "barn/loft/mod.rs"), ["barn/hay.rs"]);
    assert_eq!(imports(&arrows, "yard.rs"), ["barn/hay.rs", "barn/loft/ladder.rs"]);
    assert_eq!(imports(&arrows, "barn/mod.rs"), [""; 0]);
    assert_eq!(imports(&arrows, "barn/hay.rs"), [""; 0]);
}

#[test]
fn an_arrow_against_the_order_of_parts_is_caught() {
    for text in [
        "fn f() -> super::roof::Roof { g() }",
        "use crate::barn::roof::Roof;",
        "use super::super::barn::{loft::{self, Loft}};",
        "mod inner { fn f() { super::super::loft::Loft; } }",
    ] {
        let arrows = with(&[("barn/hay.rs", text)]);
        assert_eq!(PLAN.arrows_against(&arrows).len(), 1, "{text}: {arrows:?}");
    }
    assert_eq!(PLAN.arrows_against(&with(&[("yard.rs", "use crate::barn::roof::Roof;")])), [""; 0]);
}

#[test]
fn an_arrow_against_the_order_of_rooms_is_caught() {
    let texts = [("plot.rs", "pub struct Figure;"), ("profile/mod.rs", "use crate::plot::Figure;")];
    let arrows = House::of(texts, "lib.rs").arrows();
    assert_eq!(ORDERS[0].arrows_against(&arrows), ["profile/mod.rs imports plot.rs"]);
}

#[test]
fn a_circle_of_two_files_is_caught() {
    let arrows =
        with(&[("barn/loft/mod.rs", "use ladder::Ladder;"), ("barn/loft/ladder.rs", "use super::Loft;")]);
    let found = circles(&arrows);
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].contains("barn/loft/ladder.rs imports barn/loft/mod.rs"), "{found:?}");
}

#[test]
fn a_circle_of_three_files_is_caught() {
    let arrows =
        with(&[("barn/hay.rs", "use crate::yard::cart;"), ("yard.rs", "use crate::barn::roof::Roof;")]);
    let found = circles(&arrows);
    assert_eq!(found.len(), 1, "{found:?}");
    for file in
        ["barn/hay.rs imports yard.rs", "yard.rs imports barn/roof.rs", "barn/roof.rs imports barn/hay.rs"]
    {
        assert!(found[0].contains(file), "{file}: {found:?}");
    }
}

#[test]
fn a_circle_of_folders_without_one_of_files_is_caught() {
    let arrows = with(&[("barn/hay.rs", "use super::loft::ladder::Ladder;")]);
    assert_eq!(circles(&arrows), [""; 0]);
    assert_eq!(circles_of_neighbours(&arrows).len(), 1);
}

#[test]
fn a_front_that_uses_what_it_hands_on_imports_it() {
    let arrows = with(&[("barn/mod.rs", "pub fn stack(_: Hay) {}")]);
    assert_eq!(imports(&arrows, "barn/mod.rs"), ["barn/hay.rs"]);
}

#[test]
fn a_part_without_a_place_is_caught() {
    let files = ["barn/cellar/mod.rs", "barn/door.rs", "barn/loft/mod.rs"].map(str::to_owned);
    assert_eq!(PLAN.unnamed(files.iter()), ["cellar"]);
}
