//! The resolutions that a fit goes through, coarse to fine: sampling, gates and effort.
//!
//! A resolution's cells are about a third of the error that the one before leaves, so that neighbouring samples still
//! constrain each other; its gate reaches as far as a limb may still be off, its kernel is a quarter of that, and its
//! noise is the misfit that the model keeps at so few components and samples.

use toile_character::{BodyModel, Joint};
use toile_geometry::Mesh;

use super::{
    guides::{Guide, Guides},
    problem::BodyProblem,
};
use crate::{
    FitSettings, FittingError,
    solve::{Articulated, Cloth, Columns, Gate, JointPrior, body_joints, main_joints},
    surface::{Cloud, Samples, Thinned},
};

/// Clothes are alike over a span of some 30 cm, of which a person has 20.
const CLOTH: Cloth = Cloth { stand_off, independent: 20.0 };

/// How far clothes stand off, metres, by the ease that tailors give: some 10 cm around the chest, 6 around hips and thighs,
/// 5 around knees and calves; 5 around sleeves that end half-way to the elbow or go on. Lower arms and necks are mostly bare, heads,
/// hands and feet nearly always.
fn stand_off(joint: Joint) -> f32 {
    use Joint::*;
    match joint {
        Spine | Chest | UpperChest => 0.016,
        Hips | LeftUpperLeg | RightUpperLeg => 0.010,
        LeftLowerLeg | RightLowerLeg => 0.008,
        LeftShoulder | RightShoulder | LeftUpperArm | RightUpperArm => 0.004,
        LeftLowerArm | RightLowerArm | Neck => 0.002,
        _ => 0.0,
    }
}

/// Scan samples that are looked up on the body are this much sparser than those that the body is looked up on: the
/// other direction has enough of them.
const REVERSE: f32 = 2.5;

/// The squared Newton decrement of a fit at rest. The expected decrement of a state that is off by its own standard deviation is
/// the number of unknowns, 119: at 0.1 the step is 3 % of a standard deviation, whatever directions nothing measures.
const AT_REST: f64 = 0.1;

/// Which joints a resolution turns.
#[derive(Debug, Clone, Copy)]
enum Turns {
    /// Trunk, upper and lower limbs.
    Main,
    /// All but the fingers.
    Body,
}

/// Sampling, gates and effort of one resolution.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Resolution {
    /// Cell of the scan's samples, metres.
    scan_cell: f32,
    /// Cell of the scan's samples that are looked up on the body, metres.
    reverse_cell: f32,
    /// Cell of the body's vertices, metres.
    body_cell: f32,
    /// Maximum number of shape components.
    components: usize,
    turns: Turns,
    /// Maximum number of Gauss–Newton steps.
    pub iterations: usize,
    /// The squared Newton decrement at which it has come to rest.
    rest: f64,
    gate: Gate,
}

/// Whole limbs are still astray: arms may start 25 cm off, and four components say tall or short, slim or stout.
const COARSE: Resolution = Resolution {
    scan_cell: 0.03,
    reverse_cell: 0.045,
    body_cell: 0.05,
    components: 4,
    turns: Turns::Main,
    iterations: 10,
    rest: 0.0,
    gate: Gate { distance: 0.25, slip: 0.12, min_cos: 0.3, kernel: 0.06, noise: 0.02, cloth: None },
};

/// Fine enough that front and back differ clearly: feet, face and seat are 5 to 10 cm deep.
const HEADING: Resolution = Resolution {
    scan_cell: 0.014,
    reverse_cell: REVERSE * 0.014,
    body_cell: 0.028,
    components: 12,
    turns: Turns::Body,
    iterations: 10,
    rest: 0.0,
    gate: Gate { distance: 0.1, slip: 0.04, min_cos: 0.5, kernel: 0.025, noise: 0.006, cloth: None },
};

/// The right heading, all components: what is left is within a hand's thickness.
const MIDDLE: Resolution = Resolution {
    scan_cell: 0.009,
    reverse_cell: REVERSE * 0.009,
    body_cell: 0.024,
    components: usize::MAX,
    turns: Turns::Body,
    iterations: 8,
    rest: 0.0,
    gate: Gate { distance: 0.05, slip: 0.015, min_cos: 0.6, kernel: 0.010, noise: 0.003, cloth: None },
};

/// The error left is a finger's thickness; noise and iterations come from the settings.
const FINE: Resolution = Resolution {
    scan_cell: 0.006,
    reverse_cell: REVERSE * 0.006,
    body_cell: 0.010,
    components: usize::MAX,
    turns: Turns::Body,
    iterations: 24,
    rest: AT_REST,
    gate: Gate { distance: 0.025, slip: 0.01, min_cos: 0.6, kernel: 0.006, noise: 0.002, cloth: None },
};

/// The four resolutions under the settings of one fit.
pub(crate) struct Resolutions {
    pub coarse: Resolution,
    pub heading: Resolution,
    pub middle: Resolution,
    pub fine: Resolution,
}

impl Resolutions {
    pub fn new(settings: &FitSettings) -> Self {
        let noise = settings.noise as f32;
        let fine = Resolution { iterations: settings.fine_iterations, gate: Gate { noise, ..FINE.gate }, ..FINE };
        let [coarse, heading, middle, fine] = [COARSE, HEADING, MIDDLE, fine].map(|r| r.under(settings));
        Self { coarse, heading, middle, fine }
    }
}

impl Resolution {
    /// The same with all components that the settings allow.
    pub fn with_components(self, components: usize) -> Self {
        Self { components, ..self }
    }

    fn under(self, settings: &FitSettings) -> Self {
        let cloth = settings.dressed.then_some(CLOTH);
        let components = self.components.min(settings.components);
        Self { components, gate: Gate { cloth, ..self.gate }, ..self }
    }
}

/// Body and scan as one resolution sees them.
pub(crate) struct Sampled {
    pub resolution: Resolution,
    pub body: Articulated,
    /// The template's vertices that `body` has.
    pub vertices: Vec<u32>,
    pub scan: Cloud,
    pub reverse: Samples,
    pub components: usize,
    pub guide: Option<Guide>,
}

impl Sampled {
    /// Samples the model and a scan whose normals are set; `trust` has one entry for each of its vertices.
    ///
    /// # Errors
    /// [`FittingError::Scan`] where no triangle of the scan has an area.
    pub fn new(
        model: &BodyModel,
        scan: &Mesh,
        trust: &[f32],
        guides: &Guides,
        resolution: Resolution,
    ) -> Result<Self, FittingError> {
        Self::of_part(model, (scan, trust), guides, resolution, &|_| true)
    }

    /// The same with those vertices of the model only whose main joint `takes` accepts.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn of_part(
        model: &BodyModel,
        (scan, trust): (&Mesh, &[f32]),
        guides: &Guides,
        resolution: Resolution,
        takes: &dyn Fn(Joint) -> bool,
    ) -> Result<Self, FittingError> {
        let none = || FittingError::Scan("its triangles have no area: scan the subject again".into());
        let cloud = Cloud::new(Samples::of_mesh(scan, &scan.normals, trust, resolution.scan_cell)).ok_or_else(none)?;
        let reverse = Samples::of_mesh(scan, &scan.normals, trust, resolution.reverse_cell);
        let mesh = Mesh::new(model.mean.clone(), model.triangles.clone());
        let picked = Thinned::new(&mesh, &mesh.vertex_normals(), resolution.body_cell, |v| {
            !model.inner[v] && Joint::from_index(usize::from(model.weights.joints[v][0])).is_some_and(takes)
        });
        let components = resolution.components.min(model.components.len());
        let body = Articulated::of_model(model, &picked, components);
        let guide = guides.on(model, components);
        let vertices = picked.vertices;
        Ok(Self { resolution, body, vertices, scan: cloud, reverse, components, guide })
    }

    /// The problem of this resolution.
    pub fn problem<'a>(&'a self, prior: &'a JointPrior, shape_sigma: f64) -> BodyProblem<'a> {
        let joints = match self.resolution.turns {
            Turns::Main => main_joints(),
            Turns::Body => body_joints(),
        };
        BodyProblem {
            body: &self.body,
            scan: &self.scan,
            reverse: &self.reverse,
            gate: self.resolution.gate,
            columns: Columns::new(joints, self.components),
            prior,
            guide: self.guide.as_ref(),
            shape_sigma,
            is_rooted: false,
            rest: self.resolution.rest,
        }
    }
}
