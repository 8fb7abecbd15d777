//! The foot of a point on a surface that moves, found by walking from where it was.

use nalgebra::{Point3, Vector3};
use toile_geometry::topology::{Edges, VertexTriangles};

/// No triangle.
pub(super) const NONE: u32 = u32::MAX;
/// Triangles that a walk crosses at most: a vertex moves by less than a few edges against the surface below in a frame.
const STEPS: usize = 24;

/// Triangles and which lie beside them.
pub(super) struct Surface {
    pub triangles: Vec<[u32; 3]>,
    /// The triangle across the edge opposite to each corner; [`NONE`] at a rim.
    across: Vec<[u32; 3]>,
    of_vertex: VertexTriangles,
}

/// Where a point stands over a surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Foot {
    /// Unit normal of the triangle.
    pub normal: Vector3<f32>,
    /// Height over the foot along that normal, metres; negative below.
    pub height: f32,
}

impl Surface {
    /// Of a mesh with so many `vertices`.
    pub fn new(triangles: &[[u32; 3]], vertices: usize) -> Self {
        let edges = Edges::new(triangles);
        let beside = edges.triangles();
        let other = |t: usize, side: usize| {
            let [a, b] = beside[edges.of_triangle[t][side] as usize];
            if a == t as u32 { b } else { a }
        };
        // Side k of a triangle joins corners k and k + 1: it is opposite to corner k + 2.
        let across = (0..triangles.len()).map(|t| [other(t, 1), other(t, 2), other(t, 0)]).collect();
        Self { triangles: triangles.to_vec(), across, of_vertex: VertexTriangles::new(vertices, triangles) }
    }

    /// Unit normal of vertex `v` of those at `places`, weighted by area; zero where its triangles have none.
    pub fn vertex_normal(&self, places: &[Point3<f32>], v: usize) -> Vector3<f32> {
        let area = |t: &u32| {
            let [a, b, c] = self.triangles[*t as usize].map(|v| places[v as usize]);
            (b - a).cross(&(c - a))
        };
        let sum: Vector3<f32> = self.of_vertex.of(v).iter().map(area).sum();
        sum.try_normalize(1e-12).unwrap_or_default()
    }

    /// The foot of `p` on the surface whose vertices are at `places`, walking from the triangle `seed`, which becomes where the walk
    /// ended. `None` beyond a rim, or where there is nothing to walk on.
    #[inline]
    pub fn foot(&self, places: &[Point3<f32>], p: &Point3<f32>, seed: &mut u32) -> Option<Foot> {
        let mut before = NONE;
        for _ in 0..STEPS {
            let t = *self.triangles.get(*seed as usize)?;
            let corners = t.map(|v| places[v as usize]);
            let (weights, normal) = projected(p, &corners)?;
            let lowest = (0..3).fold(0, |low, k| if weights[k] < weights[low] { k } else { low });
            if weights[lowest] >= 0.0 {
                return Some(foot(weights, normal, p, &corners));
            }
            let next = self.across[*seed as usize][lowest];
            if next == NONE {
                return None;
            }
            if next == before {
                // Over the ridge between two triangles: its foot is on their edge.
                return Some(foot(within(weights), normal, p, &corners));
            }
            (before, *seed) = (*seed, next);
        }
        None
    }
}

/// Barycentric coordinates of the projection of `p` into the plane of a triangle, and its unit normal.
#[inline]
fn projected(p: &Point3<f32>, [a, b, c]: &[Point3<f32>; 3]) -> Option<([f32; 3], Vector3<f32>)> {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let normal = ab.cross(&ac);
    let square = normal.norm_squared();
    if square < 1e-20 {
        return None;
    }
    let of_b = ap.cross(&ac).dot(&normal) / square;
    let of_c = ab.cross(&ap).dot(&normal) / square;
    Some(([1.0 - of_b - of_c, of_b, of_c], normal / square.sqrt()))
}

/// Coordinates of the nearest place inside, about: negative ones become 0.
fn within(weights: [f32; 3]) -> [f32; 3] {
    let positive = weights.map(|w| w.max(0.0));
    let sum: f32 = positive.iter().sum();
    positive.map(|w| w / sum)
}

#[inline]
fn foot(barycentric: [f32; 3], normal: Vector3<f32>, p: &Point3<f32>, [a, b, c]: &[Point3<f32>; 3]) -> Foot {
    let place = a.coords * barycentric[0] + b.coords * barycentric[1] + c.coords * barycentric[2];
    Foot { normal, height: (p.coords - place).dot(&normal) }
}
