//! The whole surface of a person: contours, skin over them, head, hands and feet (paper 002 §3).

use nalgebra::Point3;
use toile_character::{BodyModel, Pose};
use toile_geometry::Mesh;

use crate::{
    ImplicitError,
    body::ImplicitBody,
    bones::Bones,
    contours::{Contours, sample},
    extremities::Extremities,
    field::Field,
    level::Level,
    plan::Plan,
    spline::{Patches, Through},
    stitch::stitch,
    surface::Surface,
};

/// The surface of one person at one level of detail, ready to be sampled in pose after pose.
#[derive(Debug, Clone)]
pub struct Envelope {
    /// The plan of contours.
    pub plan: Plan,
    /// Head, hands and feet.
    pub extremities: Extremities,
    /// Triangles of the closed surface: skin, head, hands, feet, and what joins them.
    pub triangles: Vec<[u32; 3]>,
    /// How the skin relates to the sampled points.
    pub through: Through,
    patches: Patches,
    /// How far beyond the point that its ray passes each point of a contour lies at rest; empty where there are no primitives yet.
    at_rest: Vec<f64>,
}

/// A sampled surface.
#[derive(Debug, Clone)]
pub struct Sampled {
    /// The closed mesh; its vertices are those of the skin, then those of head, hands and feet.
    pub mesh: Mesh,
    /// Points whose ray missed the primitives.
    pub missed: usize,
}

impl Envelope {
    /// Plans the surface of `body`.
    ///
    /// # Errors
    /// [`ImplicitError`] where the template lacks what the plan starts from, or joints do not stand as a person's do.
    pub fn new(model: &BodyModel, body: &ImplicitBody, level: Level) -> Result<Self, ImplicitError> {
        let extremities = Extremities::new(model, body)?;
        let plan = Plan::new(model, body, &extremities, level)?;
        let patches = Patches::new(plan.count, &plan.quads);
        let (through, at_rest) = (Through::default(), Vec::new());
        let mut envelope = Self { plan, extremities, triangles: Vec::new(), through, patches, at_rest };
        envelope.join(body);
        Ok(envelope)
    }

    /// Finds all triangles once, at rest on the expected shape.
    fn join(&mut self, body: &ImplicitBody) {
        let contours = self.contours(body, &Pose::identity(), &Field::new(body, &Pose::identity()));
        let positions = self.positions(&contours, &self.extremities.skin.mesh.positions);
        let first = self.patches.len() as u32;
        let mut triangles = self.patches.triangles.clone();
        triangles.extend(self.extremities.skin.mesh.triangles.iter().map(|t| t.map(|v| v + first)));
        for (end, rim) in self.plan.ends.iter().zip(&self.extremities.rims) {
            let skin = self.patches.rim(end, &self.plan.quads);
            let rim: Vec<u32> = rim.iter().map(|v| v + first).collect();
            let gap = stitch(&positions, &self.patches.triangles, &skin, &rim);
            triangles.extend(gap);
        }
        self.triangles = triangles;
        if !body.primitives.is_empty() {
            self.at_rest = contours.beyond();
        }
    }

    /// The contours of `body`'s skeleton in `pose` on any shape.
    pub fn contours(&self, body: &ImplicitBody, pose: &Pose, surface: &dyn Surface) -> Contours {
        let posed = self.extremities.posed(pose);
        let rims = std::array::from_fn(|k| self.extremities.rim(k, &posed));
        sample(&self.plan, &Bones::new(&body.skeleton, pose), &rims, &self.at_rest, surface)
    }

    /// The surface of `body` in `pose`, sampled from its primitives.
    pub fn sample(&self, body: &ImplicitBody, pose: &Pose) -> Sampled {
        self.sample_on(body, pose, &Field::new(body, pose))
    }

    /// The same on any shape.
    pub fn sample_on(&self, body: &ImplicitBody, pose: &Pose, surface: &dyn Surface) -> Sampled {
        let posed = self.extremities.posed(pose);
        let rims = std::array::from_fn(|k| self.extremities.rim(k, &posed));
        let contours = sample(&self.plan, &Bones::new(&body.skeleton, pose), &rims, &self.at_rest, surface);
        let mesh = Mesh::new(self.positions(&contours, &posed), self.triangles.clone());
        Sampled { mesh, missed: contours.missed }
    }

    /// Number of vertices of the skin, which come first.
    pub fn skin_count(&self) -> usize {
        self.patches.len()
    }

    fn positions(&self, contours: &Contours, extremities: &[Point3<f32>]) -> Vec<Point3<f32>> {
        let mut positions = self.patches.skin(&contours.points, self.through);
        positions.extend_from_slice(extremities);
        positions
    }
}
