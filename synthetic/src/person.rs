//! A person drawn from the body model: shape, skin, hair, underwear, measurements.

use nalgebra::{Point3, Vector3};
use toile_character::{BodyModel, Joint, Region, SkinnedMesh};

use crate::{
    SyntheticError, noise,
    random::Random,
    settings::{Sex, SyntheticSettings},
    subdivide,
    tape::{self, Girths},
};

/// Length of the bumps on the skin, metres.
const DETAIL_WAVELENGTH: f32 = 0.11;
/// Largest coefficient of a random shape, in standard deviations from the mean of the sex.
const LARGEST_COEFFICIENT: f64 = 1.8;

/// A virtual person at rest (the body model's A-pose).
#[derive(Debug, Clone)]
pub struct Person {
    /// Coefficients of the body model; the detail is not in them.
    pub beta: Vec<f64>,
    /// The body on the template's topology, with detail.
    pub body: SkinnedMesh,
    /// Region of each template vertex.
    pub regions: Vec<Region>,
    /// The same surface with every triangle split in four, painted: what the camera sees.
    pub skin: SkinnedMesh,
    /// Region of each of its vertices.
    pub skin_regions: Vec<Region>,
    /// Height of the body at rest, metres, until a caller that can stand it straight (`toile synthesize` does) writes the
    /// stature here.
    pub stature_m: f64,
    /// Girths at rest.
    pub girths: Girths,
}

impl Person {
    /// Draws a person.
    ///
    /// # Errors
    /// [`SyntheticError::Setting`] where the shape cannot be measured as a body.
    pub fn new(model: &BodyModel, settings: &SyntheticSettings) -> Result<Self, SyntheticError> {
        let beta = random_beta(model, settings);
        let mut body = model.skinned(&beta);
        roughen(&mut body, settings);
        stand_on_floor(&mut body);
        let (mut skin, between) = subdivide::split(&body);
        let skin_regions: Vec<Region> = between.iter().map(|&[a, _]| model.regions[a as usize]).collect();
        let inner: Vec<bool> = between.iter().map(|b| b.iter().all(|&v| model.inner[v as usize])).collect();
        let paint = BodyPaint::new(model, &body, settings);
        skin.mesh.colors = paint.colors(&skin, &skin_regions, &inner);
        let girths = tape::girths(&body.mesh, &model.regions)
            .ok_or_else(|| SyntheticError::setting("variety", "this seed gives a body that cannot be measured"))?;
        let stature_m = tape::stature(&body.mesh);
        Ok(Self { beta, body, regions: model.regions.clone(), skin, skin_regions, stature_m, girths })
    }
}

fn random_beta(model: &BodyModel, settings: &SyntheticSettings) -> Vec<f64> {
    let mean = match settings.sex {
        Sex::Female => &model.population.beta_female,
        Sex::Male => &model.population.beta_male,
    };
    let mut random = Random::new(settings.seed, "shape");
    (0..model.component_count())
        .map(|i| {
            let middle = mean.get(i).map_or(0.0, |&b| f64::from(b));
            middle + random.normal(LARGEST_COEFFICIENT) * settings.variety
        })
        .collect()
}

/// Smooth bumps along the normals.
fn roughen(body: &mut SkinnedMesh, settings: &SyntheticSettings) {
    /// Root mean square of the noise as it comes.
    const NOISE_RMS: f64 = 0.33;
    let seed = Random::new(settings.seed, "detail").seed();
    let amplitude = (settings.detail_m / NOISE_RMS) as f32;
    let normals = body.mesh.vertex_normals();
    for (p, n) in body.mesh.positions.iter_mut().zip(normals) {
        *p += n * (amplitude * noise::layered(p, Vector3::repeat(DETAIL_WAVELENGTH), seed));
    }
}

fn stand_on_floor(body: &mut SkinnedMesh) {
    let lowest = body.mesh.positions.iter().map(|p| p.y).fold(f32::INFINITY, f32::min);
    body.mesh.positions.iter_mut().for_each(|p| p.y -= lowest);
    body.skeleton.rest.iter_mut().for_each(|p| p.y -= f64::from(lowest));
}

/// Colours of the bare body by place.
struct BodyPaint {
    skin: [f32; 3],
    hair: [f32; 3],
    underwear: [f32; 3],
    seed: u64,
    bra: bool,
    glabella: Point3<f32>,
    chin: Point3<f32>,
    crotch: Point3<f32>,
    navel: Point3<f32>,
    nipple: Point3<f32>,
    leg: Vector3<f32>,
}

const SKINS: [[f32; 3]; 4] = [[224.0, 178.0, 150.0], [198.0, 150.0, 118.0], [156.0, 108.0, 80.0], [112.0, 76.0, 58.0]];
const HAIRS: [[f32; 3]; 4] = [[52.0, 38.0, 30.0], [92.0, 62.0, 40.0], [124.0, 64.0, 38.0], [34.0, 32.0, 36.0]];
const UNDERWEARS: [[f32; 3]; 3] = [[58.0, 64.0, 84.0], [212.0, 212.0, 222.0], [104.0, 52.0, 66.0]];

impl BodyPaint {
    fn new(model: &BodyModel, body: &SkinnedMesh, settings: &SyntheticSettings) -> Self {
        let mut random = Random::new(settings.seed, "colours");
        let mut pick = |from: &[[f32; 3]]| from[(random.uniform() * from.len() as f64) as usize % from.len()];
        let (skin, hair, underwear) = (pick(&SKINS), pick(&HAIRS), pick(&UNDERWEARS));
        let at = |name: &str| model.landmark(name).map_or_else(Point3::origin, |v| body.mesh.positions[v as usize]);
        let joint = |j: Joint| body.skeleton.position(j).cast::<f32>();
        let leg = joint(Joint::LeftLowerLeg) - joint(Joint::LeftUpperLeg);
        Self {
            skin,
            hair,
            underwear,
            seed: random.seed(),
            bra: settings.sex == Sex::Female,
            glabella: at("glabella"),
            chin: at("chin"),
            crotch: at("crotch"),
            navel: at("navel"),
            nipple: at("leftNipple"),
            leg: leg.try_normalize(1e-6).unwrap_or(-Vector3::y()),
        }
    }

    fn colors(&self, skin: &SkinnedMesh, regions: &[Region], inner: &[bool]) -> Vec<[u8; 3]> {
        let points = skin.mesh.positions.iter().zip(regions).zip(inner);
        points.map(|((p, &region), &inner)| self.color(p, region, inner)).collect()
    }

    fn color(&self, p: &Point3<f32>, region: Region, inner: bool) -> [u8; 3] {
        let (base, variation) = if region == Region::Head && self.is_hair(p) {
            (self.hair, 0.18)
        } else if inner {
            (self.skin.map(|c| c * 0.45), 0.05)
        } else {
            let share = self.underwear(p, region);
            (std::array::from_fn(|k| self.skin[k] + (self.underwear[k] - self.skin[k]) * share), 0.09)
        };
        let coarse = noise::layered(p, Vector3::repeat(0.06), self.seed);
        let fine = noise::layered(p, Vector3::repeat(0.018), self.seed ^ 1);
        let light = 1.0 + variation * (0.6 * coarse + 0.6 * fine);
        base.map(|c: f32| (c * light).clamp(0.0, 255.0) as u8)
    }

    /// Above a plane that falls from the hairline to the nape.
    fn is_hair(&self, p: &Point3<f32>) -> bool {
        let face = self.glabella.y - self.chin.y;
        let hairline = self.glabella + Vector3::new(0.0, 0.32 * face, 0.0);
        (p - hairline).dot(&Vector3::new(0.0, 0.80, -0.60)) > 0.0 && p.y > self.chin.y
    }

    /// How much of a place is underwear, 0..1: soft edges, since skin has a vertex every half centimetre only.
    fn underwear(&self, p: &Point3<f32>, region: Region) -> f32 {
        use Region::*;
        const EDGE: f32 = 0.006;
        let waist = self.crotch.y + 0.72 * (self.navel.y - self.crotch.y);
        let down_leg = (Point3::new(p.x.abs(), p.y, p.z) - self.crotch).dot(&self.leg);
        let trunk = matches!(region, Torso | LeftLeg | RightLeg);
        let briefs = if trunk { (waist - p.y).min(0.075 - down_leg) } else { -EDGE };
        let bra = if self.bra && region == Torso { 0.058 - (p.y - self.nipple.y + 0.01).abs() } else { -EDGE };
        (0.5 + 0.5 * briefs.max(bra) / EDGE).clamp(0.0, 1.0)
    }
}
