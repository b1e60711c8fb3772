//! The rooms of the house stand in one order: a room may use those before it, never those after.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Rooms in dependency order, as in docs/ARCHITECTURE.md.
const ROOMS: [&str; 17] = [
    "constants",
    "error",
    "monitor",
    "numerics",
    "profile",
    "cosmology",
    "halo",
    "mapping",
    "diagnostics",
    "imaging",
    "inference",
    "mock",
    "config",
    "pipeline",
    "io",
    "plot",
    "report",
];

fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
    files
}

/// Rooms that a source text names after `crate::`, its tests left out (they may build anything).
fn rooms_used(text: &str) -> Vec<&'static str> {
    let code = text.split("#[cfg(test)]").next().unwrap_or(text);
    let lines = code.lines().filter(|line| !line.trim_start().starts_with("//"));
    let named: Vec<&str> = lines.flat_map(|line| line.split("crate::").skip(1)).collect();
    ROOMS.into_iter().filter(|room| named.iter().any(|rest| first_word(rest) == *room)).collect()
}

fn first_word(text: &str) -> &str {
    text.split(|c: char| !c.is_alphanumeric() && c != '_').next().unwrap_or("")
}

fn rank(room: &str) -> usize {
    ROOMS.iter().position(|r| *r == room).unwrap_or_else(|| panic!("room {room} is not in the order"))
}

#[test]
fn every_room_uses_only_rooms_before_it() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut broken = Vec::new();
    let mut seen = BTreeMap::new();
    for file in rust_files(&source) {
        let inside = file.strip_prefix(&source).unwrap();
        let first = inside.components().next().unwrap().as_os_str().to_string_lossy().to_string();
        let room = first.trim_end_matches(".rs");
        if room == "lib" || room == "bin" {
            continue;
        }
        *seen.entry(room.to_string()).or_insert(0) += 1;
        for used in rooms_used(&std::fs::read_to_string(&file).unwrap()) {
            if rank(used) > rank(room) {
                broken.push(format!("{} uses {used}", inside.display()));
            }
        }
    }
    assert_eq!(seen.len(), ROOMS.len(), "rooms found: {seen:?}");
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

#[test]
fn the_check_sees_a_wrong_arrow() {
    assert_eq!(rooms_used("use crate::plot::Figure;\n// use crate::io::Table\n"), ["plot"]);
    assert!(rank("plot") > rank("profile"));
}
