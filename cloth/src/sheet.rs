//! A sheet: its rest shape, what it is made of, and where it is now.

use nalgebra::{Point3, Vector3};

use crate::{
    ClothError, Fabric,
    bending::{Bend, bends},
    membrane::Element,
    self_contact::Neighbourhood,
    system::System,
};

/// Springs of zero length from each vertex to a place of its own.
#[derive(Debug, Clone, Default)]
pub struct Anchors {
    /// Stiffness of each vertex's spring, N/m; 0 for a vertex that is free. Empty: all are free.
    pub stiffness: Vec<f64>,
}

/// A sheet that moves.
#[derive(Debug, Clone)]
pub struct Sheet {
    /// Places of the vertices, metres.
    pub positions: Vec<Vector3<f64>>,
    /// Their velocities, m/s.
    pub velocities: Vec<Vector3<f64>>,
    pub(crate) fabric: Fabric,
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) masses: Vec<f64>,
    pub(crate) elements: Vec<Element>,
    pub(crate) bends: Vec<Bend>,
    pub(crate) anchors: Vec<f64>,
    pub(crate) neighbourhood: Neighbourhood,
    /// Force with which each vertex was pressed onto what it touched, newtons: what friction starts from.
    pub(crate) pressed: Vec<f64>,
    /// Where the anchors were at the end of the last step; empty before the first.
    pub(crate) carried: Vec<Vector3<f64>>,
    system: Option<System>,
}

impl Sheet {
    /// A sheet at rest. `curved` keeps the bends of the rest shape (a garment as it was scanned); otherwise it wants to
    /// be flat. The warp runs along `grain` as far as a triangle's plane allows.
    ///
    /// # Errors
    /// [`ClothError::Fabric`] for a wrong fabric, [`ClothError::Sheet`] for positions that are not finite, triangles that name no
    /// vertex, a sheet without area, or anchors of another length.
    pub fn new(
        rest: &[Point3<f64>],
        triangles: &[[u32; 3]],
        fabric: Fabric,
        curved: bool,
        grain: &Vector3<f64>,
        anchors: Anchors,
    ) -> Result<Self, ClothError> {
        fabric.check("of the sheet")?;
        check(rest, triangles, &anchors)?;
        let corners = |t: &[u32; 3]| t.map(|v| rest[v as usize]);
        let elements: Vec<Element> = triangles.iter().filter_map(|t| Element::new(*t, corners(t), grain)).collect();
        let mut masses = vec![0.0; rest.len()];
        for element in &elements {
            element.vertices.iter().for_each(|&v| masses[v as usize] += element.area / 3.0 * fabric.density);
        }
        let mean = masses.iter().sum::<f64>() / rest.len().max(1) as f64;
        if mean <= 0.0 {
            return Err(ClothError::Sheet("its triangles have no area".into()));
        }
        // Corners of slivers alone, and vertices of no triangle, must not be without mass.
        masses.iter_mut().for_each(|m| *m = m.max(0.05 * mean));
        let n = rest.len();
        Ok(Self {
            positions: rest.iter().map(|p| p.coords).collect(),
            velocities: vec![Vector3::zeros(); n],
            fabric,
            triangles: triangles.to_vec(),
            masses,
            elements,
            bends: bends(rest, triangles, curved),
            anchors: if anchors.stiffness.is_empty() { vec![0.0; n] } else { anchors.stiffness },
            neighbourhood: Neighbourhood::new(rest, triangles),
            pressed: vec![0.0; n],
            carried: Vec::new(),
            system: None,
        })
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
        &self.masses
    }

    /// Corners of the triangles.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Elastic energy (stretch, shear, bending) and kinetic energy, joules.
    pub fn energy(&self) -> [f64; 2] {
        let of_element = |e: &Element| {
            e.area * crate::membrane::energy(&e.deformation(&self.positions), self.fabric.stretch, self.fabric.shear).0
        };
        let elastic: f64 = self.elements.iter().map(of_element).sum();
        let bent: f64 = self.bends.iter().map(|b| b.energy(&self.positions, |_, _| {}) * self.fabric.bending).sum();
        let moving: f64 = self.masses.iter().zip(&self.velocities).map(|(m, v)| 0.5 * m * v.norm_squared()).sum();
        [elastic + bent, moving]
    }

    /// The factorised system for steps of `h` seconds, kept until another length is asked for.
    pub(crate) fn take_system(&mut self, h: f64) -> Result<System, ClothError> {
        match self.system.take() {
            Some(system) if system.step == h => Ok(system),
            _ => System::new(self, h),
        }
    }

    pub(crate) fn put_system(&mut self, system: System) {
        self.system = Some(system);
    }
}

fn check(rest: &[Point3<f64>], triangles: &[[u32; 3]], anchors: &Anchors) -> Result<(), ClothError> {
    let wrong = |reason: String| Err(ClothError::Sheet(reason));
    if let Some(v) = rest.iter().position(|p| !p.coords.iter().all(|c| c.is_finite())) {
        return wrong(format!("vertex {v} is not finite"));
    }
    if let Some(t) = triangles.iter().position(|t| t.iter().any(|&v| v as usize >= rest.len())) {
        return wrong(format!("triangle {t} names a vertex beyond the last of {}", rest.len()));
    }
    let count = anchors.stiffness.len();
    if count != 0 && count != rest.len() {
        return wrong(format!("{} vertices have {count} anchors", rest.len()));
    }
    match anchors.stiffness.iter().position(|k| !(k.is_finite() && *k >= 0.0)) {
        Some(v) => wrong(format!("the anchor of vertex {v} has a stiffness of {}", anchors.stiffness[v])),
        None => Ok(()),
    }
}
