//! The first steps of a grid: which crossings may be a corner's neighbours.

use nalgebra::Vector2;

use crate::saddle::Saddle;

/// A neighbour lies within this angle of an edge (cosine of 18°), at most so many shares of the picture's width away.
const ALONG: f64 = 0.95;
const FARTHEST: f64 = 0.34;
/// Neighbours that are tried along an edge: between two corners of a board with markers there may be crossings of a marker.
const TRIED: usize = 2;
/// Pairs of steps that are tried from a corner.
const PAIRS: usize = 10;
/// Both steps are of about one length: a board that is tilted by 70° shortens one of them to a third.
const RATIO: f64 = 3.0;

/// Pairs of steps across and down from a saddle, nearest first, down turned from across as rows are from columns.
pub(crate) fn first_steps(saddles: &[Saddle], seed: usize, width: f64) -> Vec<[Vector2<f64>; 2]> {
    let [first, second] = saddles[seed].edges.map(|along| {
        let mut ways = ahead(saddles, seed, along, width);
        ways.extend(ahead(saddles, seed, -along, width).into_iter().map(|way| -way));
        ways
    });
    let mut pairs = Vec::new();
    for across in &first {
        for down in &second {
            let (long, short) = (across.norm().max(down.norm()), across.norm().min(down.norm()));
            if long <= RATIO * short {
                let down = if across.perp(down) < 0.0 { -down } else { *down };
                pairs.push([*across, down]);
            }
        }
    }
    pairs.sort_by(|a, b| (a[0].norm() + a[1].norm()).total_cmp(&(b[0].norm() + b[1].norm())));
    pairs.truncate(PAIRS);
    pairs
}

/// The ways to the nearest saddles along a direction whose bright and dark quadrants are exchanged, as those of neighbours are.
fn ahead(saddles: &[Saddle], seed: usize, along: Vector2<f64>, width: f64) -> Vec<Vector2<f64>> {
    let own = saddles[seed].edges;
    let is_exchanged = |s: &Saddle| s.edges[0].dot(&own[1]).abs() > s.edges[0].dot(&own[0]).abs();
    let others = saddles.iter().enumerate().filter(|(i, s)| *i != seed && is_exchanged(s));
    let ways = others.map(|(_, s)| s.at - saddles[seed].at);
    let mut ways: Vec<_> = ways.filter(|w| w.dot(&along) > ALONG * w.norm() && w.norm() < FARTHEST * width).collect();
    ways.sort_by(|a, b| a.norm().total_cmp(&b.norm()));
    ways.truncate(TRIED);
    ways
}
