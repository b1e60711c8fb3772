//! A tiny markup for labels: `κ_{os}` lowers, `10^{-3}` raises, `2^{+1}_{−1}` stacks; all else is literal.

use super::font::advance_em;

/// Size of a script relative to the line it belongs to.
const SCRIPT_SIZE: f64 = 0.72;
/// Baseline of a superscript above the line's, in em of the line.
const RAISE_EM: f64 = 0.36;
/// Baseline of a subscript below the line's, in em of the line.
const LOWER_EM: f64 = 0.18;
/// How much farther apart the two baselines are, each, where a subscript stands below a superscript.
const STACKED_EM: f64 = 0.08;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Level {
    Line,
    Raised,
    Lowered,
}

impl Level {
    /// Offset of the baseline in em, positive down as in SVG.
    fn offset_em(self) -> f64 {
        match self {
            Self::Line => 0.0,
            Self::Raised => -RAISE_EM,
            Self::Lowered => LOWER_EM,
        }
    }

    fn relative_size(self) -> f64 {
        if self == Self::Line { 1.0 } else { SCRIPT_SIZE }
    }
}

/// Splits a label into runs of one level; an opening without its `}` is literal text.
fn runs(label: &str) -> Vec<(Level, &str)> {
    let mut runs = Vec::new();
    let (mut rest, mut searched) = (label, 0);
    while let Some(found) = rest.get(searched..).and_then(|tail| tail.find(['_', '^'])) {
        let start = searched + found;
        let script = rest[start + 1..].strip_prefix('{').and_then(|tail| tail.split_once('}'));
        let Some((inside, after)) = script else {
            searched = start + 1;
            continue;
        };
        let level = if rest.as_bytes()[start] == b'^' { Level::Raised } else { Level::Lowered };
        runs.extend([(Level::Line, &rest[..start]), (level, inside)]);
        (rest, searched) = (after, 0);
    }
    runs.push((Level::Line, rest));
    runs.retain(|(_, text)| !text.is_empty());
    runs
}

/// The inside of an SVG `<text>`: escaped text, scripts as `<tspan>` with relative `dy`.
///
/// `dy` and not `baseline-shift`, because Firefox lacks the latter.
pub fn tspans(label: &str, size_pt: f64) -> String {
    let mut out = String::new();
    let (mut level_now, mut offset_now_em, mut end_em) = (Level::Line, 0.0, 0.0);
    for Placed { level, text, start_em, offset_em } in placed(label).0 {
        let back_em = start_em - end_em;
        end_em = start_em + width_em(level, text);
        if level == Level::Line && level_now == Level::Line {
            out.push_str(&escape(text));
            continue;
        }
        let dx = if back_em == 0.0 { String::new() } else { format!("dx=\"{:.2}\" ", size_pt * back_em) };
        let dy_pt = size_pt * (offset_em - offset_now_em);
        let run_size_pt = size_pt * level.relative_size();
        out.push_str(&format!(
            "<tspan {dx}dy=\"{dy_pt:.2}\" font-size=\"{run_size_pt:.2}\">{}</tspan>",
            escape(text)
        ));
        (level_now, offset_now_em) = (level, offset_em);
    }
    out
}

/// Width of a label in points, from the widths of the embedded font.
pub fn width_pt(label: &str, size_pt: f64) -> f64 {
    size_pt * placed(label).1
}

/// A run of one level with its left end and its baseline below the line's, in em of the line.
struct Placed<'a> {
    level: Level,
    text: &'a str,
    start_em: f64,
    offset_em: f64,
}

/// The runs of a label, a subscript below the superscript just before it, and the width of all.
fn placed(label: &str) -> (Vec<Placed<'_>>, f64) {
    let mut all: Vec<Placed> = Vec::new();
    let mut pen_em = 0.0_f64;
    for (level, text) in runs(label) {
        let (mut start_em, mut offset_em) = (pen_em, level.offset_em());
        let above = all.last_mut().filter(|above| above.level == Level::Raised && level == Level::Lowered);
        if let Some(above) = above {
            start_em = above.start_em;
            above.offset_em -= STACKED_EM;
            offset_em += STACKED_EM;
        }
        pen_em = pen_em.max(start_em + width_em(level, text));
        all.push(Placed { level, text, start_em, offset_em });
    }
    (all, pen_em)
}

fn width_em(level: Level, text: &str) -> f64 {
    level.relative_size() * text.chars().map(advance_em).sum::<f64>()
}

/// Escapes what XML reserves, and drops the control characters it forbids.
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            control if control.is_control() => out.push(' '),
            other => out.push(other),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scripts_move_the_baseline_there_and_back() {
        assert_eq!(
            tspans("M_{⊙}/Mpc^{-3} h", 10.0),
            "M<tspan dy=\"1.80\" font-size=\"7.20\">⊙</tspan>\
             <tspan dy=\"-1.80\" font-size=\"10.00\">/Mpc</tspan>\
             <tspan dy=\"-3.60\" font-size=\"7.20\">-3</tspan>\
             <tspan dy=\"3.60\" font-size=\"10.00\"> h</tspan>"
        );
    }

    #[test]
    fn a_subscript_stands_below_the_superscript_before_it() {
        let back = SCRIPT_SIZE * 10.0 * 1303.0 / 2048.0;
        let text = tspans("2^{1}_{34} m", 10.0);
        assert!(text.contains(&format!("<tspan dx=\"-{back:.2}\" dy=\"7.00\"")), "{text}");
        assert!(text.ends_with("<tspan dy=\"-2.60\" font-size=\"10.00\"> m</tspan>"), "{text}");
        assert_eq!(width_pt("2^{1}_{34}", 10.0), width_pt("2_{34}", 10.0));
        assert_eq!(width_pt("2^{34}_{1}", 10.0), width_pt("2^{34}", 10.0));
    }

    #[test]
    fn an_unfinished_script_is_literal() {
        assert_eq!(tspans("a_b ^{c", 10.0), "a_b ^{c");
        assert_eq!(runs("a_b^{2}"), [(Level::Line, "a_b"), (Level::Raised, "2")]);
    }

    #[test]
    fn reserved_characters_are_escaped() {
        assert_eq!(tspans("a<b & \"c\">", 10.0), "a&lt;b &amp; &quot;c&quot;&gt;");
        assert_eq!(escape("\u{1}"), " ");
    }

    #[test]
    fn scripts_are_narrower_than_the_line() {
        assert_eq!(width_pt("00", 10.0), 20.0 * 1303.0 / 2048.0);
        assert_eq!(width_pt("0^{0}", 10.0), 10.0 * (1.0 + SCRIPT_SIZE) * 1303.0 / 2048.0);
        assert_eq!(width_pt("", 10.0), 0.0);
    }
}
