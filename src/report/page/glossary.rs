//! The terms of `docs/GLOSSARY.md`, of which a page explains those that it uses.

use super::model::Term;

const GLOSSARY: &str = include_str!("../../../docs/GLOSSARY.md");

/// All terms in the order of the document.
pub(super) fn terms() -> Vec<Term> {
    let entry = |line: &str| {
        let (name, meaning) = line.strip_prefix("- **")?.split_once("** — ")?;
        Some(Term { id: anchor(name), name: name.into(), meaning: meaning.into() })
    };
    GLOSSARY.lines().filter_map(entry).collect()
}

/// The anchor of a term: letters of any script, numbers and dashes.
pub(super) fn anchor(name: &str) -> String {
    let plain = |c: char| if c.is_alphanumeric() { c } else { '-' };
    format!("term-{}", name.chars().map(plain).collect::<String>())
}

/// The anchor of the first of `names` that the glossary explains; empty if it explains none.
pub(super) fn anchor_of(names: &[&str]) -> String {
    let terms = terms();
    let known = |name: &&&str| terms.iter().any(|term| term.name == **name);
    names.iter().find(known).map_or(String::new(), |name| anchor(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_of_the_document_is_read_and_no_two_anchors_are_equal() {
        let terms = terms();
        let lines = GLOSSARY.lines().filter(|line| line.starts_with("- ")).count();
        assert!(terms.len() == lines && lines > 30, "{} of {lines}", terms.len());
        let mut anchors: Vec<String> = terms.into_iter().map(|term| term.id).collect();
        anchors.sort();
        anchors.dedup();
        assert_eq!(anchors.len(), lines);
        assert_eq!(anchor_of(&["nothing", "LOS"]), "term-LOS");
    }
}
