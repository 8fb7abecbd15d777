//! Corners in rows and columns: a grid grows from one corner to its neighbours.

use std::collections::BTreeMap;

use nalgebra::{Point2, Vector2};

use crate::{
    board::Board,
    grey::Grey,
    saddle::{Saddle, find_saddles, refine},
};

/// Blurs that are tried, pixels: sharp pictures first, then noisy and large ones.
pub(crate) const BLURS: [f64; 3] = [1.5, 2.5, 4.0];
/// Corners from which a grid is grown at most, for each blur.
const SEEDS: usize = 60;
/// A neighbour lies within this share of a step from where it is expected.
const ASIDE: f64 = 0.3;
/// The first neighbours lie within this angle of an edge (cosine of 18°), at most so many shares of the width away.
const ALONG: f64 = 0.95;
const FARTHEST: f64 = 0.34;
/// Window of the refinement, as a share of a square's shorter edge in the picture, and its limits, pixels.
const WINDOW: f64 = 0.3;
const WINDOWS: (f64, f64) = (2.0, 9.0);

/// Column and row of a corner in a grid, from the one that it grew from.
pub(crate) type Cell = (i32, i32);

/// The inner corners of the board in a picture, row by row as [`Board::corners`] has them; `None` where the whole board is
/// not seen. Where the board has a first corner, it is found; else the first corner is the one nearer to the top left.
pub fn find_corners(picture: &Grey, board: &Board) -> Option<Vec<Point2<f64>>> {
    if picture.width < 16 || picture.height < 16 {
        return None;
    }
    BLURS.iter().find_map(|&sigma| {
        let saddles = find_saddles(picture, sigma);
        let grown = |seed: usize| {
            let steps = nearest_steps(&saddles, seed, picture.width as f64)?;
            grow(&saddles, seed, steps, 4 * board.count())
        };
        let seeds = (0..saddles.len().min(SEEDS)).map(grown);
        let cells = seeds.flatten().find_map(|cells| whole_board(&cells, board))?;
        let rough = in_order(picture, &saddles, &cells, board);
        let half = (WINDOW * shortest_edge(&rough, board)).clamp(WINDOWS.0, WINDOWS.1);
        rough.into_iter().map(|p| refine(picture, p, half)).collect()
    })
}

/// The steps to the right and down from a seed.
fn nearest_steps(saddles: &[Saddle], seed: usize, width: f64) -> Option<[Vector2<f64>; 2]> {
    let [first, second] = saddles[seed].edges;
    let mut steps = [first, -first, second, -second].into_iter().map(|d| neighbour_along(saddles, seed, d, width));
    let steps: [Option<Vector2<f64>>; 4] = std::array::from_fn(|_| steps.next().flatten());
    Some([steps[0].or(steps[1].map(|s| -s))?, steps[2].or(steps[3].map(|s| -s))?])
}

/// The grid around a seed by its first steps: cells and their saddles; `None` where it has more than `most`.
pub(crate) fn grow(
    saddles: &[Saddle],
    seed: usize,
    first: [Vector2<f64>; 2],
    most: usize,
) -> Option<BTreeMap<Cell, usize>> {
    let mut cells = BTreeMap::from([((0, 0), seed)]);
    let mut taken = vec![false; saddles.len()];
    taken[seed] = true;
    let mut edge = vec![(0, 0)];
    while let Some(cell) = edge.pop() {
        if cells.len() > most {
            return None;
        }
        for step in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
            let next = (cell.0 + step.0, cell.1 + step.1);
            if cells.contains_key(&next) {
                continue;
            }
            let way = step_at(saddles, &cells, cell, step, first);
            let expected = saddles[cells[&cell]].at + way;
            if let Some(found) = nearest(saddles, &taken, &expected, ASIDE * way.norm()) {
                taken[found] = true;
                cells.insert(next, found);
                edge.insert(0, next);
            }
        }
    }
    Some(cells)
}

/// The step from a cell on: as the one before it, or as that of the neighbours beside.
fn step_at(
    saddles: &[Saddle],
    cells: &BTreeMap<Cell, usize>,
    cell: Cell,
    step: Cell,
    first: [Vector2<f64>; 2],
) -> Vector2<f64> {
    let at = |c: Cell| cells.get(&c).map(|&i| saddles[i].at);
    let from = |c: Cell| Some(at((c.0 + step.0, c.1 + step.1))? - at(c)?);
    let before = from((cell.0 - step.0, cell.1 - step.1));
    let beside = from((cell.0 + step.1, cell.1 + step.0)).or_else(|| from((cell.0 - step.1, cell.1 - step.0)));
    beside.or(before).unwrap_or(first[0] * f64::from(step.0) + first[1] * f64::from(step.1))
}

/// The way to the nearest saddle along a direction.
fn neighbour_along(saddles: &[Saddle], seed: usize, along: Vector2<f64>, width: f64) -> Option<Vector2<f64>> {
    let ways = saddles.iter().enumerate().filter(|(i, _)| *i != seed).map(|(_, s)| s.at - saddles[seed].at);
    let ahead = ways.filter(|w| w.dot(&along) > ALONG * w.norm() && w.norm() < FARTHEST * width);
    ahead.min_by(|a, b| a.norm().total_cmp(&b.norm()))
}

fn nearest(saddles: &[Saddle], taken: &[bool], to: &Point2<f64>, within: f64) -> Option<usize> {
    let free = (0..saddles.len()).filter(|&i| !taken[i] && (saddles[i].at - to).norm() < within);
    free.min_by(|&a, &b| (saddles[a].at - to).norm().total_cmp(&(saddles[b].at - to).norm()))
}

/// Columns and rows that the cells span, from their least ones on.
fn span(cells: &BTreeMap<Cell, usize>) -> (Cell, [i32; 2]) {
    let ends = |of: fn(&Cell) -> i32| {
        let all = || cells.keys().map(of);
        (all().min().unwrap_or(0), all().max().unwrap_or(0))
    };
    let (columns, rows) = (ends(|c| c.0), ends(|c| c.1));
    ((columns.0, rows.0), [columns.1 - columns.0 + 1, rows.1 - rows.0 + 1])
}

/// The part of a grid that is a whole board, of strong saddles rather than of weak ones: beyond a board's border corners of
/// other things may lie by chance in its rows.
fn whole_board(cells: &BTreeMap<Cell, usize>, board: &Board) -> Option<BTreeMap<Cell, usize>> {
    if cells.len() < board.count() {
        return None;
    }
    let ((left, top), [columns, rows]) = span(cells);
    let (w, h) = (board.columns as i32, board.rows as i32);
    let mut best: Option<(usize, BTreeMap<Cell, usize>)> = None;
    for (w, h) in [(w, h), (h, w)] {
        let corners = (0..=columns - w).flat_map(|x| (0..=rows - h).map(move |y| (left + x, top + y)));
        for (x, y) in corners {
            let inside = |c: &Cell| (x..x + w).contains(&c.0) && (y..y + h).contains(&c.1);
            let part: BTreeMap<Cell, usize> = cells.iter().filter(|c| inside(c.0)).map(|c| (*c.0, *c.1)).collect();
            let weakest = part.values().copied().max().unwrap_or(0);
            let is_whole = part.len() == board.count() && !goes_on(cells, (x, y), (w, h));
            if is_whole && best.as_ref().is_none_or(|b| weakest < b.0) {
                best = Some((weakest, part));
            }
        }
    }
    best.map(|b| b.1)
}

/// True where a whole row or column follows on a side of a part: it belongs to a larger board, which is not the one asked for.
fn goes_on(cells: &BTreeMap<Cell, usize>, (x, y): Cell, (w, h): Cell) -> bool {
    let column = |x: i32| (y..y + h).all(|y| cells.contains_key(&(x, y)));
    let row = |y: i32| (x..x + w).all(|x| cells.contains_key(&(x, y)));
    column(x - 1) || column(x + w) || row(y - 1) || row(y + h)
}

/// The corners row by row: columns along the longer side, rows turned from them as in the board's plane, the first corner
/// where the board has one.
fn in_order(picture: &Grey, saddles: &[Saddle], cells: &BTreeMap<Cell, usize>, board: &Board) -> Vec<Point2<f64>> {
    let ((left, top), size) = span(cells);
    let lies = size[0] != board.columns as i32;
    let at = |c: usize, r: usize| {
        let (c, r) = if lies { (r, c) } else { (c, r) };
        saddles[cells[&(left + c as i32, top + r as i32)]].at
    };
    let (w, h) = (board.columns, board.rows);
    let mut corners: Vec<Point2<f64>> = (0..w * h).map(|k| at(k % w, k / w)).collect();
    let (across, down) = (corners[w - 1] - corners[0], corners[(h - 1) * w] - corners[0]);
    if across.perp(&down) < 0.0 {
        corners = (0..w * h).map(|k| corners[(h - 1 - k / w) * w + k % w]).collect();
    }
    let turned: Vec<Point2<f64>> = corners.iter().rev().copied().collect();
    let begins = if board.has_a_first_corner() {
        outer_square(picture, &corners, w) < outer_square(picture, &turned, w)
    } else {
        corners[0].x + corners[0].y <= turned[0].x + turned[0].y
    };
    if begins { corners } else { turned }
}

/// Brightness of the square beyond the first corner less that of its neighbours: dark where the board begins.
fn outer_square(picture: &Grey, corners: &[Point2<f64>], columns: usize) -> f64 {
    let (a, b) = (corners[1] - corners[0], corners[columns] - corners[0]);
    let at = |x: f64, y: f64| {
        let p = corners[0] + a * x + b * y;
        picture.sample(p.x, p.y)
    };
    2.0 * at(-0.4, -0.4) - at(0.4, -0.4) - at(-0.4, 0.4)
}

fn shortest_edge(corners: &[Point2<f64>], board: &Board) -> f64 {
    let right = corners.iter().enumerate().filter(|(k, _)| (k + 1) % board.columns != 0);
    let across = right.map(|(k, p)| (corners[k + 1] - p).norm());
    let down = corners.iter().zip(&corners[board.columns..]).map(|(p, q)| (q - p).norm());
    across.chain(down).fold(f64::INFINITY, f64::min)
}
