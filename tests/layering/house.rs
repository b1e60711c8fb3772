//! All files of a crate and the arrows between them: which file imports which.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::imports::{Named, Source};

/// A crate as modules, the root being the empty path.
pub struct House {
    modules: BTreeMap<Vec<String>, Module>,
}

struct Module {
    file: String,
    source: Source,
}

/// File → files that it imports.
pub type Arrows = BTreeMap<String, BTreeSet<String>>;

impl House {
    /// The files below `folder`, whose root is `root`; folders in `without` are left out.
    pub fn read(folder: &Path, root: &str, without: &[&str]) -> Self {
        let mut texts = Vec::new();
        let mut folders = vec![String::new()];
        while let Some(inside) = folders.pop() {
            for entry in std::fs::read_dir(folder.join(&inside)).unwrap() {
                let entry = entry.unwrap();
                let name = format!("{inside}{}", entry.file_name().to_string_lossy());
                if entry.file_type().unwrap().is_dir() {
                    if !without.contains(&name.as_str()) {
                        folders.push(format!("{name}/"));
                    }
                } else if name.ends_with(".rs") {
                    texts.push((name, std::fs::read_to_string(entry.path()).unwrap()));
                }
            }
        }
        Self::of(texts.iter().map(|(name, text)| (name.as_str(), text.as_str())), root)
    }

    /// Files by name with their texts.
    pub fn of<'t>(texts: impl IntoIterator<Item = (&'t str, &'t str)>, root: &str) -> Self {
        let module = |(file, text): (&str, &str)| {
            let stem = file.trim_end_matches(".rs");
            let stem = if file == root { "" } else { stem.trim_end_matches("/mod") };
            let path = stem.split('/').filter(|part| !part.is_empty()).map(str::to_owned).collect();
            (path, Module { file: file.to_owned(), source: Source::parse(text) })
        };
        Self { modules: texts.into_iter().map(module).collect() }
    }

    /// Every arrow; a file that only hands on what its children define does not import them.
    pub fn arrows(&self) -> Arrows {
        let arrows_of = |(path, module): (&Vec<String>, &Module)| {
            let imported = module.source.named.iter().filter_map(|named| self.imported(path, named));
            (module.file.clone(), imported.filter(|file| *file != module.file).collect())
        };
        self.modules.iter().map(arrows_of).collect()
    }

    fn imported(&self, from: &[String], named: &Named) -> Option<String> {
        let whole = self.whole(from, &named.path)?;
        let of_a_child = whole.len() > from.len() && whole.starts_with(from);
        let target = self.find(&whole, 0)?;
        (!(named.only_handed_on && of_a_child)).then(|| self.modules[&target].file.clone())
    }

    /// A path from the root, or nothing if another crate is named.
    fn whole(&self, from: &[String], path: &[String]) -> Option<Vec<String>> {
        let (mut whole, mut rest) = (from.to_vec(), path);
        match path[0].as_str() {
            "crate" => {
                whole.clear();
                rest = &rest[1..];
            }
            "self" => rest = &rest[1..],
            "super" => {
                while rest.first().is_some_and(|word| word == "super") {
                    whole.pop()?;
                    rest = &rest[1..];
                }
            }
            first => {
                let child: Vec<String> = whole.iter().cloned().chain([first.to_owned()]).collect();
                let known = self.modules.contains_key(&child)
                    || self.modules[from].source.brought_in.contains_key(first);
                if !known {
                    return None;
                }
            }
        }
        whole.extend(rest.iter().cloned());
        Some(whole)
    }

    /// The module that defines what the path from the root names, through re-exports.
    fn find(&self, whole: &[String], hops: usize) -> Option<Vec<String>> {
        let mut known = whole.len();
        while !self.modules.contains_key(&whole[..known]) {
            known = known.checked_sub(1)?;
        }
        let (module, rest) = whole.split_at(known);
        let Some(name) = rest.first().filter(|_| hops < 8) else { return Some(module.to_vec()) };
        let source = &self.modules[module].source;
        if source.items.contains(name) {
            return Some(module.to_vec());
        }
        let named = source.brought_in.get(name).map(|paths| (paths, 1));
        let by_glob = source.brought_in.get("*").map(|paths| (paths, 0));
        for (paths, skipped) in named.into_iter().chain(by_glob) {
            for path in paths {
                let Some(mut further) = self.whole(module, path) else { continue };
                further.extend(rest[skipped..].iter().cloned());
                if further == whole {
                    continue;
                }
                let found = self.find(&further, hops + 1);
                if let Some(found) = found.filter(|found| skipped == 1 || found.as_slice() != module) {
                    return Some(found);
                }
            }
        }
        // The name of another crate's item that was brought in here, or a name of a macro's making.
        if named.is_some() { None } else { Some(module.to_vec()) }
    }
}
