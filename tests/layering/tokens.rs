//! The words of a Rust source, without comments, texts and tests.

/// Identifiers, `::` and single signs, in order; what is under `#[cfg(test)]` is left out.
pub fn words(text: &str) -> Vec<&str> {
    without_tests(all_words(text))
}

fn all_words(text: &str) -> Vec<&str> {
    let mut words = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let length = match first {
            _ if rest.starts_with("//") => rest.find('\n').unwrap_or(rest.len()),
            _ if rest.starts_with("/*") => comment(rest),
            '"' => quoted(rest, 1),
            '\'' => character(rest),
            _ if is_word(first) => {
                let length = rest.find(|c| !is_word(c)).unwrap_or(rest.len());
                match raw_text(&rest[..length], &rest[length..]) {
                    Some(text) => length + text,
                    None => {
                        words.push(&rest[..length]);
                        length
                    }
                }
            }
            _ if first.is_whitespace() => first.len_utf8(),
            _ => {
                let length = if rest.starts_with("::") { 2 } else { first.len_utf8() };
                words.push(&rest[..length]);
                length
            }
        };
        rest = &rest[length..];
    }
    words
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Length of a comment between `/*` and `*/`, which may hold others.
fn comment(text: &str) -> usize {
    let (mut depth, mut at) = (0, 0);
    while at < text.len() {
        let step = match text.get(at..at + 2) {
            Some("/*") => {
                depth += 1;
                2
            }
            Some("*/") => {
                depth -= 1;
                2
            }
            _ => 1,
        };
        at += step;
        if depth == 0 {
            break;
        }
    }
    at
}

/// Length of a text up to its closing quote; `open` bytes open it.
fn quoted(text: &str, open: usize) -> usize {
    let mut escaped = false;
    for (at, byte) in text.bytes().enumerate().skip(open) {
        match byte {
            b'"' if !escaped => return at + 1,
            b'\\' if !escaped => escaped = true,
            _ => escaped = false,
        }
    }
    text.len()
}

/// Length after the prefix of a raw or byte text, if one follows it.
fn raw_text(prefix: &str, after: &str) -> Option<usize> {
    let hashes = after.bytes().take_while(|byte| *byte == b'#').count();
    match prefix {
        "b" | "c" if after.starts_with('"') => Some(quoted(after, 1)),
        "r" | "br" | "cr" if after[hashes..].starts_with('"') => {
            let end = format!("\"{}", "#".repeat(hashes));
            let body = &after[hashes + 1..];
            Some(body.find(&end).map_or(after.len(), |at| hashes + 1 + at + end.len()))
        }
        _ => None,
    }
}

/// Length of a character such as `'a'` or `'\n'`, or of the quote of a lifetime.
fn character(text: &str) -> usize {
    let mut inside = text[1..].chars();
    match (inside.next(), inside.next()) {
        (Some('\\'), Some(_)) => text[3..].find('\'').map_or(1, |at| at + 4),
        (Some(one), Some('\'')) => one.len_utf8() + 2,
        _ => 1,
    }
}

fn without_tests(words: Vec<&str>) -> Vec<&str> {
    let mut kept = Vec::with_capacity(words.len());
    let mut at = 0;
    while at < words.len() {
        if begins_test(&words[at..]) {
            at += item(&words[at..]);
        } else {
            kept.push(words[at]);
            at += 1;
        }
    }
    kept
}

fn begins_test(words: &[&str]) -> bool {
    words.starts_with(&["#", "[", "cfg", "(", "test", ")", "]"])
        || words.starts_with(&["#", "[", "cfg", "(", "all", "(", "test"])
}

/// Number of words of an item with its attributes: to its semicolon or to the end of its braces.
fn item(words: &[&str]) -> usize {
    let (mut depth, mut at) = (0, 0);
    while at < words.len() {
        match words[at] {
            "(" | "[" | "{" => depth += 1,
            ")" | "]" => depth -= 1,
            "}" => {
                depth -= 1;
                if depth == 0 {
                    return at + 1;
                }
            }
            ";" if depth == 0 => return at + 1,
            _ => {}
        }
        at += 1;
    }
    at
}

#[test]
fn comments_texts_and_tests_are_no_code() {
    let source = r###"
        // use crate::a;
        /* use /* crate::b */ */
        fn name<'a>(x: &'a str) -> char { let _ = r#"crate::c"; "#; let _ = "\"crate::d"; '"' }
        #[cfg(test)]
        #[allow(unused)]
        mod tests { use super::*; fn f() { crate::e::g() } }
        use crate::f;
    "###;
    let found = words(source);
    assert!(found.ends_with(&["use", "crate", "::", "f", ";"]), "{found:?}");
    assert_eq!(found.iter().filter(|word| **word == "crate").count(), 1, "{found:?}");
    assert!(!found.contains(&"tests"), "{found:?}");
}
