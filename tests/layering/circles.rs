//! Files that import each other, directly or around a circle; folders too.

use std::collections::{BTreeMap, BTreeSet};

use crate::house::Arrows;
use crate::orders::part_of;

/// Groups of files each of which reaches every other of its group, with the arrows inside.
pub fn circles(arrows: &Arrows) -> Vec<String> {
    let mut groups = BTreeSet::new();
    for file in arrows.keys() {
        let reached = reached_from(file, arrows);
        if reached.contains(file.as_str()) {
            let back = |other: &&&str| reached_from(other, arrows).contains(file.as_str());
            groups.insert(reached.iter().filter(back).copied().collect::<Vec<_>>());
        }
    }
    groups.into_iter().map(|group| arrows_within(&group, arrows)).collect()
}

fn reached_from<'a>(file: &'a str, arrows: &'a Arrows) -> BTreeSet<&'a str> {
    let mut reached = BTreeSet::new();
    let mut open = vec![file];
    while let Some(next) = open.pop() {
        let further = arrows.get(next).into_iter().flatten().map(String::as_str);
        open.extend(further.filter(|other| reached.insert(*other)));
    }
    reached
}

fn arrows_within(group: &[&str], arrows: &Arrows) -> String {
    let lines = group.iter().flat_map(|file| {
        let inside = arrows[*file].iter().filter(|other| group.contains(&other.as_str()));
        inside.map(move |other| format!("    {file} imports {other}\n"))
    });
    format!("a circle:\n{}", lines.collect::<String>())
}

/// Circles of neighbours: in every folder, its files and folders, a folder taken as a whole.
pub fn circles_of_neighbours(arrows: &Arrows) -> Vec<String> {
    let folders: BTreeSet<&str> = arrows
        .keys()
        .flat_map(|file| file.match_indices('/').map(|(at, _)| &file[..at]))
        .chain([""])
        .collect();
    let of_folder = |folder: &&str| {
        let mut neighbours: Arrows = BTreeMap::new();
        for (file, imported) in arrows {
            let Some(own) = part_of(folder, file) else { continue };
            let others = imported.iter().filter_map(|other| part_of(folder, other));
            let others = others.filter(|other| *other != own).map(str::to_owned);
            neighbours.entry(own.to_owned()).or_default().extend(others);
        }
        let found = circles(&neighbours).into_iter();
        found.map(|circle| format!("in src/{folder} {circle}")).collect::<Vec<_>>()
    };
    folders.iter().flat_map(of_folder).collect()
}
