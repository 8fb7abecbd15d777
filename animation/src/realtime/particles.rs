//! One step of a garment's rough mesh: springs to the skinned place, links as constraints, planes of what it can hit (Macklin,
//! Müller, Chentanez 2016, "XPBD": one round a step, many steps).

use nalgebra::{Point3, Vector3};

use super::{
    class::Class,
    hit::{HITS, Hit},
    rough::Rough,
};

/// Length of a step, seconds.
pub(super) const STEP: f64 = 1.0 / 240.0;
/// Rate at which the air and the layers below damp cloth that moves against the body, 1/s, as in `blend`.
const DRAG: f32 = 7.0;
/// Deceleration by the cloth's own friction, m/s²: cloth comes to rest within 0.1 / 5² m = 4 mm of where it hung in the scan.
const DRY: f32 = 0.1;
/// Coefficient of friction of cloth on cloth and skin: that of shirting, in the table of fabrics.
const FRICTION: f32 = 0.4;
/// Fastest that cloth moves against the body, m/s: what a hand that is thrown reaches.
const FASTEST: f32 = 12.0;

impl Rough {
    /// Moves the rough mesh on by a step, from `share` to `share + part` of the way from `from` to `to`.
    pub fn step(&mut self, share: f32, part: f32) {
        let h = STEP as f32;
        self.fall(share, part, h);
        for link in &self.links {
            link.pull(&mut self.places);
        }
        let share = share + part;
        for v in 0..self.places.len() {
            match self.classes[v] {
                Class::Stretch => {}
                Class::Limb => {
                    let (rest, turn) = (self.carried(v, share), self.skin.rotations[v]);
                    let own = turn.inverse() * (self.places[v] - rest);
                    self.places[v] = rest + turn * self.half_spheres[v].hold(own);
                }
                Class::Trunk | Class::Floating => {
                    touch(&mut self.places[v], &self.before[v], &self.hits[v], share, part);
                }
            }
        }
        for ((velocity, place), before) in self.velocities.iter_mut().zip(&self.places).zip(&self.before) {
            *velocity = (place - before) / h;
        }
    }

    /// Where the skeleton carries a vertex at a share of the way.
    pub fn carried(&self, v: usize, share: f32) -> Point3<f32> {
        self.from[v] + (self.to[v] - self.from[v]) * share
    }

    /// Moves each vertex by itself: inertia, gravity, drag, and the spring to its skinned place.
    fn fall(&mut self, share: f32, part: f32, h: f32) {
        let gravity = Vector3::new(0.0, -9.81, 0.0);
        let kept = (-DRAG * h).exp();
        for v in 0..self.places.len() {
            let carried = self.carried(v, share + part);
            self.before[v] = self.places[v];
            if self.classes[v] == Class::Stretch {
                self.places[v] = carried;
                continue;
            }
            let along = (self.to[v] - self.from[v]) * (part / h);
            // Gravity, less what held the scanned shape against it, which turns with the body.
            let pull = gravity - self.skin.rotations[v] * gravity;
            let own = (self.velocities[v] + pull * h - along) * kept;
            let speed = own.norm();
            let own = own * ((speed - DRY * h).clamp(0.0, FASTEST) / speed.max(1e-9));
            let stiffness = (self.frequencies[v] * h).powi(2);
            let free = self.places[v] + (along + own) * h;
            self.places[v] = free + (carried - free) * (stiffness / (1.0 + stiffness));
        }
    }
}

/// Puts a vertex over the planes that it hits; what presses it on them slows its way along them.
fn touch(place: &mut Point3<f32>, before: &Point3<f32>, hits: &[Hit; HITS], share: f32, part: f32) {
    for hit in hits.iter().filter(|h| h.is_some()) {
        let depth = hit.gap - (*place - hit.at(share)).dot(&hit.normal);
        if depth <= 0.0 {
            continue;
        }
        *place += hit.normal * depth;
        let way = (*place - before) - hit.way * part;
        let along = way - hit.normal * way.dot(&hit.normal);
        let length = along.norm();
        if length > 1e-9 {
            *place -= along * ((FRICTION * depth).min(length) / length);
        }
    }
}
