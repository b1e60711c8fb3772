//! What one source file declares and names: its modules and items, its `use` statements, its inline paths.

use std::collections::{BTreeMap, BTreeSet};

use crate::tokens::words;

/// A path as written, `crate::a::B`, seen from an inline module so many levels below the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Named {
    pub path: Vec<String>,
    /// `pub use` of this name and no other mention of it: the file hands it on and does not use it.
    pub only_handed_on: bool,
}

/// What a file says of others.
#[derive(Debug, Default)]
pub struct Source {
    /// Paths of `use` statements and of code.
    pub named: Vec<Named>,
    /// Names that `use` statements bring in, with their paths; `*` stands for what a glob brings in.
    pub brought_in: BTreeMap<String, Vec<Vec<String>>>,
    /// Structs, functions and other items with names.
    pub items: BTreeSet<String>,
}

/// Keywords in front of the name of an item.
const ITEMS: [&str; 9] = ["fn", "struct", "enum", "trait", "type", "const", "static", "union", "mod"];

impl Source {
    pub fn parse(text: &str) -> Self {
        let words = words(text);
        let mut source = Self::default();
        let mut handed_on = Vec::new();
        let mut mentioned = BTreeSet::new();
        // Depths of the braces of inline modules around the word.
        let (mut depth, mut inline) = (0, Vec::new());
        let mut at = 0;
        while at < words.len() {
            let next = words.get(at + 1).copied().unwrap_or("");
            match words[at] {
                "{" => depth += 1,
                "}" => {
                    depth -= 1;
                    inline.retain(|opened| *opened <= depth);
                }
                "use" if next != "<" => {
                    let end = at + words[at..].iter().position(|word| *word == ";").unwrap_or(0);
                    let public = at > 0 && (words[at - 1] == "pub" || words[at - 1] == ")");
                    for (name, path) in leaves(&words[at + 1..end], &[]) {
                        let Some(path) = lifted(path, inline.len()) else { continue };
                        if public {
                            handed_on.push((name.clone(), path.clone()));
                        } else {
                            source.named.push(Named { path: path.clone(), only_handed_on: false });
                        }
                        source.brought_in.entry(name).or_default().push(path);
                    }
                    at = end;
                }
                "macro_rules" => {
                    source.items.extend(words.get(at + 2).map(|name| (*name).to_owned()));
                }
                "mod" if words.get(at + 2) == Some(&"{") => inline.push(depth + 1),
                word if ITEMS.contains(&word) => {
                    source.items.insert(next.to_owned());
                }
                word if is_name(word) && (at == 0 || words[at - 1] != "::") => {
                    let path = path(&words[at..]);
                    mentioned.insert(word);
                    if path.len() > 1 {
                        at += 2 * (path.len() - 1);
                        let named = lifted(path, inline.len());
                        source.named.extend(named.map(|path| Named { path, only_handed_on: false }));
                    }
                }
                _ => {}
            }
            at += 1;
        }
        for (name, path) in handed_on {
            let only_handed_on = !mentioned.contains(name.as_str());
            source.named.push(Named { path, only_handed_on });
        }
        source
    }
}

fn is_name(word: &str) -> bool {
    word.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// The path at the head of `words`: names joined by `::`.
fn path(words: &[&str]) -> Vec<String> {
    let mut path = vec![words[0].to_owned()];
    for pair in words[1..].chunks_exact(2) {
        if pair[0] != "::" || !is_name(pair[1]) {
            break;
        }
        path.push(pair[1].to_owned());
    }
    path
}

/// A path as the file itself would write it: an inline module spends a `super` a level, and what it finds
/// in itself is no import.
fn lifted(path: Vec<String>, mut levels: usize) -> Option<Vec<String>> {
    let mut rest = path.as_slice();
    if levels == 0 || rest[0] != "super" {
        return (levels == 0 || rest[0] == "crate").then_some(path);
    }
    while levels > 0 && rest.first().is_some_and(|word| word == "super") {
        rest = &rest[1..];
        levels -= 1;
    }
    let inside =
        if rest.first().is_some_and(|word| word == "super") { None } else { Some("self".to_owned()) };
    Some(inside.into_iter().chain(rest.iter().cloned()).collect())
}

/// Every name that a `use` statement brings in, with its whole path.
fn leaves(words: &[&str], before: &[String]) -> Vec<(String, Vec<String>)> {
    let mut whole = before.to_vec();
    let mut at = 0;
    while at < words.len() {
        match words[at] {
            "{" => {
                let inside = &words[at + 1..words.len() - 1];
                return split(inside).into_iter().flat_map(|part| leaves(part, &whole)).collect();
            }
            "as" => return vec![(words[at + 1].to_owned(), whole)],
            "*" => return vec![("*".to_owned(), whole)],
            "self" if !whole.is_empty() => {}
            "::" => {}
            word => whole.push(word.to_owned()),
        }
        at += 1;
    }
    whole.last().cloned().map(|name| (name, whole)).into_iter().collect()
}

/// Parts between the commas that stand outside of braces.
fn split<'w, 't>(words: &'w [&'t str]) -> Vec<&'w [&'t str]> {
    let mut depth = 0;
    let outer = |word: &&str| {
        depth += i32::from(*word == "{") - i32::from(*word == "}");
        depth == 0 && *word == ","
    };
    words.split(outer).filter(|part| !part.is_empty()).collect()
}

#[test]
fn every_way_to_name_another_file_is_seen() {
    let source = Source::parse(
        "pub use a::{B, c::{self, D as E}}; use crate::f::*;
         mod inner { use super::G; use super::super::H; }
         fn i() -> crate::j::K { super::l::m::<u8>() }",
    );
    let paths: Vec<String> = source.named.iter().map(|named| named.path.join("::")).collect();
    assert_eq!(
        paths,
        ["crate::f", "self::G", "super::H", "crate::j::K", "super::l::m", "a::B", "a::c", "a::c::D"]
    );
    assert!(source.named.iter().rev().take(3).all(|named| named.only_handed_on));
    assert_eq!(source.brought_in["E"], [["a", "c", "D"]]);
    assert!(source.items.contains("i") && source.brought_in.contains_key("*"));
}
