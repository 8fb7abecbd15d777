//! The vertices of a layer that helpers are found from.

use nalgebra::{Isometry3, Point3};
use rayon::prelude::*;
use toile_character::SkinWeights;

use super::layer::LayerMotion;

/// At most so many vertices of a layer are sampled: some hundred a helper, where six numbers are sought of each.
const MOST_VERTICES: usize = 2500;

/// Sampled vertices of a layer and what they do.
#[derive(Debug)]
pub(super) struct Sampled {
    /// Which vertices, ascending.
    pub vertices: Vec<u32>,
    /// Where they rest.
    pub rest: Vec<Point3<f64>>,
    /// Joints that move them.
    pub joints: Vec<Vec<u8>>,
    /// Where they are, frame by frame.
    pub frames: Vec<Vec<Point3<f64>>>,
    /// Mean over the frames of the squared distance between them and their skin, metres².
    pub skin_errors: Vec<f64>,
}

impl Sampled {
    pub fn new(layer: &LayerMotion<'_>, joints: &[Vec<Isometry3<f64>>]) -> Self {
        let vertices = drawn(layer.rest.len(), MOST_VERTICES);
        let of =
            |points: &[Point3<f32>]| vertices.iter().map(|&v| points[v as usize].cast::<f64>()).collect::<Vec<_>>();
        let frames: Vec<Vec<Point3<f64>>> = layer.frames.par_iter().map(|frame| of(frame)).collect();
        let rest = of(layer.rest);
        let error = |(k, &v): (usize, &u32)| {
            let off = |(frame, joints): (&Vec<Point3<f64>>, &Vec<Isometry3<f64>>)| {
                let moved =
                    layer.weights.of(v as usize).map(|(j, w)| f64::from(w) * (joints[usize::from(j)] * rest[k]).coords);
                (frame[k].coords - moved.sum::<nalgebra::Vector3<f64>>()).norm_squared()
            };
            frames.iter().zip(joints).map(off).sum::<f64>() / frames.len() as f64
        };
        let skin_errors = vertices.par_iter().enumerate().map(error).collect();
        let joints = vertices.iter().map(|&v| layer.weights.of(v as usize).map(|i| i.0).collect()).collect();
        Self { vertices, rest, joints, frames, skin_errors }
    }
}

/// Sampled vertices with their weights.
#[derive(Debug, Clone)]
pub(super) struct Weighted {
    vertices: Vec<u32>,
    /// Where they rest.
    pub rest: Vec<Point3<f64>>,
    /// Joints of the skeleton and their weights.
    pub skeleton: Vec<Vec<(u8, f64)>>,
    /// Helpers, counted from the layer's first, and their weights.
    pub helpers: Vec<Vec<(usize, f64)>>,
    /// One more than the highest joint of the skeleton.
    pub joints: usize,
}

impl Weighted {
    /// The layer's `vertices` with their `weights`, in which helpers are numbered from `first` on.
    pub fn new(rest: &[Point3<f32>], vertices: &[u32], weights: &SkinWeights, first: usize) -> Self {
        let of = |&v: &u32| weights.of(v as usize).map(|(j, w)| (usize::from(j), f64::from(w)));
        let skeleton: Vec<Vec<(u8, f64)>> =
            vertices.iter().map(|v| of(v).filter(|i| i.0 < first).map(|(j, w)| (j as u8, w)).collect()).collect();
        let helpers = |v| of(v).filter(|i| i.0 >= first).map(|(j, w)| (j - first, w)).collect();
        Self {
            rest: vertices.iter().map(|&v| rest[v as usize].cast::<f64>()).collect(),
            helpers: vertices.iter().map(helpers).collect(),
            joints: skeleton.iter().flatten().map(|i| usize::from(i.0) + 1).max().unwrap_or(0),
            vertices: vertices.to_vec(),
            skeleton,
        }
    }

    /// The sampled ones of a frame's `positions`.
    pub fn targets(&self, positions: &[Point3<f32>]) -> Vec<Point3<f64>> {
        self.vertices.iter().map(|&v| positions[v as usize].cast::<f64>()).collect()
    }
}

/// At most `most` of `total` vertices, ascending, the same in every run. They are drawn by chance: every so many-th vertex of a mesh that was made row by
/// row would lie on a few columns.
fn drawn(total: usize, most: usize) -> Vec<u32> {
    let mut vertices: Vec<u32> = (0..total as u32).collect();
    if total > most {
        vertices.sort_by_cached_key(|&v| (scrambled(v), v));
        vertices.truncate(most);
        vertices.sort_unstable();
    }
    vertices
}

/// A number without any order (the finaliser of SplitMix64).
fn scrambled(index: u32) -> u64 {
    let mut z = u64::from(index).wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_lie_in_all_columns_and_rows() {
        let (rows, columns, most) = (250, 120, 2500);
        let vertices = drawn(rows * columns, most);
        assert_eq!(vertices.len(), most);
        assert!(vertices.windows(2).all(|v| v[0] < v[1]));
        let count = |of: &dyn Fn(usize) -> usize, bins: usize| {
            let mut counts = vec![0; bins];
            vertices.iter().for_each(|&v| counts[of(v as usize)] += 1);
            [*counts.iter().min().unwrap(), *counts.iter().max().unwrap()]
        };
        // 20.8 and 10 are to be expected; five standard deviations of chance.
        let [fewest, most] = count(&|v| v % columns, columns);
        assert!(fewest > 0 && most < 44, "{fewest} to {most}");
        let [fewest, most] = count(&|v| v / columns, rows);
        assert!(fewest > 0 && most < 26, "{fewest} to {most}");
        assert_eq!(drawn(3, 5), [0, 1, 2]);
    }
}
