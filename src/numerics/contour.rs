//! Zero contours of a function on a grid of nodes, as ordered polylines (marching squares), and what joins any segments.

use std::collections::{HashMap, HashSet};

/// A zero contour: points between nodes, in order; the first is not repeated at the end of a closed one.
#[derive(Debug, Clone, PartialEq)]
pub struct Contour {
    /// The edges crossed: both nodes, the negative one first.
    pub crossings: Vec<[usize; 2]>,
    /// False where the contour runs out of the grid.
    pub closed: bool,
}

/// Zero contours of `values` on `columns` × `rows` nodes, row-major.
///
/// Zero counts as positive. In a saddle cell (diagonal signs) the mean of the corners decides which pair is joined.
/// Cells with a value that is not finite are left out.
pub fn zero_contours(values: &[f64], columns: usize, rows: usize) -> Vec<Contour> {
    let cells = (0..rows.saturating_sub(1))
        .flat_map(|row| (0..columns.saturating_sub(1)).map(move |column| row * columns + column));
    join(cells.flat_map(|k| segments([k, k + 1, k + columns + 1, k + columns], values)))
}

/// Contours of directed segments, each from one crossing to the next.
pub(super) fn join(segments: impl Iterator<Item = [[usize; 2]; 2]>) -> Vec<Contour> {
    let (mut next, mut starts, mut entered) = (HashMap::new(), Vec::new(), HashSet::new());
    for [from, to] in segments {
        next.insert(from, to);
        starts.push(from);
        entered.insert(to);
    }
    let mut used = HashSet::new();
    let mut contours = Vec::new();
    // Open contours first, from the ends that nothing enters; what is left is closed.
    let open = starts.iter().filter(|start| !entered.contains(*start));
    for &start in open.chain(&starts) {
        if !used.insert(start) {
            continue;
        }
        let (mut crossings, mut at) = (vec![start], start);
        let closed = loop {
            match next.get(&at) {
                Some(&to) if to == start => break true,
                Some(&to) if used.insert(to) => {
                    crossings.push(to);
                    at = to;
                }
                _ => break false,
            }
        };
        contours.push(Contour { crossings, closed });
    }
    contours
}

/// Directed segments in one cell (corners counter-clockwise), the positive side on the left.
fn segments(corners: [usize; 4], values: &[f64]) -> Vec<[[usize; 2]; 2]> {
    let v = corners.map(|c| values[c]);
    if v.iter().any(|v| !v.is_finite()) {
        return Vec::new();
    }
    let positive = v.map(|v| v >= 0.0);
    // An edge from corner i to i + 1 is entered where the sign turns negative and left where it turns positive.
    let edge = |i: usize| {
        let (a, b) = (i, (i + 1) % 4);
        if positive[a] { [corners[b], corners[a]] } else { [corners[a], corners[b]] }
    };
    let falls: Vec<usize> = (0..4).filter(|&i| positive[i] && !positive[(i + 1) % 4]).collect();
    let rises: Vec<usize> = (0..4).filter(|&i| !positive[i] && positive[(i + 1) % 4]).collect();
    match (falls.as_slice(), rises.as_slice()) {
        ([], _) => Vec::new(),
        (&[fall], &[rise]) => vec![[edge(fall), edge(rise)]],
        (falls, rises) => {
            // Both diagonals: a positive middle joins the positive corners, so each segment cuts off a negative one.
            let joined = v.iter().sum::<f64>() >= 0.0;
            let partner = |fall: usize| if joined { (fall + 1) % 4 } else { (fall + 3) % 4 };
            falls
                .iter()
                .filter(|&&fall| rises.contains(&partner(fall)))
                .map(|&fall| [edge(fall), edge(partner(fall))])
                .collect()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(n: usize, f: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        let at = |i: usize| -1.0 + 2.0 * i as f64 / (n - 1) as f64;
        (0..n * n).map(|k| f(at(k % n), at(k / n))).collect()
    }

    #[test]
    fn two_circles_are_two_closed_contours() {
        let n = 41;
        let circle = |x: f64, y: f64, cx: f64| (x - cx).hypot(y) - 0.3;
        let contours = zero_contours(&grid(n, |x, y| circle(x, y, 0.5).min(circle(x, y, -0.5))), n, n);
        assert_eq!(contours.len(), 2);
        assert!(contours.iter().all(|c| c.closed && c.crossings.len() > 20));
    }

    #[test]
    fn a_line_across_the_grid_is_open_and_complete() {
        let n = 11;
        let contours = zero_contours(&grid(n, |x, _| x - 0.03), n, n);
        assert_eq!(contours.len(), 1);
        assert!(!contours[0].closed && contours[0].crossings.len() == n, "{contours:?}");
    }

    #[test]
    fn a_saddle_keeps_its_contours_apart() {
        let n = 10;
        let contours = zero_contours(&grid(n, |x, y| x * y - 0.001), n, n);
        assert_eq!(contours.len(), 2);
        let contours = zero_contours(&grid(n, |x, y| x * y + 0.001), n, n);
        assert_eq!(contours.len(), 2);
    }

    #[test]
    fn nothing_is_drawn_where_there_is_no_zero() {
        assert!(zero_contours(&grid(9, |x, y| 2.0 + x + y), 9, 9).is_empty());
        assert!(zero_contours(&[f64::NAN; 9], 3, 3).is_empty());
    }
}
