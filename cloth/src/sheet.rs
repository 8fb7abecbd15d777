//! A sheet: its rest shape, what it is made of, and where it is now.

use nalgebra::Vector3;

use crate::{
    ClothError, Fabric,
    membrane::Element,
    rest::{Anchors, Rest, RestShape},
    self_contact::Neighbourhood,
    system::System,
};

/// A sheet that moves.
#[derive(Debug, Clone)]
pub struct Sheet {
    /// Places of the vertices, metres.
    pub positions: Vec<Vector3<f64>>,
    /// Their velocities, m/s.
    pub velocities: Vec<Vector3<f64>>,
    pub(crate) rest: Rest,
    pub(crate) neighbourhood: Neighbourhood,
    /// Force with which each vertex was pressed onto what it touched, newtons: what friction starts from.
    pub(crate) pressed: Vec<f64>,
    /// Where the anchors were at the end of the last step; empty before the first.
    pub(crate) carried: Vec<Vector3<f64>>,
    system: Option<System>,
}

impl Sheet {
    /// A sheet at rest.
    ///
    /// # Errors
    /// [`ClothError::Fabric`] for a wrong fabric, [`ClothError::Sheet`] for positions that are not finite, triangles that name no
    /// vertex, a sheet without area, or anchors of another length.
    pub fn new(shape: &RestShape, fabric: Fabric, anchors: Anchors) -> Result<Self, ClothError> {
        let rest = Rest::new(shape, fabric, anchors)?;
        let n = rest.len();
        Ok(Self {
            positions: shape.positions.iter().map(|p| p.coords).collect(),
            velocities: vec![Vector3::zeros(); n],
            rest,
            neighbourhood: Neighbourhood::new(shape.positions, shape.triangles),
            pressed: vec![0.0; n],
            carried: Vec::new(),
            system: None,
        })
    }

    /// What decides how the sheet moves on, to the bit: places, velocities, forces of contact, and where the anchors were.
    pub fn state(&self) -> [Vec<f64>; 4] {
        let flat = |values: &[Vector3<f64>]| values.iter().flat_map(|v| [v.x, v.y, v.z]).collect();
        [flat(&self.positions), flat(&self.velocities), self.pressed.clone(), flat(&self.carried)]
    }

    /// Moves on from a `state` of the same sheet.
    ///
    /// # Errors
    /// [`ClothError::Sheet`] where it is that of another.
    pub fn restore(&mut self, state: [&[f64]; 4]) -> Result<(), ClothError> {
        let n = self.len();
        let [positions, velocities, pressed, carried] = state;
        let fits = positions.len() == 3 * n && velocities.len() == 3 * n && pressed.len() == n;
        if !fits || ![0, 3 * n].contains(&carried.len()) {
            return Err(ClothError::Sheet(format!("a state of {} vertices is not one of its {n}", pressed.len())));
        }
        let vectors = |values: &[f64]| values.chunks_exact(3).map(|v| Vector3::new(v[0], v[1], v[2])).collect();
        (self.positions, self.velocities, self.carried) = (vectors(positions), vectors(velocities), vectors(carried));
        self.pressed = pressed.to_vec();
        Ok(())
    }

    /// The same sheet at rest, its vertices tied to their anchors by springs of this `stiffness` (N/m, one a vertex).
    ///
    /// # Errors
    /// [`ClothError::Sheet`] for anchors of another length, or one that is not a number of at least 0.
    pub fn tied_by(&self, stiffness: Vec<f64>) -> Result<Self, ClothError> {
        let mut tied = Self { system: None, ..self.clone() };
        tied.rest.tie(Anchors { stiffness })?;
        Ok(tied)
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// True for a sheet without vertices.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Mass of each vertex, kg.
    pub fn masses(&self) -> &[f64] {
        &self.rest.masses
    }

    /// Corners of the triangles.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.rest.triangles
    }

    /// Elastic energy (stretch, shear, bending) and kinetic energy, joules.
    pub fn energy(&self) -> [f64; 2] {
        let of_element = |e: &Element| {
            e.area
                * crate::membrane::energy(
                    &e.deformation(&self.positions),
                    self.rest.fabric.stretch,
                    self.rest.fabric.shear,
                )
                .0
        };
        let elastic: f64 = self.rest.elements.iter().map(of_element).sum();
        let bent: f64 =
            self.rest.bends.iter().map(|b| b.energy(&self.positions, |_, _| {}) * self.rest.fabric.bending).sum();
        let moving: f64 = self.rest.masses.iter().zip(&self.velocities).map(|(m, v)| 0.5 * m * v.norm_squared()).sum();
        [elastic + bent, moving]
    }

    /// The factorised system for steps of `h` seconds, kept until another length is asked for.
    pub(crate) fn take_system(&mut self, h: f64) -> Result<System, ClothError> {
        match self.system.take() {
            Some(system) if system.step == h => Ok(system),
            _ => System::new(&self.rest, h),
        }
    }

    pub(crate) fn put_system(&mut self, system: System) {
        self.system = Some(system);
    }
}
