//! The body gives way where a garment is too tight for it: the V-Man project's own way (paper 004 §2.1.3: "a final process detects all
//! triangles from the naked mesh that intersect with the garment mesh and move them backward").

use nalgebra::Vector3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use toile_geometry::{
    Mesh,
    bvh::Bvh,
    intersection::crossings,
    open_surface::{Against, OpenSurface},
};

/// Cloth is looked for within this distance of the skin, metres: cloth that is tighter is not of this body.
const REACH: f32 = 0.03;
/// Skin and cloth belong together where they face alike (cosine).
const ALIKE: f32 = 0.3;
/// Limit of the rounds; each moves what still crosses one gap further.
const ROUNDS: usize = 16;

/// What gives way where a garment is too tight for the body.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Part {
    /// The cloth is moved outwards.
    #[default]
    Cloth,
    /// The body is moved inwards first.
    Body,
}

impl Part {
    /// True for the usual way.
    pub fn is_cloth(&self) -> bool {
        *self == Self::Cloth
    }
}

/// How the body gave way.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct PressReport {
    /// Pairs of triangles of body and garments that crossed before.
    pub crossing_before: usize,
    /// And after.
    pub crossing_after: usize,
    /// Vertices of the body that moved.
    pub moved: usize,
    /// The furthest of them, metres.
    pub most_m: f32,
}

/// Moves the vertices of `body` inwards that lie outside of one of the `layers`, or nearer below it than its gap of `gaps` (metres), and
/// then those of all triangles that still cross, until none does.
pub fn press_in(body: &mut Mesh, layers: &[Mesh], gaps: &[f32]) -> PressReport {
    let cloth: Vec<(OpenSurface, f32)> =
        layers.par_iter().map(OpenSurface::new).zip(gaps.par_iter().copied()).collect();
    let start = body.positions.clone();
    let mut report = PressReport { crossing_before: crossing(body, &cloth).len(), ..PressReport::default() };
    let normals = body.vertex_normals();
    body.positions.par_iter_mut().zip(&normals).for_each(|(p, normal)| {
        for (surface, gap) in &cloth {
            if let Against::Over(height) = surface.locate(p, REACH)
                && height.value > -gap
                && height.normal.dot(normal) > ALIKE
            {
                *p -= height.normal * (height.value + gap);
            }
        }
    });
    for _ in 0..ROUNDS {
        let still = crossing(body, &cloth);
        if still.is_empty() {
            break;
        }
        let mut back = vec![Vector3::zeros(); body.positions.len()];
        for (t, by) in still {
            body.triangles[t as usize].iter().for_each(|&v| back[v as usize] = by);
        }
        body.positions.iter_mut().zip(back).for_each(|(p, by)| *p += by);
    }
    report.crossing_after = crossing(body, &cloth).len();
    let moved = || body.positions.iter().zip(&start).map(|(a, b)| (a - b).norm()).filter(|d| *d > 0.0);
    (report.moved, report.most_m) = (moved().count(), moved().fold(0.0, f32::max));
    body.recompute_normals();
    report
}

/// Triangles of the body that cross cloth, and the way back under it.
fn crossing(body: &Mesh, cloth: &[(OpenSurface, f32)]) -> Vec<(u32, Vector3<f32>)> {
    let bvh = Bvh::new(&body.positions, &body.triangles);
    let of = |(surface, gap): &(OpenSurface, f32)| -> Vec<(u32, Vector3<f32>)> {
        let pairs = crossings(body, &bvh, &surface.mesh, &surface.bvh);
        pairs.into_iter().map(|[t, u]| (t, -surface.smooth_normal(u, [1.0 / 3.0; 3]) * *gap)).collect()
    };
    cloth.par_iter().flat_map_iter(of).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;

    /// A sheet of 30 by 30 vertices, 10 mm apart, facing up.
    fn sheet(height: impl Fn(f32, f32) -> f32) -> Mesh {
        let n = 30u32;
        let at = |v: u32| {
            let (x, z) = ((v % n) as f32 * 0.01, (v / n) as f32 * 0.01);
            Point3::new(x, height(x, z), z)
        };
        let cell = |q: u32| q / (n - 1) * n + q % (n - 1);
        let cut = |a: u32| [[a, a + n, a + 1], [a + 1, a + n, a + n + 1]];
        Mesh::new((0..n * n).map(at).collect(), (0..(n - 1) * (n - 1)).map(cell).flat_map(cut).collect())
    }

    #[test]
    fn skin_that_stands_through_tight_cloth_goes_under_it_and_the_rest_stays() {
        let hill = |x: f32, z: f32| 0.01 * (-((x - 0.15).powi(2) + (z - 0.15).powi(2)) / 0.002).exp();
        let (mut body, cloth) = (sheet(hill), sheet(|_, _| 0.005));
        let (start, gap) = (body.clone(), 0.0015);
        let report = press_in(&mut body, std::slice::from_ref(&cloth), &[gap]);
        assert!(report.crossing_before > 20 && report.crossing_after == 0, "{report:?}");
        assert!((report.most_m - 0.0065).abs() < 0.003, "{report:?}");
        for (p, q) in body.positions.iter().zip(&start.positions) {
            assert!(p.y < 0.005 - 0.9 * gap && (q.y > 0.0035 || p == q), "{q} went to {p}");
        }
    }
}
