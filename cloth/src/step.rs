//! One time step.

use nalgebra::Vector3;

use crate::{
    ClothError, Obstacle, Sheet, air,
    contact::{self, Contact, Friction},
    minimise::minimise,
    objective::Objective,
};

/// Distance beyond the gap at which a surface is looked for, metres: farther than a vertex falls in a step.
const REACH: f64 = 0.03;

/// What a sheet meets during a step.
pub struct Surroundings<'a> {
    /// Acceleration, m/s².
    pub gravity: Vector3<f64>,
    /// Further accelerations, one a vertex, m/s²; empty for none.
    pub pulls: &'a [Vector3<f64>],
    /// Velocity of the air, m/s.
    pub wind: Vector3<f64>,
    /// Where the anchors are at the end of the step, one a vertex; empty for a sheet without anchors.
    pub anchors: &'a [Vector3<f64>],
    /// From where the minimum is looked for: the sheet as it would move along with what carries it. Empty: as inertia
    /// takes it.
    pub guess: &'a [Vector3<f64>],
    /// Surfaces at the end of the step.
    pub obstacles: &'a [&'a dyn Obstacle],
    /// Distance that each vertex keeps from the surfaces, metres; empty for none.
    pub gaps: &'a [f64],
    /// Rate at which motion against the anchors dies down, 1/s.
    pub drag: f64,
    /// Deceleration of that motion by the cloth's own dry friction (bending hysteresis), m/s²: what brings it to rest.
    pub dry: f64,
}

impl Default for Surroundings<'_> {
    fn default() -> Self {
        let gravity = Vector3::new(0.0, -9.81, 0.0);
        Self { gravity, ..Self::still() }
    }
}

impl Surroundings<'_> {
    /// Nothing at all, not even gravity.
    pub fn still() -> Self {
        Self {
            gravity: Vector3::zeros(),
            pulls: &[],
            wind: Vector3::zeros(),
            anchors: &[],
            guess: &[],
            obstacles: &[],
            gaps: &[],
            drag: 0.0,
            dry: 0.0,
        }
    }
}

/// How much work a step may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// Number of times that contacts are looked for.
    pub rounds: usize,
    /// Maximum number of steps of the minimiser in each round.
    pub iterations: usize,
    /// The minimiser's last step, metres (root mean square).
    pub tolerance: f64,
    /// Whether the sheet's own contact is looked for.
    pub self_contact: bool,
}

impl Default for Effort {
    fn default() -> Self {
        Self { rounds: 2, iterations: 10, tolerance: 1e-5, self_contact: true }
    }
}

impl Sheet {
    /// Moves the sheet by `h` seconds.
    ///
    /// # Errors
    /// [`ClothError::TimeStep`] where `h` is not positive, [`ClothError::Sheet`] where anchors or guess are of another length.
    pub fn advance(&mut self, h: f64, around: &Surroundings, effort: &Effort) -> Result<(), ClothError> {
        let n = self.len();
        let lengths = [
            ("anchors", around.anchors.len()),
            ("guess", around.guess.len()),
            ("pulls", around.pulls.len()),
            ("gaps", around.gaps.len()),
        ];
        for (what, count) in lengths {
            if count != 0 && count != n {
                return Err(ClothError::Sheet(format!("{n} vertices have {count} {what}")));
            }
        }
        let mut system = self.take_system(h)?;
        let inertial = self.inertial(h, around);
        let anchors = if around.anchors.is_empty() { &self.positions } else { around.anchors };
        let mut x = if around.guess.is_empty() { inertial.clone() } else { around.guess.to_vec() };
        let friction = Friction { coefficient: self.rest.fabric.friction, step: h };
        let mut pressed = self.pressed.clone();
        for _ in 0..effort.rounds {
            let contacts = contact::find(&x, around.obstacles, around.gaps, REACH, &system.diagonal, &pressed);
            let pairs = if effort.self_contact { self.neighbourhood.pairs(&x, &system.diagonal) } else { Vec::new() };
            system.hold(&x, &contacts, &pairs)?;
            let (inertial, contacts, pairs) = (&inertial, &contacts, &pairs);
            let objective = Objective { sheet: self, system: &system, inertial, anchors, contacts, pairs, friction };
            minimise(&objective, &mut x, effort.iterations, effort.tolerance);
            pressed = pressed_by(contacts, &x);
        }
        self.velocities = x.iter().zip(&self.positions).map(|(x, p)| (x - p) / h).collect();
        (self.positions, self.pressed) = (x, pressed);
        self.carried = around.anchors.to_vec();
        self.put_system(system);
        Ok(())
    }

    /// Where the vertices go without any force but gravity and air.
    fn inertial(&self, h: f64, around: &Surroundings) -> Vec<Vector3<f64>> {
        let pull = |v: usize| around.gravity + around.pulls.get(v).copied().unwrap_or_default();
        let mut velocities: Vec<Vector3<f64>> =
            self.velocities.iter().enumerate().map(|(v, velocity)| velocity + pull(v) * h).collect();
        if !around.anchors.is_empty() {
            let share = 1.0 - (-around.drag * h).exp();
            for (v, velocity) in velocities.iter_mut().enumerate() {
                let carried = (around.anchors[v] - self.carried.get(v).unwrap_or(&around.anchors[v])) / h;
                let relative = (*velocity - carried) * (1.0 - share);
                let speed = relative.norm();
                *velocity = carried + relative * ((speed - around.dry * h).max(0.0) / speed.max(1e-12));
            }
        }
        self.neighbourhood.damp(&mut velocities, self.rest.fabric.damping, h);
        air::slow_down(self, &mut velocities, &around.wind, h);
        self.positions.iter().zip(&velocities).map(|(p, v)| p + v * h).collect()
    }
}

fn pressed_by(contacts: &[Contact], x: &[Vector3<f64>]) -> Vec<f64> {
    let mut pressed = vec![0.0f64; x.len()];
    for c in contacts {
        let v = c.vertex as usize;
        pressed[v] = pressed[v].max(c.stiffness * c.depth(&x[v]));
    }
    pressed
}
