//! Contact of vertices with surfaces: planes that are held fixed while the sheet moves, and friction on them.

use nalgebra::Vector3;

use crate::obstacle::Obstacle;

/// Speed below which friction holds instead of sliding, m/s: a creep of a millimetre a minute would show, this does not.
const STICKING_SPEED: f64 = 2e-4;

/// Stiffness of contact over that of the cloth around the vertex: pressed in by 0.1 mm, cloth feels some 100 Pa.
const STIFFNESS: f64 = 0.1;

/// A vertex near a surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Contact {
    pub vertex: u32,
    /// Unit normal of the surface.
    pub normal: Vector3<f64>,
    /// Limit of normal · x: the surface and half of what must lie between, metres.
    pub height: f64,
    /// How the surface moves during the step, metres.
    pub moved: Vector3<f64>,
    /// Stiffness, N/m.
    pub stiffness: f64,
    /// Force along the normal when friction was last looked at, newtons.
    pub pressed: f64,
}

impl Contact {
    /// How far the vertex is below where it must be, metres; 0 above.
    #[inline]
    pub fn depth(&self, x: &Vector3<f64>) -> f64 {
        (self.height - self.normal.dot(x)).max(0.0)
    }
}

/// What the contacts of a step have in common.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Friction {
    pub coefficient: f64,
    /// Length of the step, seconds.
    pub step: f64,
}

impl Friction {
    /// Energy of the vertex's way along the surface during the step, and its derivative (Li et al. 2020, eq. 13–15).
    #[inline]
    pub fn energy(&self, contact: &Contact, way: &Vector3<f64>) -> (f64, Vector3<f64>) {
        let relative = way - contact.moved;
        let along = relative - contact.normal * relative.dot(&contact.normal);
        let (length, sticking) = (along.norm(), STICKING_SPEED * self.step);
        let force = self.coefficient * contact.pressed;
        if length >= sticking {
            return (force * (length - sticking / 3.0), along * (force / length));
        }
        let share = length / sticking;
        (force * sticking * (share * share - share.powi(3) / 3.0), along * (force / sticking * (2.0 - share)))
    }
}

/// The contacts of vertices at `x` with `obstacles`, at a distance of at most `reach` beyond each one's gap.
pub(crate) fn find(
    x: &[Vector3<f64>],
    obstacles: &[&dyn Obstacle],
    gaps: &[f64],
    reach: f64,
    stiffness: &[f64],
    pressed: &[f64],
) -> Vec<Contact> {
    let mut out = Vec::new();
    for (v, p) in x.iter().enumerate() {
        let gap = gaps.get(v).copied().unwrap_or(0.0);
        for near in obstacles.iter().filter_map(|o| o.near(p, gap + reach)) {
            out.push(Contact {
                vertex: v as u32,
                normal: near.normal,
                height: near.normal.dot(&near.point) + gap,
                moved: near.moved,
                stiffness: STIFFNESS * stiffness[v],
                pressed: pressed[v],
            });
        }
    }
    out
}
