//! Rectangular sheets for the trials.

use nalgebra::{Point3, Vector3};
use toile_cloth::{Anchors, Effort, Fabric, RestShape, Sheet};

/// Direction of the diagonals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Diagonal {
    Forward,
    Backward,
}

/// Both directions at three resolutions: cells across a strip's width.
pub fn trials() -> impl Iterator<Item = (u32, Diagonal)> {
    [2u32, 3, 5].into_iter().flat_map(|cells| [Diagonal::Forward, Diagonal::Backward].map(|d| (cells, d)))
}

/// Effort that goes to the minimum.
pub fn exact() -> Effort {
    Effort { rounds: 2, iterations: 60, tolerance: 1e-9, self_contact: false }
}

/// A grid in the plane of X and Z: `cells` across X, as many square ones as fit along Z.
pub struct Grid {
    pub rest: Vec<Point3<f64>>,
    pub triangles: Vec<[u32; 3]>,
    /// Vertices across.
    pub across: u32,
    pub rows: u32,
}

impl Grid {
    pub fn new(width: f64, length: f64, cells: u32, diagonal: Diagonal) -> Self {
        let (across, rows) = (cells + 1, (length / (width / f64::from(cells))).round().max(1.0) as u32 + 1);
        let at = |v: u32| {
            let (x, z) = (f64::from(v % across) / f64::from(cells), f64::from(v / across) / f64::from(rows - 1));
            Point3::new((x - 0.5) * width, 0.0, z * length)
        };
        let rest = (0..across * rows).map(at).collect();
        let corner = move |q: u32| q / cells * across + q % cells;
        let cut = |a: u32| match diagonal {
            Diagonal::Forward => [[a, a + across, a + 1], [a + 1, a + across, a + across + 1]],
            Diagonal::Backward => [[a, a + across, a + across + 1], [a, a + across + 1, a + 1]],
        };
        Self { rest, triangles: (0..cells * (rows - 1)).map(corner).flat_map(cut).collect(), across, rows }
    }

    pub fn row(&self, v: usize) -> u32 {
        v as u32 / self.across
    }

    /// A sheet of this grid; rows for which `held` is true are held in place by springs.
    pub fn sheet(&self, fabric: Fabric, held: impl Fn(u32) -> bool) -> Sheet {
        let stiffness = (0..self.rest.len()).map(|v| if held(self.row(v)) { 1e5 } else { 0.0 }).collect();
        let anchors = Anchors { stiffness };
        let (positions, triangles) = (&self.rest[..], &self.triangles[..]);
        let shape = RestShape { positions, triangles, curved: false, grain: Vector3::z() };
        Sheet::new(&shape, fabric, anchors).expect("a sheet")
    }

    pub fn places(&self) -> Vec<Vector3<f64>> {
        self.rest.iter().map(|p| p.coords).collect()
    }

    /// Mean place of a row of the sheet as it lies now.
    pub fn mean_of_row(&self, sheet: &Sheet, row: u32) -> Vector3<f64> {
        let of_row = (0..self.rest.len()).filter(|&v| self.row(v) == row);
        of_row.map(|v| sheet.positions[v]).sum::<Vector3<f64>>() / f64::from(self.across)
    }
}

/// A fabric without damping, shear that follows stretch, and friction of 0.4.
pub fn fabric(density: f64, stretch: f64, bending: f64) -> Fabric {
    Fabric { density, stretch, shear: stretch / 4.0, bending, thickness: 0.0005, friction: 0.4, damping: 0.0 }
}
