//! A garment as the seed simulates it: held by nothing but the body, contact and friction.
//!
//! Hu et al. 2017, §7.1, mix what a cloth simulator gives with skinning (`shares`). The simulator's cloth falls where gravity
//! takes it: a coat hangs on the shoulders by friction alone. A garment that has no shoulders to hang on would be lost at once; its
//! waistband is tied to the skin, as an elastic or a belt ties it.

use nalgebra::Point3;
use toile_character::{Joint, SkinWeights, joint::JOINTS};
use toile_cloth::Sheet;
use toile_geometry::{Mesh, topology::boundary_loops};

use super::anchors::frequency;
use crate::AnimationError;

/// Height of a waistband, metres: a belt's usual width.
const BAND: f32 = 0.035;

/// A garment's sheet without the springs that tie it to its skinned place.
pub(crate) struct Hung {
    pub sheet: Sheet,
    /// How tightly each vertex is tied to its skinned place: 1 in a waistband, else 0.
    pub tied: Vec<f64>,
}

impl Hung {
    /// From a garment's proxy `mesh` and the `sheet` made of it.
    ///
    /// # Errors
    /// [`AnimationError::Motion`] where the sheet cannot be tied.
    pub fn new(sheet: &Sheet, mesh: &Mesh, weights: &SkinWeights) -> Result<Self, AnimationError> {
        let mut tied = vec![0.0; mesh.positions.len()];
        if !hangs_on_shoulders(weights) {
            band(mesh).into_iter().for_each(|v| tied[v] = 1.0);
        }
        // The band bears the whole garment: it follows the skin as tightly as cloth that lies on it.
        let masses = sheet.masses();
        let borne: f64 = masses.iter().zip(&tied).map(|(m, t)| m * t).sum();
        let load = masses.iter().sum::<f64>() / borne.max(1e-9);
        let stiffness = masses.iter().zip(&tied).map(|(m, t)| t * m * load * frequency(0.0, 0.0).powi(2)).collect();
        let sheet = sheet.tied_by(stiffness).map_err(|e| AnimationError::Motion(e.to_string()))?;
        Ok(Self { sheet, tied })
    }
}

/// True where a shoulder moves some of the garment most.
fn hangs_on_shoulders(weights: &SkinWeights) -> bool {
    let of_shoulder = |joint: &u8| {
        let joint = JOINTS.get(usize::from(*joint));
        joint.is_some_and(|j| [Joint::LeftShoulder, Joint::RightShoulder].contains(j))
    };
    weights.joints.iter().any(|joints| of_shoulder(&joints[0]))
}

/// The vertices around the highest of the mesh's borders, or around its highest vertex where it has none.
fn band(mesh: &Mesh) -> Vec<usize> {
    let at = |v: &u32| mesh.positions[*v as usize];
    let height = |border: &Vec<u32>| border.iter().map(|v| at(v).y).sum::<f32>() / border.len().max(1) as f32;
    let borders = boundary_loops(&mesh.triangles);
    let highest = borders.into_iter().max_by(|a, b| height(a).total_cmp(&height(b)));
    let rim: Vec<Point3<f32>> = match highest {
        Some(border) => border.iter().map(at).collect(),
        None => mesh.positions.iter().copied().max_by(|a, b| a.y.total_cmp(&b.y)).into_iter().collect(),
    };
    let near = |p: &Point3<f32>| rim.iter().any(|q| (p - q).norm_squared() < BAND * BAND);
    (0..mesh.positions.len()).filter(|&v| near(&mesh.positions[v])).collect()
}
