//! The board.

use nalgebra::{Point2, Point3};

/// An inner corner of a board in a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// Its number on the board, row by row as [`Board::corners`] has them.
    pub id: usize,
    /// Where it is seen, pixels.
    pub at: Point2<f64>,
}

impl Corner {
    /// All corners of a board, in their order.
    pub fn all(seen: Vec<Point2<f64>>) -> Vec<Self> {
        seen.into_iter().enumerate().map(|(id, at)| Self { id, at }).collect()
    }
}

/// A chessboard: its inner corners, where four squares meet. A board whose columns and rows are one odd and one even has
/// a first corner; others look the same after half a turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Board {
    /// Inner corners along the longer side.
    pub columns: usize,
    /// Inner corners along the shorter side.
    pub rows: usize,
    /// Edge of a square, metres.
    pub square_m: f64,
}

impl Board {
    /// Number of inner corners.
    pub fn count(&self) -> usize {
        self.columns * self.rows
    }

    /// True where half a turn of the board can be seen.
    pub fn has_a_first_corner(&self) -> bool {
        (self.columns + self.rows) % 2 == 1
    }

    /// The corners row by row in the board's plane, metres.
    pub fn corners(&self) -> Vec<Point2<f64>> {
        let at = |k: usize| [k % self.columns, k / self.columns].map(|c| c as f64 * self.square_m);
        (0..self.count()).map(|k| Point2::from(at(k))).collect()
    }

    /// The same as points of space, z = 0.
    pub fn points(&self) -> Vec<Point3<f64>> {
        self.corners().into_iter().map(|p| Point3::new(p.x, p.y, 0.0)).collect()
    }
}
