//! The texture of a layer: pictures, and where its triangles lie in them.

use toile_geometry::Mesh;

use crate::Picture;

/// The texture of a layer.
///
/// Along borders of charts a vertex lies at more than one place of the picture. The mesh keeps it once; the texture has it
/// once more for each further place, and files have the texture's vertices: the mesh's in their order, then those that stand again.
#[derive(Debug, Clone, PartialEq)]
pub struct LayerTexture {
    /// The mesh's vertex behind each of the texture's: first all of the mesh's in their order.
    pub source: Vec<u32>,
    /// Place of each of the texture's vertices: 0 to 1 to the right, 0 to 1 downwards (glTF's).
    pub uv: Vec<[f32; 2]>,
    /// The mesh's triangles in their order, in vertices of the texture.
    pub triangles: Vec<[u32; 3]>,
    /// Colours, sRGB.
    pub base_color: Picture,
    /// Relief as a tangent-space normal map: +X along u, +Y against v (glTF's).
    pub normal: Option<Picture>,
}

impl LayerTexture {
    /// What is wrong with it as the texture of `mesh`, where anything is.
    pub(crate) fn fault(&self, mesh: &Mesh) -> Option<String> {
        let count = mesh.positions.len();
        if self.source.len() < count || (0u32..).zip(&self.source[..count]).any(|(v, &source)| v != source) {
            return Some(format!("its texture does not begin with its {count} vertices in their order"));
        }
        if self.uv.len() != self.source.len() || self.uv.iter().flatten().any(|c| !c.is_finite()) {
            return Some(format!("its texture has {} vertices, but {} places", self.source.len(), self.uv.len()));
        }
        let source = |&v: &u32| self.source.get(v as usize).copied();
        let is_same = |(own, of_mesh): (&[u32; 3], &[u32; 3])| (0..3).all(|k| source(&own[k]) == Some(of_mesh[k]));
        let fits =
            self.triangles.len() == mesh.triangles.len() && self.triangles.iter().zip(&mesh.triangles).all(is_same);
        (!fits).then(|| "the triangles of its texture are not its own".into())
    }

    /// The texture of a part of the mesh, as [`Mesh::filter_triangles`] makes it: `keep` says which triangles stay, `old_of_new` which vertices.
    pub fn of_part(&self, keep: impl Fn(usize) -> bool, old_of_new: &[u32]) -> Self {
        let mut new_of_old = vec![u32::MAX; self.source.len()];
        let (mut source, mut uv) = (Vec::new(), Vec::new());
        for (new, &old) in (0u32..).zip(old_of_new) {
            new_of_old[old as usize] = new;
            source.push(new);
            uv.push(self.uv[old as usize]);
        }
        let kept: Vec<[u32; 3]> = (0..self.triangles.len()).filter(|&t| keep(t)).map(|t| self.triangles[t]).collect();
        for &v in kept.iter().flatten() {
            if new_of_old[v as usize] == u32::MAX {
                new_of_old[v as usize] = source.len() as u32;
                source.push(new_of_old[self.source[v as usize] as usize]);
                uv.push(self.uv[v as usize]);
            }
        }
        let triangles = kept.iter().map(|t| t.map(|v| new_of_old[v as usize])).collect();
        Self { source, uv, triangles, base_color: self.base_color.clone(), normal: self.normal.clone() }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;

    /// Two triangles over a seam: its two vertices stand again in the second chart.
    fn folded() -> (Mesh, LayerTexture) {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]].map(Point3::from);
        let mesh = Mesh::new(corners.to_vec(), vec![[0, 1, 2], [2, 1, 3]]);
        let texture = LayerTexture {
            source: vec![0, 1, 2, 3, 1, 2],
            uv: vec![[0.0, 0.0], [0.4, 0.0], [0.0, 0.4], [0.9, 0.9], [0.9, 0.5], [0.5, 0.9]],
            triangles: vec![[0, 1, 2], [5, 4, 3]],
            base_color: Picture::Png(Vec::new()),
            normal: None,
        };
        (mesh, texture)
    }

    #[test]
    fn a_texture_must_have_the_vertices_and_triangles_of_its_mesh() {
        let (mesh, texture) = folded();
        assert_eq!(texture.fault(&mesh), None);
        let turned = LayerTexture { triangles: vec![[0, 1, 2], [4, 5, 3]], ..texture.clone() };
        assert!(turned.fault(&mesh).unwrap().contains("triangles"));
        let beyond = LayerTexture { triangles: vec![[0, 1, 2], [9, 4, 3]], ..texture.clone() };
        assert!(beyond.fault(&mesh).unwrap().contains("triangles"));
        let shuffled = LayerTexture { source: vec![1, 0, 2, 3, 1, 2], ..texture.clone() };
        assert!(shuffled.fault(&mesh).unwrap().contains("order"));
        assert!(LayerTexture { uv: vec![[0.0; 2]; 5], ..texture }.fault(&mesh).unwrap().contains("places"));
    }

    #[test]
    fn a_part_keeps_its_places_in_the_picture() {
        let (mesh, texture) = folded();
        let (part, old_of_new) = mesh.filter_triangles(|t| t == 1);
        let kept = texture.of_part(|t| t == 1, &old_of_new);
        assert_eq!(kept.fault(&part), None);
        let places = kept.triangles[0].map(|v| kept.uv[v as usize]);
        assert_eq!(places, texture.triangles[1].map(|v| texture.uv[v as usize]));
    }
}
