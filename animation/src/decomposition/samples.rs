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
        let (count, total) = (layer.rest.len().min(MOST_VERTICES), layer.rest.len());
        let vertices: Vec<u32> = (0..count).map(|k| (k * total / count) as u32).collect();
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
