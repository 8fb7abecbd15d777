//! What a sheet is at rest.

use nalgebra::{Point3, Vector3};

use crate::{
    ClothError, Fabric,
    bending::{Bend, bends},
    membrane::Element,
};

/// Springs of zero length from each vertex to a place of its own.
#[derive(Debug, Clone, Default)]
pub struct Anchors {
    /// Stiffness of each vertex's spring, N/m; 0 for a vertex that is free. Empty: all are free.
    pub stiffness: Vec<f64>,
}

/// The shape of a sheet at rest.
#[derive(Debug, Clone, Copy)]
pub struct RestShape<'a> {
    /// Places of the vertices, metres.
    pub positions: &'a [Point3<f64>],
    /// Corners of the triangles.
    pub triangles: &'a [[u32; 3]],
    /// Whether the sheet keeps the bends of this shape (a garment as it was scanned); otherwise it wants to be flat.
    pub curved: bool,
    /// The warp runs along this direction as far as a triangle's plane allows.
    pub grain: Vector3<f64>,
}

/// What does not change while a sheet moves.
#[derive(Debug, Clone)]
pub(crate) struct Rest {
    pub fabric: Fabric,
    pub triangles: Vec<[u32; 3]>,
    /// Mass of each vertex, kg.
    pub masses: Vec<f64>,
    pub elements: Vec<Element>,
    pub bends: Vec<Bend>,
    /// Stiffness of each vertex's anchor, N/m.
    pub anchors: Vec<f64>,
}

impl Rest {
    pub fn new(shape: &RestShape, fabric: Fabric, anchors: Anchors) -> Result<Self, ClothError> {
        let RestShape { positions: rest, triangles, curved, grain } = *shape;
        fabric.check("of the sheet")?;
        check(rest, triangles, &anchors)?;
        let corners = |t: &[u32; 3]| t.map(|v| rest[v as usize]);
        let elements: Vec<Element> = triangles.iter().filter_map(|t| Element::new(*t, corners(t), &grain)).collect();
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
        let (bends, triangles) = (bends(rest, triangles, curved), triangles.to_vec());
        let anchors = if anchors.stiffness.is_empty() { vec![0.0; rest.len()] } else { anchors.stiffness };
        Ok(Self { fabric, triangles, masses, elements, bends, anchors })
    }

    /// Puts other anchors in place of those that there are.
    pub fn tie(&mut self, anchors: Anchors) -> Result<(), ClothError> {
        check_anchors(self.len(), &anchors)?;
        self.anchors = if anchors.stiffness.is_empty() { vec![0.0; self.len()] } else { anchors.stiffness };
        Ok(())
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.masses.len()
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
    check_anchors(rest.len(), anchors)
}

fn check_anchors(vertices: usize, anchors: &Anchors) -> Result<(), ClothError> {
    let wrong = |reason: String| Err(ClothError::Sheet(reason));
    let count = anchors.stiffness.len();
    if count != 0 && count != vertices {
        return wrong(format!("{vertices} vertices have {count} anchors"));
    }
    match anchors.stiffness.iter().position(|k| !(k.is_finite() && *k >= 0.0)) {
        Some(v) => wrong(format!("the anchor of vertex {v} has a stiffness of {}", anchors.stiffness[v])),
        None => Ok(()),
    }
}
