//! Which values an axis marks, and how it writes them.

use super::markup::width_pt;
use super::scale::{Direction, Scale, Span};
use super::style::SMALL_PT;

/// Ticks of one axis or colour bar.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Ticks {
    /// Long ticks with their labels; the label may be empty.
    pub major: Vec<(f64, String)>,
    /// Short ticks.
    pub minor: Vec<f64>,
    /// The labels are in units of 10 to this power, which belongs into the axis label.
    pub exponent: i32,
}

impl Ticks {
    /// The densest ticks, up to so many intervals, whose labels do not touch; if `inside`, none sticks out of the span.
    ///
    /// Where that leaves fewer than two labels: a few more intervals, if their labels touch every other one of them, at last
    /// a power of ten taken out of the labels.
    pub fn for_span(span: &Span, direction: Direction, most_intervals: usize, inside: bool) -> Self {
        let of = |intervals, with_power| {
            let mut ticks = match span.scale {
                Scale::Linear => round_numbers(span.low, span.high, intervals, with_power),
                Scale::Log => logarithmic(span.low, span.high, intervals),
            };
            if inside {
                ticks.keep_inside(span);
            }
            ticks
        };
        let most = most_intervals.max(2);
        let fits = |ticks: &Ticks| ticks.fit(|value| span.at(value), direction);
        let serves = |ticks: &Ticks| ticks.labelled() >= 2 && fits(ticks);
        let found = (2..=most).rev().map(|n| of(n, false)).find(fits).unwrap_or_else(|| of(1, false));
        if found.labelled() >= 2 {
            return found;
        }
        let others = [false, true].into_iter().flat_map(|with_power| {
            let more = (most + 1..=most + 4).chain((2..=most).rev().filter(move |_| with_power));
            let every_other =
                move |with_zero| (2..=most + 4).map(move |n| of(n, with_power).every_other(with_zero));
            more.map(move |n| of(n, with_power)).chain([true, false].into_iter().flat_map(every_other))
        });
        others.into_iter().find(serves).unwrap_or(found)
    }

    /// Number of ticks with a label.
    fn labelled(&self) -> usize {
        self.major.iter().filter(|(_, label)| !label.is_empty()).count()
    }

    /// The same with every other label blank; that of zero stays, or goes.
    fn every_other(mut self, with_zero: bool) -> Self {
        let zero = self.major.iter().position(|(value, _)| *value == 0.0).unwrap_or(0);
        let kept = (zero + usize::from(!with_zero)) % 2;
        let others = self.major.iter_mut().enumerate().filter(|(i, _)| i % 2 != kept);
        others.for_each(|(_, (_, label))| label.clear());
        self
    }

    /// Blanks the labels that stick out of a horizontal span, as long as another one is left.
    fn keep_inside(&mut self, span: &Span) {
        let sticks_out = |value: f64, label: &str| {
            let (Some(middle), half) = (span.at(value), 0.5 * width_pt(label, SMALL_PT)) else {
                return false;
            };
            middle - half < span.start_pt || middle + half > span.end_pt
        };
        let mut left = self.labelled();
        for (value, label) in &mut self.major {
            if left > 1 && !label.is_empty() && sticks_out(*value, label) {
                label.clear();
                left -= 1;
            }
        }
    }

    /// True if no two neighbouring labels come too close.
    fn fit(&self, at: impl Fn(f64) -> Option<f64>, direction: Direction) -> bool {
        let extents: Vec<(f64, f64)> = (self.major.iter())
            .filter(|(_, label)| !label.is_empty())
            .filter_map(|(value, label)| Some((at(*value)?, extent_pt(label, direction))))
            .collect();
        extents.windows(2).all(|pair| (pair[1].0 - pair[0].0).abs() >= 0.5 * (pair[0].1 + pair[1].1))
    }
}

/// Room one label takes along its axis, with the gap to the next.
pub fn extent_pt(label: &str, direction: Direction) -> f64 {
    match direction {
        Direction::Horizontal => width_pt(label, SMALL_PT) + 1.1 * SMALL_PT,
        Direction::Vertical => 2.0 * SMALL_PT,
    }
}

/// An axis label with the ticks' power of ten among its units: `γ [arcsec]` becomes `γ [10^{-3} arcsec]`.
pub fn with_exponent(label: &str, exponent: i32) -> String {
    if exponent == 0 {
        return label.into();
    }
    let power = power_of_ten(exponent);
    match label.strip_suffix(']').and_then(|_| label.rsplit_once('[')) {
        Some((name, unit)) => format!("{name}[{power} {unit}"),
        None => format!("{label} [{power}]"),
    }
}

/// `10^{n}` with a true minus sign.
pub fn power_of_ten(exponent: i32) -> String {
    format!("10^{{{exponent}}}").replace('-', "−")
}

/// Ticks at multiples of 1, 2 or 5 × 10^n, at most `intervals` apart.
pub fn linear(low: f64, high: f64, intervals: usize) -> Ticks {
    round_numbers(low, high, intervals, false)
}

/// [`linear`]; a power of ten is taken out of labels that would be long, and of all `with_power`.
fn round_numbers(low: f64, high: f64, intervals: usize, with_power: bool) -> Ticks {
    let raw = (high - low) / intervals as f64;
    let decade = 10f64.powf(raw.log10().floor());
    if !(decade.is_normal() && low.is_finite()) {
        return Ticks::default();
    }
    let (multiple, subdivisions) = [(1.0, 5), (2.0, 4), (5.0, 5), (10.0, 5)]
        .into_iter()
        .find(|(m, _)| m * decade >= raw * (1.0 - 1e-9))
        .unwrap_or((10.0, 5));
    let step = multiple * decade;

    let largest = low.abs().max(high.abs());
    let magnitude = largest.log10().floor() as i32;
    let decimals_plain = -(step * (1.0 + 1e-9)).log10().floor() as i32;
    let exponent = if with_power || decimals_plain > 3 || magnitude > 4 { magnitude } else { 0 };
    let decimals = (decimals_plain + exponent).max(0) as usize;
    let label = |value: f64| {
        let text = format!("{:.decimals$}", value / 10f64.powi(exponent));
        let zero = text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.');
        if zero { "0".into() } else { text.replace('-', "−") }
    };
    let multiples = |step: f64| {
        let (first, last) = ((low / step - 1e-6).ceil(), (high / step + 1e-6).floor());
        (0..=(last - first).max(-1.0) as i64).map(move |i| first + i as f64)
    };
    let fine = step / f64::from(subdivisions);
    Ticks {
        major: multiples(step).map(|k| (k * step, label(k * step))).collect(),
        minor: multiples(fine).filter(|k| k % f64::from(subdivisions) != 0.0).map(|k| k * fine).collect(),
        exponent,
    }
}

/// Ticks at powers of ten; below two decades also at multiples of them.
pub fn logarithmic(low: f64, high: f64, intervals: usize) -> Ticks {
    let (first, last) = ((low.log10() - 1e-9).ceil() as i32, (high.log10() + 1e-9).floor() as i32);
    let within = |value: &f64| (low * (1.0 - 1e-9)..=high * (1.0 + 1e-9)).contains(value);
    let multiples = |mantissas: &[i32]| -> Vec<(i32, i32)> {
        let all = (first - 1..=last).flat_map(|k| mantissas.iter().map(move |&m| (m, k)));
        all.filter(|&(m, k)| within(&(f64::from(m) * 10f64.powi(k)))).collect()
    };
    let value = |(mantissa, k): (i32, i32)| f64::from(mantissa) * 10f64.powi(k);

    if last - first >= 1 {
        let stride = (1..).find(|stride| (last - first) / stride <= intervals as i32).unwrap_or(1);
        let minor = if stride == 1 { multiples(&[2, 3, 4, 5, 6, 7, 8, 9]) } else { multiples(&[1]) };
        return Ticks {
            major: (first..=last)
                .filter(|k| k % stride == 0)
                .map(|k| (10f64.powi(k), power_of_ten(k)))
                .collect(),
            minor: minor.into_iter().filter(|&(m, k)| m != 1 || k % stride != 0).map(value).collect(),
            exponent: 0,
        };
    }
    let sets: [&[i32]; 4] = [&[1, 2, 3, 4, 5, 6, 7, 8, 9], &[1, 2, 3, 5], &[1, 2, 5], &[1, 3]];
    let Some(chosen) =
        sets.iter().map(|set| multiples(set)).find(|set| (2..=intervals + 1).contains(&set.len()))
    else {
        return linear(low, high, intervals);
    };
    let plain = low >= 1e-3 && high <= 1e4;
    let label = |(mantissa, k): (i32, i32)| match mantissa {
        _ if plain => format!("{:.*}", (-k).max(0) as usize, value((mantissa, k))),
        1 => power_of_ten(k),
        _ => format!("{mantissa}×{}", power_of_ten(k)),
    };
    let minor = multiples(sets[0]).into_iter().filter(|tick| !chosen.contains(tick)).map(value).collect();
    Ticks { major: chosen.iter().map(|&tick| (value(tick), label(tick))).collect(), minor, exponent: 0 }
}

/// Ticks of an asinh stretch: 0 and ± powers of ten beyond `softening`, thinned until labels do not touch.
pub fn asinh(
    (low, high): (f64, f64),
    softening: f64,
    at: impl Fn(f64) -> Option<f64>,
    direction: Direction,
) -> Ticks {
    let reach = low.abs().max(high.abs());
    let (first, last) = (softening.log10().ceil() as i32, reach.log10().floor() as i32);
    let within = |value: &f64| (low..=high).contains(value);
    let decades = (first..=last).rev().take(40);
    let wanted =
        [(0.0, "0".to_string())].into_iter().chain(decades.clone().flat_map(|k| {
            [(10f64.powi(k), power_of_ten(k)), (-10f64.powi(k), format!("−{}", power_of_ten(k)))]
        }));
    let mut placed: Vec<(f64, f64)> = Vec::new();
    let mut ticks = Ticks::default();
    for (value, label) in wanted.filter(|(value, _)| within(value)) {
        let (Some(place), room) = (at(value), extent_pt(&label, direction)) else { continue };
        let free = placed.iter().all(|(other, taken)| (place - other).abs() >= 0.5 * (room + taken));
        placed.extend(free.then_some((place, room)));
        ticks.major.push((value, if free { label } else { String::new() }));
    }
    ticks.major.sort_by(|a, b| a.0.total_cmp(&b.0));
    let multiples = decades.flat_map(|k| (2..=9).map(move |m| f64::from(m) * 10f64.powi(k)));
    ticks.minor = multiples.flat_map(|value| [value, -value]).filter(within).collect();
    ticks
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(ticks: &Ticks) -> Vec<&str> {
        ticks.major.iter().map(|(_, label)| label.as_str()).collect()
    }

    #[test]
    fn linear_ticks_are_round_and_inside() {
        let ticks = linear(-1.7, 1.7, 4);
        assert_eq!(labels(&ticks), ["−1", "0", "1"]);
        assert_eq!(ticks.minor.len(), 16 - 2);
        assert_eq!(labels(&linear(0.0, 3321.0, 7)), ["0", "500", "1000", "1500", "2000", "2500", "3000"]);
        assert_eq!(labels(&linear(0.0, 0.3, 3)), ["0", "0.1", "0.2", "0.3"]);
    }

    #[test]
    fn labels_that_stick_out_are_blanked_but_one_stays() {
        let span = |low, high| Span { scale: Scale::Linear, low, high, start_pt: 0.0, end_pt: 100.0 };
        let mut ticks = linear(0.0, 0.3, 3);
        ticks.keep_inside(&span(0.0, 0.31));
        assert_eq!(labels(&ticks), ["", "0.1", "0.2", ""]);
        let mut alone = linear(0.9, 1.9, 1);
        alone.keep_inside(&span(0.999, 1.9));
        assert_eq!(labels(&alone), ["1"]);
    }

    #[test]
    fn a_narrow_panel_gets_two_labels_inside() {
        let of = |end_pt| {
            let span = Span { scale: Scale::Linear, low: -0.0105, high: 0.0095, start_pt: 0.0, end_pt };
            Ticks::for_span(&span, Direction::Horizontal, 3, true)
        };
        let (wide, narrow) = (of(90.0), of(60.0));
        assert_eq!((labels(&wide), wide.exponent), (vec!["", "−0.005", "", "0.005"], 0));
        assert_eq!((labels(&narrow), narrow.exponent), (vec!["", "−0.5", "", "0.5"], -2));
    }

    #[test]
    fn small_and_large_numbers_move_their_power_into_the_label() {
        let ticks = linear(-2.3e-4, 2.3e-4, 5);
        assert_eq!((labels(&ticks), ticks.exponent), (vec!["−2", "−1", "0", "1", "2"], -4));
        assert_eq!(linear(0.0, 4e6, 4).exponent, 6);
        assert_eq!(with_exponent("|F| [arcsec^{−1}]", -4), "|F| [10^{−4} arcsec^{−1}]");
        assert_eq!(with_exponent("κ", -4), "κ [10^{−4}]");
        assert_eq!(with_exponent("κ", 0), "κ");
    }

    #[test]
    fn log_ticks_are_decades_thinned_to_fit() {
        assert_eq!(
            labels(&logarithmic(1e8, 1e15, 7)),
            ["10^{8}", "10^{9}", "10^{10}", "10^{11}", "10^{12}", "10^{13}", "10^{14}", "10^{15}"]
        );
        let thinned = logarithmic(1e8, 1e15, 4);
        assert_eq!(labels(&thinned), ["10^{8}", "10^{10}", "10^{12}", "10^{14}"]);
        assert_eq!(thinned.minor.len(), 4);
        assert_eq!(labels(&logarithmic(2e-3, 0.4, 4)), ["10^{−2}", "10^{−1}"]);
    }

    #[test]
    fn a_narrow_log_axis_still_has_labels() {
        assert_eq!(labels(&logarithmic(0.15, 0.9, 4)), ["0.2", "0.3", "0.5"]);
        assert_eq!(labels(&logarithmic(2e-5, 8e-5, 3)), ["2×10^{−5}", "3×10^{−5}", "5×10^{−5}"]);
        assert!(logarithmic(1.01, 1.02, 4).major.len() >= 2);
    }

    #[test]
    fn chosen_ticks_do_not_touch() {
        for length_pt in [60.0, 80.0, 120.0, 400.0] {
            for (scale, low, high) in
                [(Scale::Linear, -1.8, 1.8), (Scale::Log, 1e-6, 1e3), (Scale::Linear, 0.0, 12345.0)]
            {
                let span = Span { scale, low, high, start_pt: 0.0, end_pt: length_pt };
                let ticks = Ticks::for_span(&span, Direction::Horizontal, 7, false);
                assert!(ticks.fit(|v| span.at(v), Direction::Horizontal), "{length_pt} {scale:?}");
                assert!(ticks.major.iter().all(|(value, _)| span.at(*value).is_some()));
            }
        }
    }

    #[test]
    fn a_span_between_two_coarse_ticks_has_finer_ones() {
        for (low, high) in [(0.0058, 0.0099), (-0.0085, 0.0065), (1.23451, 1.23459)] {
            let span = Span { scale: Scale::Linear, low, high, start_pt: 0.0, end_pt: 100.0 };
            let ticks = Ticks::for_span(&span, Direction::Vertical, 2, false);
            assert!((2..=4).contains(&ticks.major.len()), "{low}: {ticks:?}");
        }
    }

    #[test]
    fn asinh_ticks_keep_zero_and_the_largest_decade() {
        let at = |v: f64| Some(60.0 * (v / 0.006).asinh());
        let ticks = asinh((-0.006, 0.5), 0.006, at, Direction::Horizontal);
        // From left to right, as a bar is labelled.
        assert_eq!(labels(&ticks), ["0", "10^{−2}", "10^{−1}"]);
        assert!(ticks.major.iter().chain([&(0.0, String::new())]).all(|(v, _)| (-0.006..=0.5).contains(v)));
    }
}
