//! Boxes seen from far away: dipoles (Barill et al. 2018).

use nalgebra::{Point3, Vector3};

use super::tree::Node;

/// A box seen from far away.
#[derive(Debug, Clone, Copy)]
pub(super) struct FarField {
    /// Sum of area-weighted normals (half cross products).
    pub(super) dipole: Vector3<f32>,
    /// Area-weighted centre.
    pub(super) center: Point3<f32>,
    /// Radius around `center` that holds everything in the box.
    pub(super) radius: f32,
}

/// The far fields of all nodes over `corners` (in the tree's order), whose boxes are up to date. O(n).
pub(super) fn summarise(nodes: &[Node], corners: &[[Point3<f32>; 3]], out: &mut Vec<FarField>) {
    let mut sums = vec![Sum::default(); nodes.len()];
    // Children follow their parents: leaves come first from behind.
    for n in (0..nodes.len()).rev() {
        sums[n] = if nodes[n].count > 0 {
            corners[nodes[n].items()].iter().fold(Sum::default(), Sum::with)
        } else {
            let [l, r] = nodes[n].children(n as u32).map(|c| sums[c as usize]);
            l.merged(&r)
        };
    }
    out.clear();
    out.extend(nodes.iter().zip(&sums).map(|(node, sum)| sum.far_field(node)));
}

/// Sums over the triangles below a node, before division.
#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    dipole: Vector3<f64>,
    /// Sum of centres times areas.
    center: Vector3<f64>,
    area: f64,
}

impl Sum {
    fn with(self, corners: &[Point3<f32>; 3]) -> Self {
        let [a, b, c] = corners.map(|p| p.coords.cast::<f64>());
        let n = (b - a).cross(&(c - a)) * 0.5;
        Self { dipole: self.dipole + n, center: self.center + (a + b + c) / 3.0 * n.norm(), area: self.area + n.norm() }
    }

    fn merged(&self, other: &Self) -> Self {
        Self { dipole: self.dipole + other.dipole, center: self.center + other.center, area: self.area + other.area }
    }

    fn far_field(&self, node: &Node) -> FarField {
        let center = if self.area > 0.0 {
            Point3::from((self.center / self.area).cast::<f32>())
        } else {
            nalgebra::center(&node.lo, &node.hi)
        };
        FarField { dipole: self.dipole.cast(), center, radius: (node.hi - center).sup(&(center - node.lo)).norm() }
    }
}
