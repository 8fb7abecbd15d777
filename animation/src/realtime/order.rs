//! Layers that keep their order, whatever the simulation left of it: each garment in turn is lifted over all layers below.

use nalgebra::{Point3, Vector3};
use toile_geometry::{
    Mesh,
    bvh::Bvh,
    rims,
    topology::{Edges, VertexNeighbors},
};

use super::{lifts::Lifts, over::Over, surface::Surface, through::Through};

/// Edges of cloth roll in: up to here from a rim, metres, what faces elsewhere lies over a lower layer all the same. A coat's wide hem is
/// turned by as much.
const HEM: f32 = 0.03;

/// Where the garments stand over the layers below.
pub(super) struct Order {
    surfaces: Vec<Surface>,
    garments: Vec<Garment>,
}

/// A garment over the layers below, inside to outside.
struct Garment {
    edges: Vec<[u32; 2]>,
    over: Vec<Over>,
    through: Vec<Through>,
    lifts: Lifts,
    /// True for the vertices that stand over a layer in this frame: those below it keep their order with it.
    stand: Vec<bool>,
}

impl Order {
    /// For `layers` in the outfit's first pose, inside to outside.
    pub fn new(layers: &[&Mesh]) -> Self {
        let surfaces: Vec<Surface> = layers.iter().map(|l| Surface::new(&l.triangles, l.positions.len())).collect();
        let bvhs: Vec<Bvh> = layers.iter().map(|l| Bvh::new(&l.positions, &l.triangles)).collect();
        let normals: Vec<Vec<Vector3<f32>>> = layers.iter().map(|l| l.vertex_normals()).collect();
        let garment = |k: usize| {
            let (edges, hem) = (Edges::new(&layers[k].triangles).vertices, hem(layers[k]));
            let below = |j: usize| (layers[j], &surfaces[j], &bvhs[j]);
            let over = (0..k).map(|j| Over::new(layers[k], (&normals[k], &hem), below(j))).collect();
            let through: Vec<Through> =
                (0..k).map(|j| Through::new(below(j), &normals[j], (j + 1..=k).map(below))).collect();
            let most = through.iter().map(Through::count).fold(edges.len(), usize::max);
            let n = layers[k].positions.len();
            Garment { lifts: Lifts::new(n, most), stand: vec![false; n], edges, over, through }
        };
        Self { garments: (1..layers.len()).map(garment).collect(), surfaces }
    }

    /// Lifts the vertices of garment `k` of `layers` (from 1) over all layers below, which are in order.
    pub fn keep(&mut self, layers: &mut [Vec<Point3<f32>>], k: usize) {
        let Self { surfaces, garments } = self;
        let Garment { edges, over, through, lifts, stand } = &mut garments[k - 1];
        let (below, rest) = layers.split_at_mut(k);
        let points = &mut rest[0];
        stand.fill(false);
        for (j, over) in over.iter_mut().enumerate().rev() {
            over.lift_points((points, stand), &surfaces[j], &below[j]);
        }
        for (j, over) in over.iter().enumerate() {
            over.lift_edges(points, edges, (&surfaces[j], &below[j]), lifts);
        }
        for (j, through) in through.iter_mut().enumerate() {
            through.lift((points, &surfaces[k]), (&below[j], &surfaces[j]), lifts);
        }
    }
}

/// True for the vertices of a mesh within [`HEM`] of a rim, by as many edges as make up that way.
fn hem(mesh: &Mesh) -> Vec<bool> {
    let edges = Edges::new(&mesh.triangles);
    let length = |ends: &[u32; 2]| {
        let [a, b] = ends.map(|v| mesh.positions[v as usize]);
        (b - a).norm()
    };
    let mean = edges.vertices.iter().map(length).sum::<f32>() / edges.vertices.len().max(1) as f32;
    let rings = (HEM / mean.max(1e-4)).ceil() as usize;
    let neighbors = VertexNeighbors::new(mesh.positions.len(), &mesh.triangles);
    let mut hem = vec![false; mesh.positions.len()];
    let rim = rims::rim_neighbors(&edges).into_keys().collect();
    rims::grow(rim, &neighbors, rings).into_iter().for_each(|v| hem[v as usize] = true);
    hem
}

#[cfg(test)]
mod tests {
    use toile_geometry::intersection::crossings;

    use super::*;

    /// A sheet facing up, of 5 mm squares from `x` on and on both sides of z = 0, so many `columns` and `rows`, at `height(x, z)`.
    fn sheet(x: f32, [columns, rows]: [u32; 2], height: impl Fn(f32, f32) -> f32) -> Mesh {
        let n = columns + 1;
        let at = |v: u32| {
            let (x, z) = (x + (v % n) as f32 * 0.005, ((v / n) as f32 - 0.5 * rows as f32) * 0.005);
            Point3::new(x, height(x, z), z)
        };
        let cell = |q: u32| q / columns * n + q % columns;
        let cut = |a: u32| [[a, a + n, a + 1], [a + 1, a + n, a + n + 1]];
        Mesh::new((0..n * (rows + 1)).map(at).collect(), (0..columns * rows).map(cell).flat_map(cut).collect())
    }

    fn crossing(a: &Mesh, b: &Mesh) -> usize {
        let bvh = |m: &Mesh| Bvh::new(&m.positions, &m.triangles);
        crossings(a, &bvh(a), b, &bvh(b)).len()
    }

    /// Pairs that cross before and after layers that were `scanned` so are kept in order where they `moved` to.
    fn kept(scanned: [&Mesh; 2], moved: [&Mesh; 2]) -> [usize; 2] {
        let mut order = Order::new(&scanned);
        let mut layers: Vec<Vec<Point3<f32>>> = moved.iter().map(|m| m.positions.clone()).collect();
        order.keep(&mut layers, 1);
        let [lower, upper] = [0, 1].map(|k| Mesh::new(layers[k].clone(), scanned[k].triangles.clone()));
        assert_eq!(lower.positions, moved[0].positions, "the lower layer stays");
        [crossing(moved[0], moved[1]), crossing(&lower, &upper)]
    }

    #[test]
    fn what_sank_is_lifted() {
        let (lower, upper) = (sheet(0.0, [20, 20], |_, _| 0.0), sheet(0.0013, [19, 18], |_, _| 0.003));
        let sunk = sheet(0.0013, [19, 18], |x, z| 0.003 - 0.006 * (-900.0 * ((x - 0.05).powi(2) + z * z)).exp());
        let [before, after] = kept([&lower, &upper], [&lower, &sunk]);
        assert!(before > 20 && after == 0, "{before}, then {after}");
    }

    #[test]
    fn a_ridge_between_vertices_lifts_the_edges_over_it() {
        let (lower, upper) = (sheet(0.0, [20, 20], |_, _| 0.0), sheet(0.0025, [19, 18], |_, _| 0.0015));
        // A roof over x = 0.05, between two columns of the upper sheet.
        let ridge = sheet(0.0, [20, 20], |x, _| (0.003 - (x - 0.05).abs()).max(0.0));
        let [before, after] = kept([&lower, &upper], [&ridge, &upper]);
        assert!(before > 20 && after == 0, "{before}, then {after}");
    }

    #[test]
    fn a_point_amid_a_triangle_lifts_it() {
        let (lower, upper) = (sheet(0.0, [20, 20], |_, _| 0.0), sheet(-0.0017, [21, 18], |_, z| 0.0012 + 0.0 * z));
        let tip = |x: f32, z: f32| if (x - 0.05).abs() + (z - 0.01).abs() < 1e-4 { 0.003 } else { 0.0 };
        let [before, after] = kept([&lower, &upper], [&sheet(0.0, [20, 20], tip), &upper]);
        assert!(before > 0 && after == 0, "{before}, then {after}");
    }

    #[test]
    fn a_hem_that_was_beside_the_lower_layer_comes_over_it() {
        let (lower, upper) = (sheet(0.0, [10, 20], |_, _| 0.0), sheet(0.0213, [11, 18], |_, _| 0.004));
        // The lower layer slides by 45 mm under the upper one, which sinks.
        let (slid, sunk) =
            (sheet(0.045, [10, 20], |_, _| 0.0), sheet(0.0213, [11, 18], |x, _| 0.002 - 0.2 * (x - 0.0513).max(0.0)));
        let [before, after] = kept([&lower, &upper], [&slid, &sunk]);
        assert!(before > 20 && after == 0, "{before}, then {after}");
    }

    #[test]
    fn an_edge_that_is_rolled_in_stays_over_the_lower_layer() {
        let lower = sheet(0.0, [20, 20], |_, _| 0.0);
        // The outermost 15 mm of the upper layer are turned below the rest, and face down.
        let mut upper = sheet(0.0213, [14, 18], |_, _| 0.012);
        for p in upper.positions.iter_mut().filter(|p| p.x < 0.036) {
            let turned = 0.0363 - p.x;
            *p = Point3::new(0.0363 + turned, 0.012 - 0.008 * (turned / 0.005).min(1.0), p.z);
        }
        let mut sunk = upper.clone();
        sunk.positions.iter_mut().for_each(|p| p.y -= 0.006);
        let [before, after] = kept([&lower, &upper], [&lower, &sunk]);
        assert!(before > 20 && after == 0, "{before}, then {after}");
    }
}
