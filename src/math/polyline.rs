//! Polylines with fewer vertices that look the same.
//!
//! Visvalingam & Whyatt 1993, Line generalisation by repeated elimination of points, Cartographic Journal 30(1):
//! the vertex whose triangle with its two neighbours is the smallest goes first, and its neighbours are then
//! worth at least as much as it was. Here the triangles stand in space, and ranks go before areas.
//!
//! Long lines are first thinned block by block, so that memory depends on what stays, not on what there is.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Which vertices go before others, whatever their triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Rank {
    /// Goes by its triangle.
    Inner,
    /// Goes after all inner ones.
    Border,
    /// The first or last of a line: goes when nothing else is left.
    End,
}

/// A vertex, and what its owner wants to know of it afterwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertex<L> {
    /// Where it is.
    pub position: [f64; 3],
    /// When it may go.
    pub rank: Rank,
    /// The owner's.
    pub label: L,
}

/// Vertices that are looked at together in the first pass.
const BLOCK: usize = 1 << 16;

/// How many times the budget may be left after the first pass.
const SPARE: usize = 4;

/// At most `budget` of `count` vertices, in their order. O(n log n); the same input gives the same vertices.
#[must_use]
pub fn thin<L: Copy>(count: usize, vertex: impl Fn(usize) -> Vertex<L>, budget: usize) -> Vec<Vertex<L>> {
    if count <= BLOCK {
        return thin_block((0..count).map(vertex).collect(), budget);
    }
    let mut kept = Vec::new();
    for start in (0..count).step_by(BLOCK) {
        let block: Vec<_> = (start..count.min(start + BLOCK)).map(&vertex).collect();
        let share = (SPARE * budget).div_ceil(count.div_ceil(BLOCK));
        kept.extend(thin_block(block, share));
    }
    thin_block(kept, budget)
}

/// The vertices that stay when all others have gone, the least worth first.
fn thin_block<L: Copy>(vertices: Vec<Vertex<L>>, budget: usize) -> Vec<Vertex<L>> {
    let count = vertices.len();
    if count <= budget {
        return vertices;
    }
    let last = count - 1;
    let rank = |i: usize| if i == 0 || i == last { Rank::End } else { vertices[i].rank };
    let triangle = |a: usize, b: usize, c: usize| {
        doubled_area(vertices[a].position, vertices[b].position, vertices[c].position)
    };
    // an end is its own neighbour
    let mut before: Vec<usize> = (0..count).map(|i| i.saturating_sub(1)).collect();
    let mut after: Vec<usize> = (0..count).map(|i| (i + 1).min(last)).collect();
    let mut area: Vec<f64> = (0..count).map(|i| triangle(before[i], i, after[i])).collect();
    let mut gone = vec![false; count];
    // areas are not negative, and such numbers are in the order of their bits
    let entry = |i: usize, area: f64| Reverse((rank(i), area.to_bits(), i));
    let mut least: BinaryHeap<_> = (0..count).map(|i| entry(i, area[i])).collect();
    let mut left = count;
    while left > budget
        && let Some(Reverse((_, bits, i))) = least.pop()
    {
        if gone[i] || area[i].to_bits() != bits {
            continue; // its triangle has changed since
        }
        gone[i] = true;
        left -= 1;
        let (a, c) = (before[i], after[i]);
        after[a] = if c == i { a } else { c };
        before[c] = if a == i { c } else { a };
        for j in [a, c] {
            if !gone[j] {
                area[j] = triangle(before[j], j, after[j]).max(area[i]);
                least.push(entry(j, area[j]));
            }
        }
    }
    vertices.into_iter().zip(gone).filter(|(_, gone)| !gone).map(|(vertex, _)| vertex).collect()
}

/// Twice the area of a triangle.
fn doubled_area(a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> f64 {
    let [u, v]: [[f64; 3]; 2] = [b, c].map(|p| std::array::from_fn(|i| p[i] - a[i]));
    let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    cross.iter().map(|x| x * x).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vertex(position: [f64; 3]) -> Vertex<()> {
        Vertex { position, rank: Rank::Inner, label: () }
    }

    /// How far `p` lies from the line through `kept`.
    fn distance(p: [f64; 3], kept: &[Vertex<()>]) -> f64 {
        let to_segment = |pair: &[Vertex<()>]| {
            let (a, b) = (pair[0].position, pair[1].position);
            let [along, there]: [[f64; 3]; 2] = [b, p].map(|q| std::array::from_fn(|i| q[i] - a[i]));
            let dot = |u: [f64; 3], v: [f64; 3]| u.iter().zip(v).map(|(u, v)| u * v).sum::<f64>();
            let share = (dot(along, there) / dot(along, along)).clamp(0.0, 1.0);
            let off: [f64; 3] = std::array::from_fn(|i| there[i] - share * along[i]);
            dot(off, off).sqrt()
        };
        kept.windows(2).map(to_segment).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn corners_and_ends_stay_and_straight_runs_go() {
        let path = |i: usize| match i {
            0..=50 => vertex([i as f64, 0.0, 0.0]),
            51..=100 => vertex([50.0, 0.0, i as f64 - 50.0]),
            _ => vertex([50.0, i as f64 - 100.0, 50.0]),
        };
        let kept = thin(151, path, 4);
        let corners = [[0.0; 3], [50.0, 0.0, 0.0], [50.0, 0.0, 50.0], [50.0, 50.0, 50.0]];
        assert_eq!(kept.iter().map(|v| v.position).collect::<Vec<_>>(), corners);
    }

    #[test]
    fn a_long_helix_keeps_its_shape_within_a_budget_whatever_its_length() {
        // ten turns of radius 10: a chord over 1/40 of a turn is 3 cm off, over 1/100 of one 5 mm
        for count in [2000, BLOCK + 1, 5 * BLOCK] {
            let helix = |i: usize| {
                let turn = 20.0 * std::f64::consts::PI * i as f64 / (count - 1) as f64;
                vertex([10.0 * turn.cos(), 10.0 * turn.sin(), turn])
            };
            let kept = thin(count, helix, 1000);
            assert_eq!(kept.len(), 1000, "{count}");
            assert_eq!([kept[0], kept[999]], [helix(0), helix(count - 1)]);
            let worst = (0..count).step_by(count / 400).map(|i| distance(helix(i).position, &kept));
            let worst = worst.fold(0.0, f64::max);
            assert!(worst < 0.03, "{count}: {worst} m");
        }
    }

    #[test]
    fn borders_go_after_all_else_and_ends_last() {
        let straight = |i: usize| Vertex {
            position: [i as f64, 5.0 * (i % 2) as f64, 0.0],
            rank: [(20, Rank::Border), (60, Rank::End), (61, Rank::End)]
                .into_iter()
                .find_map(|(at, rank)| (at == i).then_some(rank))
                .unwrap_or(Rank::Inner),
            label: i,
        };
        let labels = |budget| thin(100, straight, budget).iter().map(|v| v.label).collect::<Vec<_>>();
        assert_eq!(labels(5), [0, 20, 60, 61, 99]);
        assert_eq!(labels(4), [0, 60, 61, 99]);
        assert_eq!(labels(0), [0; 0]);
        assert_eq!(labels(100).len(), 100);
    }
}
