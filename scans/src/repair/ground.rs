//! The floor or the turntable's disk under a person, cut away.

use nalgebra::Point3;
use toile_geometry::Mesh;

/// How thick the layer is in which a ground is looked for, metres: warp and noise of scanners' floors.
const LAYER: f32 = 0.01;
/// How far up from the lowest point a ground is looked for, metres: the thickness of a disk or a step.
const REACH: f32 = 0.25;
/// Upward area within the layer that makes it a ground, square metres. What faces up of a person within a layer as thin is
/// at most the backs of two feet, 0.02 m² (a foot of 28 cm by 10 cm seen from above has 0.025 m², which slopes over 10 cm).
const GROUND: f64 = 0.04;
/// Smallest cosine between the vertical and the normal of a ground's triangle.
const LEVEL: f32 = 0.94;
/// What is cut away over the ground, metres: its own noise and the rounding where shoes meet it.
const MARGIN: f32 = 0.012;
/// How far over the cut a border may lie, metres: the longest edges after refinement, and their slant.
const RAGGED: f32 = 0.016;

/// Cuts away the ground that a person stands on, +Y up, and everything below it. What is left of the border is let down to the
/// ground, so that soles lie where they were. Gives the ground's height; `None`, and the mesh as it was, where there is none.
pub(crate) fn cut_ground(mesh: &Mesh) -> Option<(Mesh, f32)> {
    let ground = ground(mesh)?;
    let limit = ground + MARGIN;
    let above = |t: usize| mesh.corners(t).iter().all(|p| p.y > limit);
    let (mut kept, _) = mesh.filter_triangles(above);
    // Triangles across the limit are cut away whole: what they leave reaches as far down as they did.
    for edge in border(&kept) {
        let p = &mut kept.positions[edge as usize];
        if p.y < limit + RAGGED {
            p.y = ground;
        }
    }
    (!kept.triangles.is_empty()).then_some((kept, ground))
}

/// Vertices on the border.
fn border(mesh: &Mesh) -> Vec<u32> {
    let mut all: Vec<u32> = toile_geometry::topology::boundary_loops(&mesh.triangles).into_iter().flatten().collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// The height of the level layer with the largest upward area near the lowest point, where that is a ground.
fn ground(mesh: &Mesh) -> Option<f32> {
    let lowest = mesh.bounds()?.0.y;
    let normals = mesh.triangle_normals();
    let mut layers = vec![(0.0_f64, 0.0_f64); (REACH / LAYER) as usize];
    for (t, normal) in normals.iter().enumerate() {
        let corners = mesh.corners(t);
        let height = corners.iter().map(|p| p.y - lowest).sum::<f32>() / 3.0;
        if let Some(layer) = layers.get_mut((height / LAYER) as usize).filter(|_| normal.y > LEVEL) {
            let [a, b, c] = corners.map(Point3::cast::<f64>);
            let area = 0.5 * (b - a).cross(&(c - a)).norm();
            *layer = (layer.0 + area, layer.1 + area * f64::from(height));
        }
    }
    // A ground between two layers lies in both.
    let pairs = layers.windows(2).map(|pair| (pair[0].0 + pair[1].0, pair[0].1 + pair[1].1));
    let (area, moment) = pairs.reduce(|a, b| if b.0 > a.0 { b } else { a })?;
    (area > GROUND).then(|| lowest + (moment / area) as f32)
}
