//! The measurements of a body as a tailor takes them, by the terms and landmarks of ISO 8559-1.
//!
//! The body stands straight ([`crate::stance`]), arms in the A-pose. Girths are taut (convex) tapes around one part of
//! a plane section; surface lengths are taut tapes in a plane; heights are above the soles.

use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};
use toile_character::{BodyModel, Joint, SkinnedMesh};
use toile_geometry::Mesh;

use crate::{
    FittingError, Measurements,
    measure::height_range,
    section::{Plane, Tape, girth_near, largest_girth, taut},
    stance::{stance, standing},
};

/// How a measurement is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MeasureKind {
    /// Vertical, above the soles.
    Height,
    /// A taut tape around.
    Girth,
    /// A taut tape over the surface of the trunk and the leg; along an arm straight from point to point.
    Length,
    /// Straight, between two points.
    Breadth,
}

/// One measurement.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BodyMeasure {
    /// Such as `waist girth` or `left upper arm length`.
    pub name: String,
    /// How it is taken.
    pub kind: MeasureKind,
    /// Metres.
    pub value_m: f64,
    /// Where the tape lies on the standing body: corners in metres.
    pub path: Vec<[f64; 3]>,
}

/// A landmark on the standing body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BodyLandmark {
    /// The standard's term, such as `back neck point`.
    pub name: String,
    /// Metres, in the standing body's frame: +Y up, soles at 0, +Z the front.
    pub position: [f64; 3],
}

/// All measurements of one body: the content of `measurements.json`.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct MeasureTable {
    /// What the terms follow.
    pub standard: String,
    /// The measurements.
    pub measures: Vec<BodyMeasure>,
    /// Volume, litres.
    pub volume_l: f64,
    /// The landmarks.
    pub landmarks: Vec<BodyLandmark>,
    /// The standing body that was measured, soles at 0.
    #[serde(skip)]
    pub standing: Mesh,
}

/// Lowest body that is measured, metres.
const LEAST_HEIGHT: f64 = 0.3;

/// Landmarks: the standard's term and the template's name.
const LANDMARKS: [(&str, &str); 30] = [
    ("top of the head", "vertex"),
    ("chin point", "chin"),
    ("forehead point", "glabella"),
    ("back of the head", "occiput"),
    ("back neck point", "cervicale"),
    ("front neck point", "suprasternale"),
    ("left shoulder point", "leftAcromion"),
    ("right shoulder point", "rightAcromion"),
    ("left armpit point", "leftAxilla"),
    ("right armpit point", "rightAxilla"),
    ("left bust point", "leftNipple"),
    ("right bust point", "rightNipple"),
    ("left elbow point", "leftElbow"),
    ("right elbow point", "rightElbow"),
    ("left wrist point", "leftWristOuter"),
    ("right wrist point", "rightWristOuter"),
    ("left tip of the middle finger", "leftMiddleFingerTip"),
    ("right tip of the middle finger", "rightMiddleFingerTip"),
    ("navel", "navel"),
    ("left trochanter point", "leftTrochanter"),
    ("right trochanter point", "rightTrochanter"),
    ("crotch point", "crotch"),
    ("left knee point", "leftKneeFront"),
    ("right knee point", "rightKneeFront"),
    ("left ankle point", "leftAnkleOuter"),
    ("right ankle point", "rightAnkleOuter"),
    ("left heel point", "leftHeel"),
    ("right heel point", "rightHeel"),
    ("left foot point", "leftToeTip"),
    ("right foot point", "rightToeTip"),
];

/// Measures a body (its own shape at rest, template topology of `model`); `basic` are its stature, girths and volume as
/// [`crate::fit_body`] gives them, which are taken over. A measurement whose section the body lacks is left out.
///
/// # Errors
/// [`FittingError::Mesh`] where the body is not of the model's topology, or no body at all.
pub fn measure_table(
    model: &BodyModel,
    body: &SkinnedMesh,
    basic: &Measurements,
) -> Result<MeasureTable, FittingError> {
    if body.mesh.positions.len() != model.vertex_count() {
        let (have, want) = (body.mesh.positions.len(), model.vertex_count());
        return Err(FittingError::Mesh(format!("{have} vertices, but the template has {want}")));
    }
    let mut mesh = standing(body);
    let (low, high) = height_range(&mesh, &model.inner);
    if high - low < LEAST_HEIGHT {
        return Err(FittingError::Mesh(format!(
            "it is {:.2} m high: no body that could be measured",
            (high - low).max(0.0)
        )));
    }
    mesh.positions.iter_mut().for_each(|p| p.y -= low as f32);
    mesh.recompute_normals();
    let mut joints = stance(&body.skeleton).joint_positions(&body.skeleton);
    joints.iter_mut().for_each(|j| j.y -= low);
    let mut taken = Taken { model, mesh, joints, measures: Vec::new() };
    taken.heights(basic);
    taken.trunk(basic);
    for side in ["left", "right"] {
        taken.arm(side);
        taken.leg(side);
    }
    let landmarks = LANDMARKS
        .iter()
        .filter_map(|(term, name)| Some((term, taken.at(name)?)))
        .map(|(term, p)| BodyLandmark { name: (*term).into(), position: p.into() });
    Ok(MeasureTable {
        standard: "ISO 8559-1".into(),
        landmarks: landmarks.collect(),
        volume_l: 1e3 * basic.volume_m3,
        measures: taken.measures,
        standing: taken.mesh,
    })
}

impl MeasureTable {
    /// The measurement called `name`, metres.
    pub fn value(&self, name: &str) -> Option<f64> {
        self.measures.iter().find(|m| m.name == name).map(|m| m.value_m)
    }

    /// As comma-separated lines: name, kind, centimetres, and the height of the tape's middle above the soles,
    /// centimetres (empty for heights); the volume in litres last.
    pub fn csv(&self) -> String {
        let mut out = String::from("measurement,kind,value,unit,height\n");
        for m in &self.measures {
            let kind = format!("{:?}", m.kind).to_lowercase();
            let (low, high) = m.path.iter().fold((f64::MAX, f64::MIN), |(l, h), p| (l.min(p[1]), h.max(p[1])));
            let is_shown = !m.path.is_empty() && m.kind != MeasureKind::Height;
            let height = if is_shown { format!("{:.1}", 50.0 * (low + high)) } else { String::new() };
            out += &format!("{},{kind},{:.1},cm,{height}\n", m.name, 100.0 * m.value_m);
        }
        out + &format!("volume,volume,{:.2},l,\n", self.volume_l)
    }
}

/// A body being measured.
struct Taken<'a> {
    model: &'a BodyModel,
    mesh: Mesh,
    joints: Vec<Point3<f64>>,
    measures: Vec<BodyMeasure>,
}

impl Taken<'_> {
    fn at(&self, landmark: &str) -> Option<Point3<f64>> {
        self.model.landmark(landmark).map(|v| self.mesh.positions[v as usize].cast())
    }

    fn joint(&self, side: &str, name: &str) -> Option<Point3<f64>> {
        Joint::from_name(&format!("{side}{name}")).map(|j| self.joints[j.index()])
    }

    fn add(&mut self, name: impl Into<String>, kind: MeasureKind, value_m: f64, path: &[Point3<f64>]) {
        let path = path.iter().map(|p| (*p).into()).collect();
        self.measures.push(BodyMeasure { name: name.into(), kind, value_m, path });
    }

    fn add_tape(&mut self, name: impl Into<String>, kind: MeasureKind, tape: Option<Tape>) {
        if let Some(tape) = tape {
            self.add(name, kind, tape.length, &tape.path);
        }
    }

    fn add_height(&mut self, name: &str, p: Option<Point3<f64>>) {
        if let Some(p) = p {
            self.add(name, MeasureKind::Height, p.y, &[Point3::new(p.x, 0.0, p.z), p]);
        }
    }

    fn add_straight(&mut self, name: impl Into<String>, kind: MeasureKind, points: &[Option<Point3<f64>>]) {
        if let Some(points) = points.iter().copied().collect::<Option<Vec<_>>>() {
            let length = points.windows(2).map(|s| (s[1] - s[0]).norm()).sum();
            self.add(name, kind, length, &points);
        }
    }

    fn heights(&mut self, basic: &Measurements) {
        let top = self.at("vertex").map(|p| Point3::new(p.x, basic.stature_m, p.z));
        self.add_height("stature", top);
        for (name, landmark) in [
            ("chin height", "chin"),
            ("back neck height", "cervicale"),
            ("front neck height", "suprasternale"),
            ("shoulder height", "leftAcromion"),
            ("bust height", "leftNipple"),
            ("trochanter height", "leftTrochanter"),
            ("crotch height (inside leg length)", "crotch"),
            ("knee height", "leftKneeFront"),
            ("ankle height", "leftAnkleOuter"),
        ] {
            self.add_height(name, self.at(landmark));
        }
        for (name, girth) in [("waist height", basic.waist), ("hip height", basic.hip)] {
            let middle = self.joints[Joint::Hips.index()];
            self.add_height(name, Some(Point3::new(middle.x, girth.height_m, middle.z)));
        }
    }

    fn trunk(&mut self, basic: &Measurements) {
        use MeasureKind::{Breadth, Girth, Length};
        if let (Some(front), Some(back)) = (self.at("glabella"), self.at("occiput")) {
            let plane = Plane::across(nalgebra::center(&front, &back), &(back - front).cross(&Vector3::x()));
            self.add_tape("head girth", Girth, plane.and_then(|p| girth_near(&self.mesh, &p)));
            self.add_straight("head length", Breadth, &[Some(front), Some(back)]);
        }
        let (neck, head) = (self.joints[Joint::Neck.index()], self.joints[Joint::Head.index()]);
        self.add_tape("neck girth", Girth, self.least(&neck, &head, 0.1..0.9));
        for (name, girth) in [("chest girth", basic.chest), ("waist girth", basic.waist), ("hip girth", basic.hip)] {
            // value as it stood in the scan; the tape is drawn at the same height of the straight stance
            let drawn = largest_girth(&self.mesh, &Plane::level(girth.height_m)).unwrap_or_default();
            self.add(name, Girth, girth.girth_m, &drawn.path);
        }
        let bust = self.at("leftNipple").and_then(|p| largest_girth(&self.mesh, &Plane::level(p.y)));
        self.add_tape("bust girth", Girth, bust);
        self.add_straight("shoulder breadth", Breadth, &[self.at("leftAcromion"), self.at("rightAcromion")]);
        self.add_tape("shoulder width over the back", Length, self.over_the_back());
        for (name, start, out) in
            [("back neck to waist", "cervicale", -1.0), ("front neck to waist", "suprasternale", 1.0)]
        {
            self.add_tape(name, Length, self.down_to(start, basic.waist.height_m, out));
        }
    }

    fn over_the_back(&self) -> Option<Tape> {
        let (left, middle, right) = (self.at("leftAcromion")?, self.at("cervicale")?, self.at("rightAcromion")?);
        let out = Vector3::new(0.0, 0.5, -1.0);
        let (a, b) = (taut(&self.mesh, &left, &middle, &out)?, taut(&self.mesh, &middle, &right, &out)?);
        Some(Tape { length: a.length + b.length, path: a.path.into_iter().chain(b.path).collect() })
    }

    /// Over the surface from a landmark straight down to a level, on the back (`out` −1) or the front (+1).
    fn down_to(&self, landmark: &str, level: f64, out: f64) -> Option<Tape> {
        let start = self.at(landmark)?;
        let waist = largest_girth(&self.mesh, &Plane::level(level))?;
        let nearer = |a: &Point3<f64>, b: &Point3<f64>| out * b.z > out * a.z;
        let end = waist.path.into_iter().reduce(|a, b| if nearer(&a, &b) { b } else { a })?;
        taut(&self.mesh, &start, &Point3::new(start.x, level, end.z), &Vector3::new(0.0, 0.0, out))
    }

    fn arm(&mut self, side: &str) {
        use MeasureKind::{Girth, Length};
        let at = |t: &Self, name: &str| t.at(&format!("{side}{name}"));
        let joints = ["UpperArm", "LowerArm", "Hand"].map(|n| self.joint(side, n));
        if let [Some(shoulder), Some(elbow), Some(wrist)] = joints {
            self.add_tape(format!("{side} upper arm girth"), Girth, self.most(&shoulder, &elbow, 0.45..0.75));
            self.add_tape(format!("{side} elbow girth"), Girth, self.across(&elbow, &(wrist - shoulder)));
            self.add_tape(format!("{side} forearm girth"), Girth, self.most(&elbow, &wrist, 0.1..0.6));
            self.add_tape(format!("{side} wrist girth"), Girth, self.least(&elbow, &wrist, 0.75..1.0));
        }
        let (shoulder, elbow, wrist) = (at(self, "Acromion"), at(self, "Elbow"), at(self, "WristOuter"));
        self.add_straight(format!("{side} upper arm length"), Length, &[shoulder, elbow]);
        self.add_straight(format!("{side} lower arm length"), Length, &[elbow, wrist]);
        self.add_straight(format!("{side} arm length"), Length, &[shoulder, elbow, wrist]);
        self.add_straight(format!("{side} hand length"), Length, &[wrist, at(self, "MiddleFingerTip")]);
    }

    fn leg(&mut self, side: &str) {
        use MeasureKind::{Breadth, Girth, Length};
        let at = |t: &Self, name: &str| t.at(&format!("{side}{name}"));
        let joints = ["UpperLeg", "LowerLeg", "Foot"].map(|n| self.joint(side, n));
        if let ([Some(hip), Some(knee), Some(ankle)], Some(crotch)) = (joints, self.at("crotch")) {
            // levels as parts of the way from the crotch to the knee, and from the knee to the ankle
            let thigh = |t: f64| hip + (knee - hip) * ((crotch.y - hip.y + t * (knee.y - crotch.y)) / (knee.y - hip.y));
            let shank = |t: f64| knee + (ankle - knee) * t;
            self.add_tape(
                format!("{side} thigh girth"),
                Girth,
                self.level_most((0..6).map(|k| thigh(0.03 + 0.03 * f64::from(k)))),
            );
            self.add_tape(format!("{side} mid-thigh girth"), Girth, self.level_most([thigh(0.5)].into_iter()));
            self.add_tape(format!("{side} knee girth"), Girth, self.level_most([knee].into_iter()));
            self.add_tape(
                format!("{side} calf girth"),
                Girth,
                self.level_most((0..20).map(|k| shank(0.1 + 0.025 * f64::from(k)))),
            );
            self.add_tape(format!("{side} ankle girth"), Girth, self.least(&knee, &ankle, 0.7..0.97));
        }
        let floor = |p: Option<Point3<f64>>| p.map(|p| Point3::new(p.x, 0.0, p.z));
        self.add_straight(
            format!("{side} foot length"),
            Breadth,
            &[floor(at(self, "Heel")), floor(at(self, "ToeTip"))],
        );
        let out = Vector3::x() * if side == "left" { 1.0 } else { -1.0 };
        let ankle = floor(at(self, "AnkleOuter"));
        let outside = at(self, "Trochanter").zip(ankle).and_then(|(a, b)| taut(&self.mesh, &a, &b, &out));
        self.add_tape(format!("{side} outside leg length from the trochanter"), Length, outside);
    }

    fn across(&self, point: &Point3<f64>, direction: &Vector3<f64>) -> Option<Tape> {
        girth_near(&self.mesh, &Plane::across(*point, direction)?)
    }

    /// Girths across the bone from `a` to `b`, over a part of its length.
    fn along(&self, a: &Point3<f64>, b: &Point3<f64>, part: std::ops::Range<f64>) -> Vec<Tape> {
        const STEPS: u32 = 16;
        let at = |k: u32| a + (b - a) * (part.start + (part.end - part.start) * f64::from(k) / f64::from(STEPS));
        (0..=STEPS).filter_map(|k| self.across(&at(k), &(b - a))).collect()
    }

    fn most(&self, a: &Point3<f64>, b: &Point3<f64>, part: std::ops::Range<f64>) -> Option<Tape> {
        self.along(a, b, part).into_iter().reduce(|a, b| if b.length > a.length { b } else { a })
    }

    fn least(&self, a: &Point3<f64>, b: &Point3<f64>, part: std::ops::Range<f64>) -> Option<Tape> {
        self.along(a, b, part).into_iter().reduce(|a, b| if b.length < a.length { b } else { a })
    }

    /// The largest horizontal girth of the leg that holds the given points.
    fn level_most(&self, points: impl Iterator<Item = Point3<f64>>) -> Option<Tape> {
        points.filter_map(|p| self.across(&p, &Vector3::y())).reduce(|a, b| if b.length > a.length { b } else { a })
    }
}
