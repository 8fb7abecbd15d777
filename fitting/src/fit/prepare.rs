//! Prepares a scan: checks it, brings it to metres, turns its triangles outward, lists the ways it may stand.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use serde::Serialize;
use toile_geometry::Mesh;

use crate::FittingError;

/// Range of the longest side of a scan of a person or a part of one, metres.
const PERSON: std::ops::Range<f64> = 0.25..2.6;
/// A vertex further than this from the middle of the others, metres, is no part of a room with a person in it.
const FARTHEST: f64 = 50.0;
/// Volume over area to the power of 1.5 of the thinnest scan whose triangles are known to face one way; a person's is ten
/// times as large.
const SOLID: f64 = 0.003;
/// A side of at least this share of the longest one may be the person's height: arms can span as much.
const UPRIGHT: f64 = 0.7;

/// How the scan was brought to metres and +Y up: `fitted_from_input(p) = rotation * (scale * p)`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Mend {
    /// Metres in one unit of the input.
    pub scale: f64,
    /// Turns the input upright.
    pub rotation: UnitQuaternion<f64>,
}

impl Default for Mend {
    fn default() -> Self {
        Self { scale: 1.0, rotation: UnitQuaternion::identity() }
    }
}

impl Mend {
    /// True where the input needed no change.
    pub fn is_identity(&self) -> bool {
        *self == Self::default()
    }

    /// The mesh in metres, +Y up.
    pub fn apply(&self, mesh: &Mesh) -> Mesh {
        if self.is_identity() {
            return mesh.clone();
        }
        let rotation = self.rotation.cast::<f32>();
        let mut out = mesh.clone();
        out.positions.iter_mut().for_each(|p| *p = rotation * (*p * self.scale as f32));
        out.normals.iter_mut().for_each(|n| *n = rotation * *n);
        out
    }
}

/// A scan that a fit can work on.
pub(crate) struct Prepared {
    /// Metres, outward; the up axis is still open.
    pub mesh: Mesh,
    /// Metres in one unit of the input.
    pub scale: f64,
    /// Rotations that may bring it upright, the likeliest first.
    pub ups: Vec<UnitQuaternion<f64>>,
    /// The repairs, in words.
    pub notices: Vec<String>,
}

/// Checks the scan, finds its unit and the ways it may stand.
///
/// # Errors
/// [`FittingError::Scan`] where it is empty, broken, or not of human size in metres, centimetres or millimetres.
pub(crate) fn prepare(scan: &Mesh) -> Result<Prepared, FittingError> {
    scan.validate().map_err(|e| FittingError::Scan(e.to_string()))?;
    if scan.is_empty() {
        return Err(FittingError::Scan("it has no triangles: scan the subject again".into()));
    }
    let (lo, hi) = trimmed_bounds(&scan.positions);
    let extent = (hi - lo).cast::<f64>();
    let scale = unit(extent.max())?;
    check_far(&scan.positions, nalgebra::center(&lo, &hi), scale)?;
    let mut notices = Vec::new();
    if scale != 1.0 {
        let unit = if scale == 0.001 { "millimetres" } else { "centimetres" };
        notices.push(format!(
            "the scan is in {unit} (its longest side is {:.0}): it was converted to metres",
            extent.max()
        ));
    }
    let mut mesh = Mend { scale, ..Mend::default() }.apply(scan);
    if faces_inward(&mesh) {
        mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        notices.push("the scan's triangles faced inward: they were turned outward".into());
    }
    mesh.recompute_normals();
    Ok(Prepared { mesh, scale, ups: ups(&extent), notices })
}

/// Whether triangles face inward, holes or not: by the volume that they enclose with the middle of the scan.
fn faces_inward(mesh: &Mesh) -> bool {
    let sum: Vector3<f64> = mesh.positions.iter().map(|p| p.coords.cast::<f64>()).sum();
    let middle = Point3::from(sum / mesh.positions.len().max(1) as f64);
    let enclosed = |t: usize| {
        let [a, b, c] = mesh.corners(t).map(|p| p.cast::<f64>() - middle);
        a.dot(&b.cross(&c)) / 6.0
    };
    let volume: f64 = (0..mesh.triangles.len()).map(enclosed).sum();
    volume < -SOLID * mesh.area().powf(1.5)
}

/// Refuses a vertex that lies further away than any room is wide: distances to it would swamp all others.
fn check_far(points: &[Point3<f32>], middle: Point3<f32>, scale: f64) -> Result<(), FittingError> {
    let distance = |p: &Point3<f32>| (p.cast::<f64>() - middle.cast::<f64>()).norm() * scale;
    let Some((vertex, point)) = points.iter().enumerate().find(|(_, p)| distance(p) > FARTHEST) else { return Ok(()) };
    Err(FittingError::Scan(format!(
        "vertex {vertex} (counted from 0) lies {:.3e} m from the person: remove what does not belong to the scan",
        distance(point)
    )))
}

fn unit(longest: f64) -> Result<f64, FittingError> {
    [1.0, 0.001, 0.01].into_iter().find(|s| PERSON.contains(&(longest * s))).ok_or_else(|| {
        FittingError::Scan(format!(
            "its longest side is {longest:.3}, which is not the size of a person in metres, centimetres or millimetres: give a scan of one person in metres"
        ))
    })
}

/// Bounds without the outermost half per cent of the vertices at each end, which may be stray points.
fn trimmed_bounds(points: &[Point3<f32>]) -> (Point3<f32>, Point3<f32>) {
    let (mut lo, mut hi) = (Point3::origin(), Point3::origin());
    for axis in 0..3 {
        let mut values: Vec<f32> = points.iter().map(|p| p[axis]).collect();
        let cut = (values.len() - 1) / 200;
        let last = values.len() - 1 - cut;
        lo[axis] = *values.select_nth_unstable_by(cut, f32::total_cmp).1;
        hi[axis] = *values.select_nth_unstable_by(last, f32::total_cmp).1;
    }
    (lo, hi)
}

/// Rotations that stand a long side upright, either way round; +Y up comes first where it is possible.
fn ups(extent: &Vector3<f64>) -> Vec<UnitQuaternion<f64>> {
    let longest = extent.max();
    let mut axes: Vec<usize> = [1, 2, 0].into_iter().filter(|&a| extent[a] >= UPRIGHT * longest).collect();
    axes.sort_by(|&a, &b| (b == 1).cmp(&(a == 1)).then(extent[b].total_cmp(&extent[a])));
    axes.iter().flat_map(|&axis| [1.0, -1.0].map(|sign| upright(axis, sign))).collect()
}

/// The rotation that takes `sign` times `axis` to +Y.
fn upright(axis: usize, sign: f64) -> UnitQuaternion<f64> {
    use std::f64::consts::{FRAC_PI_2, PI};
    let stand = match axis {
        0 => UnitQuaternion::from_axis_angle(&Vector3::z_axis(), FRAC_PI_2),
        1 => UnitQuaternion::identity(),
        _ => UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -FRAC_PI_2),
    };
    if sign > 0.0 { stand } else { UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI) * stand }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn upright_takes_each_axis_to_plus_y() {
        for axis in 0..3 {
            for sign in [1.0, -1.0] {
                let up = upright(axis, sign) * (Vector3::ith(axis, 1.0) * sign);
                assert!((up - Vector3::y()).norm() < 1e-12, "{axis} {sign} {up}");
            }
        }
    }

    #[test]
    fn units_are_recognised_and_nonsense_is_refused() {
        assert_eq!(unit(1.8).unwrap(), 1.0);
        assert_eq!(unit(1800.0).unwrap(), 0.001);
        assert_eq!(unit(180.0).unwrap(), 0.01);
        assert!(unit(0.02).is_err() && unit(0.0).is_err() && unit(9000.0).is_err() && unit(f64::NAN).is_err());
    }

    #[test]
    fn a_vertex_far_away_is_named_and_one_across_the_room_is_not() {
        let mut points: Vec<Point3<f32>> = (0..1000).map(|i| Point3::new(0.0, 0.0018 * i as f32, 0.0)).collect();
        points.push(Point3::new(0.2, 0.0, 0.3));
        let mut mesh = Mesh::new(points, vec![[0, 500, 1000]]);
        for (far, is_refused) in [(3.0, false), (1e12, true), (f32::MAX, true)] {
            mesh.positions[7].x = far;
            let told = prepare(&mesh).err().map(|e| e.to_string());
            assert_eq!(told.as_ref().is_some_and(|t| t.contains("vertex 7 ")), is_refused, "{far}: {told:?}");
        }
    }

    #[test]
    fn triangles_that_face_inward_are_turned_outward_holes_or_not() {
        let model = toile_character::BodyModel::load_default().unwrap();
        let outward = Mesh::new(model.mean.clone(), model.triangles.clone());
        let holed = outward.filter_triangles(|t| t % 20 != 0).0;
        for mesh in [outward, holed] {
            let mut inward = mesh.clone();
            inward.triangles.iter_mut().for_each(|t| t.swap(1, 2));
            let [turned, kept] = [&inward, &mesh].map(|m| prepare(m).unwrap());
            assert!(turned.mesh.triangles == mesh.triangles && turned.notices.len() == 1);
            assert!(kept.mesh.triangles == mesh.triangles && kept.notices.is_empty());
        }
    }

    #[test]
    fn empty_and_broken_scans_are_refused() {
        assert!(prepare(&Mesh::default()).is_err());
        let mut mesh = Mesh::new(vec![Point3::origin(); 3], vec![[0, 1, 2]]);
        assert!(prepare(&mesh).is_err());
        mesh.positions[1].x = f32::NAN;
        assert!(prepare(&mesh).is_err());
    }
}
