//! The true surface of a take: all layers in one mesh.

use nalgebra::Point3;
use toile_character::Region;
use toile_geometry::Mesh;

use crate::subject::Subject;

/// All layers that take `n` shows, in one mesh, in the subject's frame (+Y up, origin on the disk's axis at its top).
#[derive(Debug, Clone)]
pub struct Surface {
    /// Vertices of all layers, coloured, with normals.
    pub mesh: Mesh,
    /// The same vertices in take 0's pose and frame.
    pub in_take_0: Vec<Point3<f32>>,
    /// Layer of each triangle: 0 body, n garment n.
    pub layer: Vec<u8>,
    /// Region of each triangle: 0 torso, 1 arms, 2 legs, 3 hands, feet, head, 255 cloth.
    pub region: Vec<u8>,
}

impl Surface {
    /// Joins posed layers; `posed` and `posed_0` hold the skin and then each garment.
    pub(crate) fn new(subject: &Subject, posed: &[Vec<Point3<f32>>], posed_0: &[Vec<Point3<f32>>]) -> Self {
        let person = &subject.person;
        let garments = subject.garments.iter().map(|g| &g.worn.mesh);
        let mut out =
            Self { mesh: Mesh::default(), in_take_0: posed_0.concat(), layer: Vec::new(), region: Vec::new() };
        for (n, (layer, positions)) in std::iter::once(&person.skin.mesh).chain(garments).zip(posed).enumerate() {
            let first = out.mesh.positions.len() as u32;
            out.mesh.positions.extend(positions);
            out.mesh.colors.extend(&layer.colors);
            for t in &layer.triangles {
                out.mesh.triangles.push(t.map(|v| v + first));
                out.layer.push(n as u8);
                out.region.push(if n == 0 { region_code(person.skin_regions[t[0] as usize]) } else { 255 });
            }
        }
        out.mesh.recompute_normals();
        out
    }

    /// The triangles of one layer, with the vertices that they use, and where each of them was in the whole.
    pub(crate) fn only(&self, layer: u8) -> (Self, Vec<usize>) {
        let kept: Vec<usize> = (0..self.layer.len()).filter(|&t| self.layer[t] == layer).collect();
        let (mesh, old_of_new) = self.mesh.filter_triangles(|t| self.layer[t] == layer);
        let part = Self {
            mesh,
            in_take_0: old_of_new.iter().map(|&v| self.in_take_0[v as usize]).collect(),
            layer: kept.iter().map(|&t| self.layer[t]).collect(),
            region: kept.iter().map(|&t| self.region[t]).collect(),
        };
        (part, kept)
    }
}

fn region_code(region: Region) -> u8 {
    match region {
        Region::Torso => 0,
        Region::LeftArm | Region::RightArm => 1,
        Region::LeftLeg | Region::RightLeg => 2,
        _ => 3,
    }
}
