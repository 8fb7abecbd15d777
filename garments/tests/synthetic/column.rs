//! A person that is a column: a body of rings with known truth, bare or covered with cloth.

use nalgebra::Point3;
use toile_character::{JOINT_COUNT, Joint, Pose, Skeleton, SkinWeights};
use toile_garments::{DressedTake, ExtractSettings, Extraction, GarmentType, extract};
use toile_geometry::Mesh;

pub const SKIN: [u8; 3] = [205, 160, 140];
pub const BLUE: [u8; 3] = [40, 60, 160];
pub const RADIUS: f32 = 0.12;
pub const HEIGHT: f32 = 1.2;

/// A column with `radius(y, angle)` and `color(y)`, rings 5 mm apart.
pub fn column(radius: impl Fn(f32, f32) -> f32, color: impl Fn(f32) -> [u8; 3]) -> Mesh {
    let (around, rows) = (150u32, 240u32);
    let mut mesh = Mesh::default();
    for r in 0..=rows {
        for i in 0..around {
            let (y, a) = (HEIGHT * r as f32 / rows as f32, i as f32 / around as f32 * std::f32::consts::TAU);
            let at = radius(y, a);
            mesh.positions.push(Point3::new(at * a.sin(), y, at * a.cos()));
            mesh.colors.push(color(y));
        }
    }
    for r in 0..rows {
        for i in 0..around {
            let (a, b) = (r * around + i, r * around + (i + 1) % around);
            mesh.triangles.extend([[a, b, b + around], [a, b + around, a + around]]);
        }
    }
    mesh
}

pub fn noise(y: f32, a: f32) -> f32 {
    0.0004 * ((y * 211.0).sin() * (a * 17.0).cos() + (y * 97.0 + a * 31.0).sin())
}

pub fn inside(y: f32) -> bool {
    (0.3..0.8).contains(&y)
}

/// A cloth `thick` metres off the body between heights 0.3 and 0.8.
pub fn dressed(thick: f32, color: [u8; 3]) -> Mesh {
    let radius = move |y: f32, a: f32| RADIUS + noise(y, a) + if inside(y) { thick } else { 0.0 };
    column(radius, move |y| if inside(y) { color } else { SKIN })
}

pub fn bare() -> Mesh {
    column(|_, _| RADIUS, |_| SKIN)
}

pub struct Person {
    pub body: Mesh,
    pub weights: SkinWeights,
    pub skeleton: Skeleton,
}

/// Hips below 0.4, spine to 0.8, head above, blended over 20 cm; the other joints lie along the axis.
pub fn person() -> Person {
    let body = bare();
    let mut weights = SkinWeights::default();
    for p in &body.positions {
        let step = |edge: f32| ((p.y - edge) / 0.2 + 0.5).clamp(0.0, 1.0);
        let (chest, head) = (step(0.4), step(0.8));
        weights.push(&[
            (Joint::Hips as u8, 1.0 - chest),
            (Joint::Spine as u8, chest * (1.0 - head)),
            (Joint::Head as u8, chest * head),
        ]);
    }
    let mut rest = [Point3::new(0.0, 0.8, 0.0); JOINT_COUNT];
    rest[Joint::Hips.index()].y = 0.2;
    rest[Joint::Spine.index()].y = 0.4;
    Person { body, weights, skeleton: Skeleton { rest } }
}

pub fn take<'a>(person: &'a Person, scan: &'a Mesh, previous: &'a Mesh, pose: &'a Pose) -> DressedTake<'a> {
    DressedTake {
        scan,
        is_first: false,
        previous,
        body: &person.body,
        weights: &person.weights,
        skeleton: &person.skeleton,
        pose,
        pose0: pose,
        garment_type: Some(GarmentType::Other),
        edits: None,
    }
}

/// The garment of a take by the default settings.
pub fn extracted(take: &DressedTake) -> Extraction {
    extract(take, &ExtractSettings::default(), &|_| ()).unwrap()
}

/// Intersection over union of the vertices that were labelled and those that are truly cloth.
pub fn iou_of(scan: &Mesh, labels: &[bool], truth: impl Fn(&Point3<f32>) -> bool) -> f64 {
    let both = scan.positions.iter().zip(labels).filter(|(p, l)| truth(p) && **l).count();
    let either = scan.positions.iter().zip(labels).filter(|(p, l)| truth(p) || **l).count();
    both as f64 / either.max(1) as f64
}

/// The same for cloth as [`dressed`] has it.
pub fn iou(scan: &Mesh, labels: &[bool]) -> f64 {
    iou_of(scan, labels, |p| inside(p.y))
}
