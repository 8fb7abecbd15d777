//! Bodies in real time: contours deformed directly (paper 002 §4).
//!
//! Contours are sampled once, in an initial pose. In every other pose rays are configured as before, by joint angles and by rims, but
//! each point lies as far along its ray, or beyond the point that the ray passes, as it did then; no field is evaluated and no patch is built. Points of contours are the vertices,
//! triangles are an array of indices that never changes. Head, hands and feet are rigid.

use nalgebra::{Isometry3, Point3, Vector3};
use toile_character::{BodyModel, Joint, Pose};
use toile_geometry::{Mesh, decimate::decimate, topology::boundary_loops};

use crate::{
    ImplicitError,
    body::ImplicitBody,
    bones::Bones,
    boundary,
    contours::planes,
    envelope::Envelope,
    extremities::joint_of,
    field::Field,
    level::{LEVELS, Level},
    plan::{Plan, Rule},
    stitch::stitch,
};

/// A body that deforms in real time, at one level of detail.
#[derive(Debug, Clone)]
pub struct RealTime {
    plan: Plan,
    body: ImplicitBody,
    /// For each node, how far the point lies from the ray's origin on a ring, elsewhere beyond the point that the ray passes; and how long
    /// the ray was up to there; metres.
    beyond: Vec<[f64; 2]>,
    /// Cosine and sine of the angle of a ring's point.
    turns: Vec<[f64; 2]>,
    /// Points of head, hands and feet at rest, each with its extremity.
    rigid: Vec<RigidPoint>,
    /// The points of the plan's rims at rest.
    rims: Vec<(Point3<f64>, u8)>,
    triangles: Vec<[u32; 3]>,
}

/// A point at rest, and the extremity that it moves with.
type RigidPoint = (Point3<f32>, u8);

/// Points of one body, kept from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct Deformed {
    /// Vertices of the contours, then of head, hands and feet, metres.
    pub positions: Vec<Point3<f32>>,
    nodes: Vec<Point3<f64>>,
    origins: Vec<Point3<f64>>,
}

impl RealTime {
    /// The contours of `body` at `level`, sampled from its primitives in the pose `initial`.
    ///
    /// # Errors
    /// As [`Envelope::new`].
    pub fn new(model: &BodyModel, body: &ImplicitBody, initial: &Pose, level: Level) -> Result<Self, ImplicitError> {
        let envelope = Envelope::new(model, body, level)?;
        let contours = envelope.contours(body, initial, &Field::new(body, initial));
        let turn = |rule: &Rule| match rule {
            Rule::Ring { angle, .. } => [angle.cos(), angle.sin()],
            _ => [0.0; 2],
        };
        let turns = envelope.plan.nodes.iter().map(|n| turn(&n.rule)).collect();
        let (rigid, triangles) = surface(&envelope, &contours.points, level);
        let rest: Vec<Point3<f64>> = envelope.extremities.skin.mesh.positions.iter().map(|p| p.cast()).collect();
        let on_rim = |rule: &Rule| match rule {
            Rule::Rim { extremity, place } => {
                let rim: Vec<Point3<f64>> =
                    envelope.extremities.rims[*extremity as usize].iter().map(|&v| rest[v as usize]).collect();
                (boundary::at(&rim, *place), *extremity)
            }
            _ => (Point3::origin(), 0),
        };
        let rims = envelope.plan.nodes.iter().map(|n| on_rim(&n.rule)).collect();
        let (plan, body) = (envelope.plan, body.clone());
        let mut out = Self { beyond: vec![[0.0, 1.0]; plan.nodes.len()], plan, body, turns, rigid, rims, triangles };
        out.learn(initial, &contours.points);
        Ok(out)
    }

    /// Triangles over the vertices; the same in every pose.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.plan.count + self.rigid.len()
    }

    /// Moves the vertices of `out` into `pose`. O(vertices); nothing is allocated from the second frame on, but for a few hundred
    /// planes.
    pub fn deform(&self, pose: &Pose, out: &mut Deformed) {
        let frames = self.configure(pose, out, |n, passed, direction, length| {
            let [beyond, at_first] = self.beyond[n];
            // where a ray has nearly no length left, as in a closed armpit, its direction says nothing any more
            passed + direction * (beyond * (length / at_first).min(1.0))
        });
        out.positions.clear();
        out.positions.extend(out.nodes[..self.plan.count].iter().map(|p| p.cast::<f32>()));
        let rigid: [Isometry3<f32>; 5] = frames.map(Isometry3::<f64>::cast);
        out.positions.extend(self.rigid.iter().map(|(p, of)| rigid[*of as usize] * p));
    }

    /// The mesh in `pose`.
    pub fn mesh(&self, pose: &Pose) -> Mesh {
        let mut out = Deformed::default();
        self.deform(pose, &mut out);
        Mesh::new(out.positions, self.triangles.clone())
    }

    /// Reads off how far beyond what its ray passes each of the sampled `points` lies.
    fn learn(&mut self, initial: &Pose, points: &[Point3<f64>]) {
        let mut beyond = vec![[0.0, 1.0]; points.len()];
        let mut out = Deformed::default();
        self.configure(initial, &mut out, |n, passed, direction, length| {
            beyond[n] = [(points[n] - passed).dot(&direction), length.max(1e-6)];
            points[n]
        });
        self.beyond = beyond;
    }

    /// Configures the rays in `pose` in the order of their needs; `place` answers with the point on the ray of a node from
    /// what the ray passes (on a ring, its origin), its direction and its length up to there (on a ring, 1). Returns `posed_from_rest` of the extremities.
    fn configure(
        &self,
        pose: &Pose,
        out: &mut Deformed,
        mut place: impl FnMut(usize, Point3<f64>, Vector3<f64>, f64) -> Point3<f64>,
    ) -> [Isometry3<f64>; 5] {
        let bones = Bones::new(&self.body.skeleton, pose);
        let extremities = std::array::from_fn(|k| self.rigid_motion(&bones, joint_of(k)));
        let planes = planes(&self.plan, &bones);
        out.nodes.resize(self.plan.nodes.len(), Point3::origin());
        out.origins.resize(self.plan.nodes.len(), Point3::origin());
        for &n in self.plan.phases.iter().flatten() {
            let n = n as usize;
            let (origin, passed) = match &self.plan.nodes[n].rule {
                Rule::Rim { .. } => {
                    let (rest, of) = &self.rims[n];
                    (out.nodes[n], out.origins[n]) =
                        (extremities[*of as usize] * rest, extremities[*of as usize] * rest);
                    continue;
                }
                Rule::Ring { section, .. } => {
                    let (plane, x, y) = &planes[*section as usize];
                    let [cosine, sine] = self.turns[n];
                    out.origins[n] = plane.origin;
                    out.nodes[n] = place(n, plane.origin, x * cosine + y * sine, 1.0);
                    continue;
                }
                Rule::Between { start, goal, share, link } => {
                    let ends = (bones.at(link.0), bones.at(link.1));
                    let (start, goal) = (&out.nodes[*start as usize], &out.nodes[*goal as usize]);
                    boundary::ray(start, goal, *share, ends)
                }
                Rule::Span(weights) => {
                    let sum = |of: &[Point3<f64>]| {
                        Point3::from(weights.iter().map(|(n, w)| of[*n as usize].coords * *w).sum::<Vector3<f64>>())
                    };
                    (sum(&out.origins), sum(&out.nodes))
                }
            };
            out.origins[n] = origin;
            let (way, length) = (passed - origin, (passed - origin).norm());
            let direction = if length > 1e-6 { way / length } else { Vector3::zeros() };
            out.nodes[n] = place(n, passed, direction, length);
        }
        extremities
    }

    fn rigid_motion(&self, bones: &Bones, joint: Joint) -> Isometry3<f64> {
        bones.frame(joint) * nalgebra::Translation3::from(-self.body.skeleton.position(joint).coords)
    }
}

/// Head, hands and feet, coarser at coarser levels, and all triangles: contours, extremities and what joins them.
fn surface(envelope: &Envelope, nodes: &[Point3<f64>], level: Level) -> (Vec<RigidPoint>, Vec<[u32; 3]>) {
    let count = envelope.plan.count;
    let share = (level.half_trunk as f64 / LEVELS[0].half_trunk as f64).powi(2);
    let mut positions: Vec<Point3<f32>> = nodes[..count].iter().map(|p| p.cast()).collect();
    let quads = &envelope.plan.quads;
    let mut triangles: Vec<[u32; 3]> = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
    let skin = triangles.clone();
    let mut rigid = Vec::new();
    for (of, end) in envelope.plan.ends.iter().enumerate() {
        let part = part(envelope, of, share);
        let first = positions.len() as u32;
        rigid.extend(part.positions.iter().map(|p| (*p, of as u8)));
        positions.extend_from_slice(&part.positions);
        triangles.extend(part.triangles.iter().map(|t| t.map(|v| v + first)));
        let rim = boundary_loops(&part.triangles).into_iter().max_by_key(Vec::len).unwrap_or_default();
        let rim: Vec<u32> = rim.iter().map(|v| v + first).collect();
        triangles.extend(stitch(&positions, &skin, end, &rim));
    }
    (rigid, triangles)
}

/// An extremity at rest with `share` of its triangles.
fn part(envelope: &Envelope, of: usize, share: f64) -> Mesh {
    let mesh = &envelope.extremities.skin.mesh;
    let parts = &envelope.extremities.parts;
    let (part, _) = mesh.filter_triangles(|t| usize::from(parts[mesh.triangles[t][0] as usize]) == of);
    let wanted = (part.triangles.len() as f64 * share) as usize;
    if share < 1.0 { decimate(&part, wanted) } else { part }
}

#[cfg(test)]
mod tests {
    use toile_geometry::topology::Edges;

    use super::*;
    use crate::fit::{FitSettings, fit};

    #[test]
    fn contours_are_where_they_were_sampled_and_follow_the_joints() {
        let model = BodyModel::load_default().unwrap();
        let person = model.skinned(&[0.4]);
        let settings = FitSettings { most: 90, ..FitSettings::default() };
        let body = fit(&model, &person, &[0.4], "person", &[], &settings).unwrap().body;
        let rest = Pose::identity();
        for level in LEVELS {
            let envelope = Envelope::new(&model, &body, level).unwrap();
            let sampled = envelope.contours(&body, &rest, &Field::new(&body, &rest)).points;
            let fast = RealTime::new(&model, &body, &rest, level).unwrap();
            assert!(Edges::new(fast.triangles()).is_closed(), "level {}", level.half_trunk);
            let mesh = fast.mesh(&rest);
            let off = |n: usize| (mesh.positions[n].cast::<f64>() - sampled[n]).norm();
            let worst = (0..envelope.plan.count).map(off).fold(0.0, f64::max);
            assert!(worst < 1e-4, "level {}: {worst} m off", level.half_trunk);
            assert!(mesh.signed_volume() > 0.04, "{}", mesh.signed_volume());
            // moved as a whole, nothing else changes
            let mut moved = rest.clone();
            moved.translation.x = 1.0;
            let there = fast.mesh(&moved);
            let shift = mesh.positions.iter().zip(&there.positions).map(|(a, b)| (b.x - a.x - 1.0).abs());
            assert!(shift.fold(0.0, f32::max) < 1e-4);
        }
    }

    /// A limb is a tube about its link: when the elbow bends, a forearm's contour stays as wide as it was.
    #[test]
    fn a_bent_elbow_keeps_the_contours_of_the_forearm() {
        let model = BodyModel::load_default().unwrap();
        let person = model.skinned(&[]);
        let settings = FitSettings { most: 90, ..FitSettings::default() };
        let body = fit(&model, &person, &[], "person", &[], &settings).unwrap().body;
        let fast = RealTime::new(&model, &body, &Pose::identity(), LEVELS[3]).unwrap();
        let mut bent = Pose::identity();
        let arm = person.skeleton.position(Joint::LeftHand) - person.skeleton.position(Joint::LeftLowerArm);
        let axis = arm.cross(&Vector3::z()).normalize();
        *bent.rotation_mut(Joint::LeftLowerArm) = nalgebra::UnitQuaternion::from_scaled_axis(axis * 1.5);
        let (straight, bent) = (fast.mesh(&Pose::identity()), fast.mesh(&bent));
        let middle = fast.plan.sections.iter().position(|s| {
            s.share > 0.4
                && s.share < 0.7
                && s.chain.0.get(s.link) == Some(&crate::bones::Place::Joint(Joint::LeftLowerArm))
        });
        let ring: Vec<usize> = (0..fast.plan.count)
            .filter(
                |&n| matches!(fast.plan.nodes[n].rule, Rule::Ring { section, .. } if Some(section as usize) == middle),
            )
            .collect();
        assert!(ring.len() > 6);
        let girth = |mesh: &Mesh| -> f32 {
            let next = ring.iter().cycle().skip(1);
            ring.iter().zip(next).map(|(&a, &b)| (mesh.positions[a] - mesh.positions[b]).norm()).sum()
        };
        assert!((girth(&bent) / girth(&straight) - 1.0).abs() < 0.03, "{} {}", girth(&bent), girth(&straight));
        let hand = bent.positions[fast.plan.count..].iter().zip(&straight.positions[fast.plan.count..]);
        assert!(hand.map(|(a, b)| (a - b).norm()).fold(0.0, f32::max) > 0.2, "the hand moves");
    }
}
