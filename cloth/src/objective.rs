//! The potential whose minimum is the end of a step.

use nalgebra::Vector3;

use crate::{
    Sheet,
    contact::{Contact, Friction},
    membrane,
    self_contact::Pair,
    system::System,
};

/// The potential of one step.
pub(crate) struct Objective<'a> {
    pub sheet: &'a Sheet,
    pub system: &'a System,
    /// Where inertia and gravity alone would take each vertex.
    pub inertial: &'a [Vector3<f64>],
    /// Where the anchors are at the end of the step.
    pub anchors: &'a [Vector3<f64>],
    pub contacts: &'a [Contact],
    pub pairs: &'a [Pair],
    pub friction: Friction,
}

impl Objective<'_> {
    /// The potential at `x`, joules; its gradient goes to `gradient`.
    pub fn evaluate(&self, x: &[Vector3<f64>], gradient: &mut [Vector3<f64>]) -> f64 {
        self.places(x, gradient) + self.elastic(x, gradient) + self.touching(x, gradient)
    }

    /// Inertia and anchors, which set the gradient.
    fn places(&self, x: &[Vector3<f64>], gradient: &mut [Vector3<f64>]) -> f64 {
        let per_square = 1.0 / (self.system.step * self.system.step);
        let mut energy = 0.0;
        for v in 0..x.len() {
            let (mass, anchor) = (self.sheet.rest.masses[v] * per_square, self.sheet.rest.anchors[v]);
            let (off, from_anchor) = (x[v] - self.inertial[v], x[v] - self.anchors[v]);
            energy += 0.5 * (mass * off.norm_squared() + anchor * from_anchor.norm_squared());
            gradient[v] = off * mass + from_anchor * anchor;
        }
        energy
    }

    fn elastic(&self, x: &[Vector3<f64>], gradient: &mut [Vector3<f64>]) -> f64 {
        let fabric = &self.sheet.rest.fabric;
        let mut energy = 0.0;
        for element in &self.sheet.rest.elements {
            let (density, derivative) = membrane::energy(&element.deformation(x), fabric.stretch, fabric.shear);
            energy += element.area * density;
            for (v, g) in element.vertices.iter().zip(&element.gradients) {
                gradient[*v as usize] += derivative * (g * element.area);
            }
        }
        let mut bent = 0.0;
        for bend in &self.sheet.rest.bends {
            bent += bend.energy(x, |v, d| gradient[v as usize] += d * fabric.bending);
        }
        energy + fabric.bending * bent
    }

    fn touching(&self, x: &[Vector3<f64>], gradient: &mut [Vector3<f64>]) -> f64 {
        let mut energy = 0.0;
        for contact in self.contacts {
            let v = contact.vertex as usize;
            let depth = contact.depth(&x[v]);
            energy += 0.5 * contact.stiffness * depth * depth;
            gradient[v] -= contact.normal * (contact.stiffness * depth);
            if contact.pressed > 0.0 {
                let (held, derivative) = self.friction.energy(contact, &(x[v] - self.sheet.positions[v]));
                energy += held;
                gradient[v] += derivative;
            }
        }
        for pair in self.pairs {
            let [a, b] = pair.vertices.map(|v| v as usize);
            let apart = x[a] - x[b];
            let length = apart.norm();
            let depth = pair.distance - length;
            if depth > 0.0 && length > 1e-9 {
                energy += 0.5 * pair.stiffness * depth * depth;
                let push = apart * (pair.stiffness * depth / length);
                gradient[a] -= push;
                gradient[b] += push;
            }
        }
        energy
    }
}
