//! The body standing straight, with the landmarks that measurements start from.

use nalgebra::{Point3, center};
use toile_character::{BodyModel, Joint, SkinnedMesh};
use toile_geometry::Mesh;

use crate::{
    FittingError,
    measure::{
        extremes::height_range,
        parts::{Parts, Side},
        section::Skin,
    },
    stance::{stance, standing},
};

/// Height below which a mesh is not measured, metres.
const LOWEST_BODY: f64 = 0.3;

/// A point on an edge of the template: its two vertices and how far it lies from the first to the second, 0..1.
type EdgePoint = (u32, u32, f32);

/// Landmarks on bones that the template does not name, left and right. Each is the edge of the template that comes
/// nearest to where ANSUR II (4,082 men, 1,986 women) has it on average, on the mean man and the mean woman: heights as
/// shares of the way from the crotch to the suprasternal notch.
///
/// Lowest rib, 45° from the front: shares 0.463 and 0.500 (tenth rib height); here +4 and −5 mm.
const LOWEST_RIB: [EdgePoint; 2] = [(10_742, 10_800, 0.5), (4_091, 4_159, 0.5)];
/// Highest point of the hip bone, at the side: 0.364 and 0.390 (iliocristale height); here −5 and +5 mm.
const HIP_BONE: [EdgePoint; 2] = [(10_772, 10_808, 0.3), (4_129, 4_167, 0.3)];
/// Shoulder point, on the ridge of the shoulder: half of the biacromial breadth, 208 and 183 mm from the middle; here within 1 mm.
const SHOULDER: [EdgePoint; 2] = [(8_275, 8_275, 0.0), (1_603, 1_603, 0.0)];
/// Middle of the kneecap: 488 and 449 mm above the floor; here +5 and −11 mm.
const KNEECAP: [EdgePoint; 2] = [(11_268, 11_270, 0.7), (4_650, 4_652, 0.7)];

/// A landmark in the middle of the body or on both sides.
#[derive(Debug, Clone)]
pub(crate) struct Landmarks {
    pub top_of_head: Point3<f64>,
    pub chin: Point3<f64>,
    pub forehead: Point3<f64>,
    pub back_of_head: Point3<f64>,
    pub back_neck: Point3<f64>,
    pub front_neck: Point3<f64>,
    pub navel: Point3<f64>,
    pub crotch: Point3<f64>,
    pub sides: [SideLandmarks; 2],
}

/// The landmarks of one side.
#[derive(Debug, Clone)]
pub(crate) struct SideLandmarks {
    pub shoulder: Point3<f64>,
    pub armpit: Point3<f64>,
    pub nipple: Point3<f64>,
    pub lowest_rib: Point3<f64>,
    pub hip_bone: Point3<f64>,
    pub elbow: Point3<f64>,
    pub wrist: Point3<f64>,
    pub finger_tip: Point3<f64>,
    pub trochanter: Point3<f64>,
    pub buttock: Point3<f64>,
    pub kneecap: Point3<f64>,
    pub ankle: Point3<f64>,
    pub heel: Point3<f64>,
    pub toe_tip: Point3<f64>,
}

/// A body that stands straight on y = 0, +Z the front, arms in the A-pose.
#[derive(Debug)]
pub(crate) struct Standing {
    /// Its surface on the template's topology.
    pub mesh: Mesh,
    /// Its landmarks, metres.
    pub landmarks: Landmarks,
    /// Heights of its joints and where they are, by [`Joint::index`].
    joints: Vec<Point3<f64>>,
    parts: Parts,
}

impl Standing {
    /// Stands a body (its own shape at rest, template topology of `model`) straight and finds its landmarks.
    ///
    /// # Errors
    /// [`FittingError::Mesh`] where the body is not of the model's topology, is too small to be a body, or the model lacks
    /// a landmark.
    pub fn new(model: &BodyModel, body: &SkinnedMesh) -> Result<Self, FittingError> {
        let (have, want) = (body.mesh.positions.len(), model.vertex_count());
        if have != want {
            return Err(FittingError::Mesh(format!("it has {have} vertices, but the template has {want}")));
        }
        let mut mesh = standing(body);
        let (low, high) = height_range(&mesh, &model.inner);
        if high - low < LOWEST_BODY {
            let height = (high - low).max(0.0);
            return Err(FittingError::Mesh(format!("it is {height:.2} m high, too small to be measured as a body")));
        }
        mesh.positions.iter_mut().for_each(|p| p.y -= low as f32);
        mesh.recompute_normals();
        let mut joints = stance(&body.skeleton).joint_positions(&body.skeleton);
        joints.iter_mut().for_each(|j| j.y -= low);
        let landmarks = Landmarks::on(model, &mesh)?;
        Ok(Self { mesh, landmarks, joints: joints.clone(), parts: Parts::new(model) })
    }

    /// All of it.
    pub fn whole(&self) -> Skin<'_> {
        self.skin(&self.mesh.triangles)
    }

    /// Trunk and legs without arms.
    pub fn trunk(&self) -> Skin<'_> {
        self.skin(&self.parts.trunk)
    }

    /// Head, neck and trunk without limbs.
    pub fn head_and_neck(&self) -> Skin<'_> {
        self.skin(&self.parts.head_and_neck)
    }

    /// One arm with its hand.
    pub fn arm(&self, side: Side) -> Skin<'_> {
        self.skin(self.parts.arm(side))
    }

    /// One leg with its foot and its half of the trunk.
    pub fn leg(&self, side: Side) -> Skin<'_> {
        self.skin(self.parts.leg(side))
    }

    /// The landmarks of one side.
    pub fn side(&self, side: Side) -> &SideLandmarks {
        &self.landmarks.sides[side as usize]
    }

    /// Where a joint is.
    pub fn joint(&self, joint: Joint) -> Point3<f64> {
        self.joints[joint.index()]
    }

    fn skin<'a>(&'a self, triangles: &'a [[u32; 3]]) -> Skin<'a> {
        Skin { positions: &self.mesh.positions, triangles }
    }
}

impl Landmarks {
    fn on(model: &BodyModel, mesh: &Mesh) -> Result<Self, FittingError> {
        let named = |name: &str| match model.landmark(name) {
            Some(v) => Ok(mesh.positions[v as usize].cast::<f64>()),
            None => Err(FittingError::Mesh(format!("its template has no landmark `{name}`, which measuring needs"))),
        };
        let [left, right] = Side::BOTH.map(|side| SideLandmarks::on(&named, mesh, side));
        Ok(Self {
            top_of_head: named("vertex")?,
            chin: named("chin")?,
            forehead: named("glabella")?,
            back_of_head: named("occiput")?,
            back_neck: named("cervicale")?,
            front_neck: named("suprasternale")?,
            navel: named("navel")?,
            crotch: named("crotch")?,
            sides: [left?, right?],
        })
    }

    /// The standard's term and the place of every landmark.
    pub fn terms(&self) -> Vec<(String, Point3<f64>)> {
        let mut terms: Vec<(String, Point3<f64>)> = [
            ("top of the head", self.top_of_head),
            ("chin point", self.chin),
            ("forehead point", self.forehead),
            ("back of the head", self.back_of_head),
            ("back neck point", self.back_neck),
            ("front neck point", self.front_neck),
            ("navel", self.navel),
            ("crotch point", self.crotch),
        ]
        .map(|(term, p)| (term.to_string(), p))
        .into();
        for (side, marks) in Side::BOTH.into_iter().zip(&self.sides) {
            terms.extend(marks.terms().map(|(term, p)| (format!("{} {term}", side.word()), p)));
        }
        terms
    }
}

impl SideLandmarks {
    fn on(
        named: &impl Fn(&str) -> Result<Point3<f64>, FittingError>,
        mesh: &Mesh,
        side: Side,
    ) -> Result<Self, FittingError> {
        let at = |name: &str| named(&format!("{}{name}", side.word()));
        let on_edge = |points: &[EdgePoint; 2]| edge_point(mesh, points[side as usize]);
        Ok(Self {
            shoulder: on_edge(&SHOULDER),
            armpit: at("Axilla")?,
            nipple: at("Nipple")?,
            lowest_rib: on_edge(&LOWEST_RIB),
            hip_bone: on_edge(&HIP_BONE),
            elbow: at("Elbow")?,
            wrist: at("WristOuter")?,
            finger_tip: at("MiddleFingerTip")?,
            trochanter: at("Trochanter")?,
            buttock: at("Buttock")?,
            kneecap: on_edge(&KNEECAP),
            ankle: at("AnkleOuter")?,
            heel: at("Heel")?,
            toe_tip: at("ToeTip")?,
        })
    }

    fn terms(&self) -> [(&'static str, Point3<f64>); 13] {
        [
            ("shoulder point", self.shoulder),
            ("armpit point", self.armpit),
            ("nipple", self.nipple),
            ("lowest rib point", self.lowest_rib),
            ("highest point of the hip bone", self.hip_bone),
            ("elbow point", self.elbow),
            ("wrist point", self.wrist),
            ("tip of the middle finger", self.finger_tip),
            ("trochanter point", self.trochanter),
            ("knee point", self.kneecap),
            ("ankle point", self.ankle),
            ("heel point", self.heel),
            ("foot point", self.toe_tip),
        ]
    }

    /// The waist at this side: midway between the lowest rib and the highest point of the hip bone.
    pub fn waist(&self) -> Point3<f64> {
        center(&self.lowest_rib, &self.hip_bone)
    }
}

/// A template edge's point; the origin where the mesh is not of the template.
fn edge_point(mesh: &Mesh, (a, b, t): EdgePoint) -> Point3<f64> {
    let at = |v: u32| mesh.positions.get(v as usize).copied().unwrap_or_default();
    (at(a) + (at(b) - at(a)) * t).cast()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean heights (metres) of ANSUR II: men, women.
    const CROTCH: [f64; 2] = [0.8459, 0.7823];
    const SUPRASTERNAL: [f64; 2] = [1.4386, 1.3297];
    const TENTH_RIB: [f64; 2] = [1.1207, 1.0563];
    const ILIOCRISTALE: [f64; 2] = [1.0616, 0.9957];

    /// The waist of the mean man and the mean woman lies where ANSUR II has it, within the spread of the sexes.
    #[test]
    fn ribs_and_hip_bones_are_where_people_have_them() {
        let model = BodyModel::load_default().unwrap();
        for (sex, beta) in [&model.population.beta_male, &model.population.beta_female].into_iter().enumerate() {
            let beta: Vec<f64> = beta.iter().map(|&b| f64::from(b)).collect();
            let body = Standing::new(&model, &model.skinned(&beta)).unwrap();
            let marks = &body.landmarks;
            let trunk = marks.front_neck.y - marks.crotch.y;
            for side in Side::BOTH {
                let share = |y: f64| (y - marks.crotch.y) / trunk;
                let wanted = |y: f64| (y - CROTCH[sex]) / (SUPRASTERNAL[sex] - CROTCH[sex]);
                let s = body.side(side);
                for (name, have, want) in
                    [("rib", s.lowest_rib.y, TENTH_RIB[sex]), ("hip bone", s.hip_bone.y, ILIOCRISTALE[sex])]
                {
                    let off = trunk * (share(have) - wanted(want));
                    assert!(off.abs() < 0.010, "{name}, sex {sex}: {off} m off");
                }
            }
        }
    }
}
