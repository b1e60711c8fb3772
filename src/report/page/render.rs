//! The model of a page as one file of HTML: template, stylesheet, script and data in it.

use minijinja::value::Serde;
use minijinja::{Environment, Value, context};

use super::model::Page;
use crate::error::{Error, Result};
use crate::plot::ColourMap;

const TEMPLATE: &str = include_str!("page.html.jinja");
const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = concat!(include_str!("page.js"), include_str!("corner.js"));
/// Colours of a map handed to the script, which interpolates between them.
const STOPS: usize = 33;

/// The page.
///
/// # Errors
/// [`Error::OutOfRange`] where the template cannot take the model.
pub(super) fn html(page: &Page) -> Result<String> {
    let faulty = |error: minijinja::Error| Error::out_of_range("page", error, "made by its template");
    let mut environment = Environment::new();
    environment.add_filter("signs", |text: String| Value::from_safe_string(signs(&text)));
    environment.add_template("page.html", TEMPLATE).map_err(faulty)?;
    let template = environment.get_template("page.html").map_err(faulty)?;
    let data = serde_json::json!({ "sets": page.grids, "colours": colours(), "posterior": page.posterior });
    // Inside a script nothing may look like its end.
    let data = data.to_string().replace('<', "\\u003c");
    let heads: Vec<[&str; 2]> = page.grids.iter().map(|set| [set.id.as_str(), &set.title]).collect();
    let (page, heads) = (Value::from(Serde(page)), Value::from(Serde(&heads)));
    let html = template.render(context! { page, heads, data, style => STYLE, script => SCRIPT });
    html.map(|html| html.trim_start().to_owned()).map_err(faulty)
}

/// Text as HTML, with what follows `_` after a Greek letter, an A or a lone F, G, N or r below the line, and what stands in `^{…}` raised.
fn signs(text: &str) -> String {
    let escaped = text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;");
    let mut html = String::with_capacity(escaped.len());
    let mut rest = escaped.as_str();
    while let Some(at) = rest.find(['_', '^']) {
        let (before, after) = (&rest[..at], &rest[at + 1..]);
        html += before;
        let is_sign = |c: char| ('\u{370}'..='\u{3ff}').contains(&c) || "A₁₂|".contains(c);
        let is_alone = |before: &str| {
            let mut backwards = before.chars().rev();
            let is_letter = backwards.next().is_some_and(|c| "FGNr".contains(c));
            is_letter && !backwards.next().is_some_and(|c| c.is_alphanumeric() || "_.".contains(c))
        };
        let is_sign =
            |before: &str| is_alone(before) || before.trim_end_matches(['1', '2']).ends_with(is_sign);
        let (tag, inner, length) = match (rest[at..].starts_with('^'), after.strip_prefix('{')) {
            (true, Some(braced)) => {
                let inner = braced.split('}').next().unwrap_or("");
                ("sup", inner, inner.len() + 2)
            }
            (false, _) if is_sign(before) => {
                // The T of a transposed matrix is a letter of Unicode, raised.
                let ends = |c: char| !c.is_alphanumeric() || c == 'ᵀ';
                let end = after.find(ends).unwrap_or(after.len());
                ("sub", &after[..end], end)
            }
            _ => ("", "", 0),
        };
        if inner.is_empty() {
            html += &rest[at..=at];
        } else {
            html += &format!("<{tag}>{inner}</{tag}>");
        }
        rest = after.get(length..).unwrap_or("");
    }
    html + rest
}

/// The words of a page, without figures, grids and configuration.
pub(super) fn words_of(page: &Page) -> String {
    let without = Page {
        grids: Vec::new(),
        figures: Vec::new(),
        posterior: Vec::new(),
        configuration: String::new(),
        ..page.clone()
    };
    let captions = page.figures.iter().map(|figure| figure.caption.as_str());
    let names = page.grids.iter().flat_map(|set| &set.grids).map(|grid| grid.name.as_str());
    let words = captions.chain(names).collect::<Vec<_>>().join(" ");
    serde_json::to_string(&without).unwrap_or_default() + &words
}

fn colours() -> serde_json::Value {
    let stops = |map: ColourMap| -> Vec<String> {
        (0..STOPS).map(|i| map.at(i as f64 / (STOPS - 1) as f64).to_string()).collect()
    };
    serde_json::json!({
        "signed": stops(ColourMap::Diverging),
        "positive": stops(ColourMap::Viridis),
        "light": stops(ColourMap::Inferno),
    })
}

#[cfg(test)]
mod tests {
    use super::super::model::{Fact, Label};
    use super::*;

    #[test]
    fn signs_are_lowered_and_raised_and_names_stay() {
        assert_eq!(signs("Δ_h < 0.1, γ1_LOS."), "Δ<sub>h</sub> &lt; 0.1, γ1<sub>LOS</sub>.");
        assert_eq!(signs("e^{2iφ}, n_sersic, min_ess_"), "e<sup>2iφ</sup>, n_sersic, min_ess_");
        assert_eq!(signs("10 r_s, (F_os), source.r_x"), "10 r<sub>s</sub>, (F<sub>os</sub>), source.r_x");
        assert_eq!(signs("A_odᵀ A_os"), "A<sub>od</sub>ᵀ A<sub>os</sub>");
    }

    #[test]
    fn text_is_escaped_and_nothing_is_fetched() {
        let label = Label { text: "<b>".into(), ..Label::default() };
        let page = Page {
            title: "haloray a&b".into(),
            warnings: vec!["</script><script>alert(1)".into()],
            facts: vec![Fact { label, value: "1 < 2".into() }],
            ..Page::default()
        };
        let html = html(&page).unwrap();
        assert!(
            html.contains("a&amp;b") && html.contains("1 &lt; 2") && !html.contains("<script>alert"),
            "{html}"
        );
        // The name of a language, which nothing fetches.
        let html = html.replace("http://www.w3.org/2000/svg", "");
        for fetched in ["http://", "https://", "@import", "<link rel=\"stylesheet", "url(http"] {
            assert!(!html.contains(fetched), "{fetched}");
        }
        assert!(SCRIPT.lines().count() < 320 && STYLE.lines().count() < 200);
    }
}
