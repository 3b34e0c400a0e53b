//! Polylines through points of different kinds: cut where nothing was seen, thinned, one for each kind.

use super::Context;
use crate::fusion::Fusion;
use crate::math::polyline::{Rank, Vertex, thin};
use crate::track::Phase;

/// A polyline of one kind, at least two points.
pub(super) struct Polyline<K> {
    pub(super) kind: K,
    pub(super) points: Vec<[f64; 3]>,
}

/// The track, a line for each stretch of one phase, of at most `budget` vertices together.
pub(super) fn track_lines(fusion: &Fusion, context: &Context<'_>, budget: usize) -> Vec<Polyline<Phase>> {
    let points = &fusion.track.points;
    let times_s = points.iter().map(|p| p.time.seconds_since(context.origin));
    let breaks = breaks(fusion, times_s, 1.5 / context.rate_hz);
    polylines(points.len(), &breaks, |i| (points[i].state.position, points[i].phase), budget)
}

/// The indices of those of `times_s` that are more than `max_step_s` after the one before, or in another piece.
pub(super) fn breaks(
    fusion: &Fusion,
    times_s: impl Iterator<Item = f64> + Clone,
    max_step_s: f64,
) -> Vec<usize> {
    let piece_of = |time_s: f64| fusion.pieces.partition_point(|&(from_s, _)| from_s <= time_s);
    let pairs = times_s.clone().zip(times_s.skip(1)).enumerate();
    let cut = |a: f64, b: f64| b - a > max_step_s || piece_of(a) != piece_of(b);
    pairs.filter(|&(_, (a, b))| cut(a, b)).map(|(i, _)| i + 1).collect()
}

/// Polylines through `count` points, none across the `breaks`, of at most `budget` vertices together.
///
/// `breaks` are the indices, in order, of points that are not joined to the point before. Where the kind
/// changes, the new polyline begins at the last point of the old one, so that no gap is seen.
pub(super) fn polylines<K: Copy + PartialEq>(
    count: usize,
    breaks: &[usize],
    point: impl Fn(usize) -> ([f64; 3], K),
    budget: usize,
) -> Vec<Polyline<K>> {
    let part_of = |i: usize| breaks.partition_point(|&b| b <= i);
    let vertex = |i: usize| {
        let ((position, kind), part) = (point(i), part_of(i));
        let is_end = i == 0 || i + 1 == count || part_of(i - 1) != part || part_of(i + 1) != part;
        let rank = if is_end {
            Rank::End
        } else if point(i + 1).1 != kind {
            Rank::Border
        } else {
            Rank::Inner
        };
        Vertex { position, rank, label: (part, kind) }
    };
    let borders = (1..count).filter(|&i| point(i - 1).1 != point(i).1).count();
    // borders stand in two lines
    let kept = thin(count, vertex, budget.saturating_sub(borders).max(budget / 2));

    let mut lines: Vec<Polyline<K>> = Vec::new();
    let mut last: Option<Vertex<(usize, K)>> = None;
    for vertex in kept {
        let joined = last.filter(|l| l.label.0 == vertex.label.0);
        match (lines.last_mut(), joined) {
            (Some(line), Some(before)) if before.label.1 == vertex.label.1 => {
                line.points.push(vertex.position);
            }
            (_, before) => {
                let points = before.iter().map(|b| b.position).chain([vertex.position]).collect();
                lines.push(Polyline { kind: vertex.label.1, points });
            }
        }
        last = Some(vertex);
    }
    lines.retain(|line| line.points.len() > 1);
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    fn made(kinds: &str, breaks: &[usize], budget: usize) -> Vec<(char, Vec<f64>)> {
        let kinds: Vec<char> = kinds.chars().collect();
        let zigzag = |i: usize| ([i as f64, (i % 2) as f64 * (1.0 + i as f64), 0.0], kinds[i]);
        let lines = polylines(kinds.len(), breaks, zigzag, budget);
        lines.into_iter().map(|l| (l.kind, l.points.iter().map(|p| p[0]).collect())).collect()
    }

    #[test]
    fn lines_of_different_kinds_meet_in_a_point_and_none_crosses_a_break() {
        assert_eq!(
            made("aabbba", &[3], 100),
            [('a', vec![0.0, 1.0]), ('b', vec![1.0, 2.0]), ('b', vec![3.0, 4.0]), ('a', vec![4.0, 5.0])]
        );
        assert_eq!(made("aaaa", &[1, 3], 100), [('a', vec![1.0, 2.0])], "a point alone is no line");
        assert_eq!(made("", &[], 100), []);
    }

    #[test]
    fn thinned_lines_keep_their_ends_and_the_points_where_they_meet() {
        let kinds = ["a".repeat(400), "b".repeat(300), "a".repeat(300)].concat();
        let lines = made(&kinds, &[500], 20);
        let ends: Vec<_> = lines.iter().map(|(k, p)| (*k, p[0], p[p.len() - 1])).collect();
        assert_eq!(ends, [('a', 0.0, 399.0), ('b', 399.0, 499.0), ('b', 500.0, 699.0), ('a', 699.0, 999.0)]);
        assert_eq!(lines.iter().map(|l| l.1.len()).sum::<usize>(), 20);
    }

    #[test]
    fn a_budget_holds_however_often_kinds_change() {
        for budget in [2, 7, 100] {
            let lines = made(&"ab".repeat(1000), &[300, 301, 900], budget);
            assert!(lines.iter().map(|l| l.1.len()).sum::<usize>() <= budget, "{budget}");
        }
    }
}
