//! ChArUco boards: a chessboard whose white squares hold markers, so that each corner is known by its number and a part of the
//! board is as good as the whole one.
//!
//! A grid of crossings grows from one of them to its neighbours, as for chessboards. The marker in each of its squares is read
//! and says where that square is on the board; the place of the grid that most markers agree on is taken.

mod dictionary;
mod marker;

use std::collections::BTreeMap;

use nalgebra::Point2;

use crate::{
    board::{Board, Corner},
    grey::Grey,
    grid::{BLURS, Cell, grow},
    homography::{homography, mapped},
    saddle::{Saddle, find_saddles, refine},
    steps::first_steps,
};

pub use dictionary::Dictionary;

/// Crossings from which a grid is grown at most, for each blur.
const SEEDS: usize = 60;
/// Markers that agree on a place, at least.
const LEAST_MARKERS: usize = 2;
/// A corner without a marker that was read lies within this share of an edge from where the others say: a lens moves it by less, a
/// marker's own crossings lie farther away (they are a quarter of an edge and more from every line of the board).
const ASIDE: f64 = 0.15;
/// Window of the refinement as a share of the way from a corner to the nearest marker: no marker's edge lies in it.
const WINDOW: f64 = 0.9;
/// Its limits, pixels.
const WINDOWS: (f64, f64) = (2.0, 9.0);

/// A ChArUco board.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Charuco {
    /// Squares from left to right.
    pub columns: usize,
    /// Squares from top to bottom.
    pub rows: usize,
    /// Edge of a square, metres.
    pub square_m: f64,
    /// Edge of a marker with its black border, metres.
    pub marker_m: f64,
    /// Its markers are the first ones of this dictionary, row by row.
    pub dictionary: Dictionary,
    /// Made by OpenCV before 4.6: with an even number of rows it has white in the first corner, since then black.
    pub is_legacy: bool,
}

/// Where a grid lies on the board: quarter turns, and the square that the grid's (0, 0) then is.
type Place = (usize, Cell);

impl Charuco {
    /// Its inner corners as those of a chessboard, numbered row by row from the top left.
    pub fn board(&self) -> Board {
        Board { columns: self.columns - 1, rows: self.rows - 1, square_m: self.square_m }
    }

    /// The squares with markers in the order of their ids.
    fn squares(&self) -> Vec<Cell> {
        let white_first = self.is_legacy && self.rows.is_multiple_of(2);
        let all = (0..self.rows as i32).flat_map(|y| (0..self.columns as i32).map(move |x| (x, y)));
        all.filter(|(x, y)| ((x + y) % 2 == 1) != white_first).collect()
    }
}

/// The inner corners that are seen of a board, by their numbers; `None` where fewer than two of its markers are.
pub fn find_charuco(picture: &Grey, board: &Charuco) -> Option<Vec<Corner>> {
    if picture.width < 16 || picture.height < 16 {
        return None;
    }
    BLURS.iter().find_map(|&sigma| {
        let saddles = find_saddles(picture, sigma);
        let grown = (0..saddles.len().min(SEEDS)).flat_map(|seed| {
            let steps = first_steps(&saddles, seed, picture.width as f64);
            steps.into_iter().map(move |steps| (seed, steps))
        });
        grown.into_iter().find_map(|(seed, steps)| {
            let cells = grow(&saddles, seed, steps, board.columns * board.rows)?;
            let (place, squares) = place(picture, &saddles, &cells, board)?;
            numbered(picture, &saddles, &cells, (place, &squares), board)
        })
    })
}

/// The place on the board that most of a grid's markers agree on, and the squares of these markers in the grid.
fn place(
    picture: &Grey,
    saddles: &[Saddle],
    cells: &BTreeMap<Cell, usize>,
    board: &Charuco,
) -> Option<(Place, Vec<Cell>)> {
    let at = |cell: Cell| cells.get(&cell).map(|&i| saddles[i].at);
    let share = board.marker_m / board.square_m;
    let mut votes: BTreeMap<Place, Vec<Cell>> = BTreeMap::new();
    let squares = board.squares();
    for &(u, v) in cells.keys() {
        let corners = [at((u, v)), at((u + 1, v)), at((u + 1, v + 1)), at((u, v + 1))];
        let [Some(a), Some(b), Some(c), Some(d)] = corners else { continue };
        let Some(read) = marker::read(picture, &[a, b, c, d], share, board.dictionary.squares) else { continue };
        let Some((id, turns)) = board.dictionary.find(read, squares.len()) else { continue };
        let turned = (0..turns).fold((u, v), |(u, v), _| (-v - 1, u));
        let (x, y) = squares[id];
        votes.entry((turns, (x - turned.0, y - turned.1))).or_default().push((u, v));
    }
    let (place, agreed) = votes.iter().max_by_key(|(_, squares)| squares.len())?;
    let others = votes.iter().filter(|(other, _)| *other != place).map(|(_, squares)| squares.len()).max().unwrap_or(0);
    (agreed.len() >= LEAST_MARKERS && agreed.len() >= 2 * others).then(|| (*place, agreed.clone()))
}

/// The grid's crossings that are inner corners of the board, refined: corners of squares whose markers were read, and others that lie
/// where those say. Where a corner is hidden, a grid may go on over a marker's own crossings.
fn numbered(
    picture: &Grey,
    saddles: &[Saddle],
    cells: &BTreeMap<Cell, usize>,
    ((turns, (right, down)), squares): (Place, &[Cell]),
    board: &Charuco,
) -> Option<Vec<Corner>> {
    let margin = 0.5 * (1.0 - board.marker_m / board.square_m) * 2f64.sqrt();
    let inner = board.board();
    let of = |(cell, &saddle): (&Cell, &usize)| {
        let (x, y) = (0..turns).fold(*cell, |(u, v), _| (-v, u));
        let (x, y) = (x + right - 1, y + down - 1);
        let is_inner = (0..inner.columns as i32).contains(&x) && (0..inner.rows as i32).contains(&y);
        let beside = [(1, 0), (-1, 0), (0, 1), (0, -1)].map(|(u, v)| cells.get(&(cell.0 + u, cell.1 + v)));
        let at = saddles[saddle].at;
        let edge = beside.into_iter().flatten().map(|&i| (saddles[i].at - at).norm()).fold(f64::INFINITY, f64::min);
        let is_read = (0..4).any(|k| squares.contains(&(cell.0 - k % 2, cell.1 - k / 2)));
        is_inner.then(|| Found { id: y as usize * inner.columns + x as usize, at, edge, is_read })
    };
    let found: Vec<Found> = cells.iter().filter_map(of).collect();
    let plane = inner.corners();
    let (from, to): (Vec<_>, Vec<_>) = found.iter().filter(|f| f.is_read).map(|f| (plane[f.id], f.at)).unzip();
    let map = homography(&from, &to)?;
    let is_there = |f: &&Found| f.is_read || (mapped(&map, &plane[f.id]) - f.at).norm() < ASIDE * f.edge;
    let refined = |f: &Found| {
        let half = (WINDOW * margin * f.edge).clamp(WINDOWS.0, WINDOWS.1);
        refine(picture, f.at, half).map(|at| Corner { id: f.id, at })
    };
    let mut corners: Vec<Corner> = found.iter().filter(is_there).filter_map(refined).collect();
    corners.sort_by_key(|corner| corner.id);
    Some(corners)
}

/// A crossing that may be an inner corner.
struct Found {
    id: usize,
    at: Point2<f64>,
    /// The shortest way to a neighbour, pixels.
    edge: f64,
    /// The marker of one of its squares was read.
    is_read: bool,
}

#[cfg(test)]
mod tests;
