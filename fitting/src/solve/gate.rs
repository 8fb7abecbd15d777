//! Which pairs of points may correspond, and how much a pair counts.

use nalgebra::{Point3, Vector3};
use toile_character::Joint;

use super::Residual;

/// How many independent measurements all data of one resolution stand for, however many points sample it: noise and the
/// model's misfit are alike over a few centimetres, and a person has some 2,000 patches of 3 cm.
pub(crate) const INDEPENDENT: f64 = 2000.0;

/// The conditions that a pair of points must fulfil, and how it is weighed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Gate {
    /// Largest distance, metres.
    pub distance: f32,
    /// Largest slip along the surface, metres: beyond it the nearest point is the rim of a hole.
    pub slip: f32,
    /// Smallest cosine of the angle between the normals.
    pub min_cos: f32,
    /// Scale of the robust kernel (Geman and McClure), metres.
    pub kernel: f32,
    /// Standard deviation of a good residual, metres.
    pub noise: f32,
    /// How far clothes stand off the skin; `None` where nobody is dressed.
    pub cloth: Option<Cloth>,
}

/// What is known of skin that cloth covers: it lies deeper than the scan, by a distance that is alike over a whole garment.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cloth {
    /// Mean distance from the skin of a joint's part to the cloth, metres; 0 for parts that clothes seldom cover.
    pub stand_off: fn(Joint) -> f32,
    /// How many independent measurements all clothes of a person are, as [`INDEPENDENT`] is for skin.
    pub independent: f64,
}

/// Standard deviation of a stand-off by its mean: from half to one and a half times the usual ease in two of three garments.
const LOOSENESS: f64 = 0.6;
/// The same at least, metres: cloth's own thickness, and folds.
const FOLDS: f64 = 0.003;

impl Cloth {
    /// The mean stand-off (metres) of a vertex of `joint`, and its weight by area; `None` where it is bare.
    pub fn over(&self, joint: Joint) -> Option<(f32, f64)> {
        let stand_off = (self.stand_off)(joint);
        let spread = (LOOSENESS * f64::from(stand_off)).max(FOLDS);
        (stand_off > 0.0).then_some((stand_off, self.independent / spread.powi(2)))
    }
}

impl Gate {
    /// The residual of `vertex` at `p` against the scan point `q` with unit normal `m`; `None` where they may not
    /// correspond.
    pub fn pair(
        &self,
        vertex: u32,
        p: &Point3<f32>,
        q: &Point3<f32>,
        m: &Vector3<f32>,
        weight: f64,
    ) -> Option<Residual> {
        let d = p - q;
        let value = d.dot(m);
        let slip = (d - m * value).norm();
        let fits = slip <= self.slip && value.abs() <= self.distance;
        fits.then_some(Residual { vertex, normal: *m, value, weight })
    }

    /// Geman and McClure's weight of a residual of `value` metres.
    pub fn robust(&self, value: f32) -> f64 {
        let s = f64::from(self.kernel).powi(2);
        (s / (s + f64::from(value).powi(2))).powi(2)
    }
}
