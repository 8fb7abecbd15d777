//! Where each triangle of a mesh lies in its texture.

use toile_geometry::Mesh;

use crate::pack::{Flat, Place};

/// Where each triangle of a mesh lies in the texture.
#[derive(Debug, Clone, PartialEq)]
pub struct Atlas {
    /// Edge of the picture, texels.
    pub size: u32,
    /// The mesh's vertex behind each vertex of the atlas; those on the border of charts come more than once.
    pub source: Vec<u32>,
    /// Place of each vertex: 0 to 1 to the right, 0 to 1 downwards (glTF's).
    pub uv: Vec<[f32; 2]>,
    /// The mesh's triangles in their order, in vertices of the atlas.
    pub triangles: Vec<[u32; 3]>,
    /// Number of charts.
    pub charts: usize,
}

impl Atlas {
    pub(crate) fn new(mesh: &Mesh, flats: &[Flat], places: &[Place], scale: f32, size: u32) -> Self {
        let mut atlas = Self {
            size,
            source: Vec::with_capacity(mesh.positions.len() * 5 / 4),
            uv: Vec::new(),
            triangles: vec![[0; 3]; mesh.triangles.len()],
            charts: flats.len(),
        };
        // The vertex of the atlas for each of the mesh's, and the chart that it is of.
        let mut made = vec![(u32::MAX, 0u32); mesh.positions.len()];
        for (chart, (flat, place)) in flats.iter().zip(places).enumerate() {
            for &t in &flat.triangles {
                atlas.triangles[t as usize] = mesh.triangles[t as usize].map(|v| {
                    if made[v as usize].0 != chart as u32 {
                        made[v as usize] = (chart as u32, atlas.source.len() as u32);
                        atlas.source.push(v);
                        let texel = flat.texel(&mesh.positions[v as usize], *place, scale);
                        atlas.uv.push(texel.map(|x| x / size as f32));
                    }
                    made[v as usize].1
                });
            }
        }
        atlas
    }

    /// The same atlas for a picture of another size.
    pub fn sized(self, size: u32) -> Self {
        Self { size, ..self }
    }

    /// The same atlas with the mesh's `vertices` first and in their order, so that what is known of them stays true of the atlas; those that
    /// stand again beyond a border of charts follow.
    pub fn in_order(self, vertices: usize) -> Self {
        let mut new_of_old = vec![u32::MAX; self.source.len()];
        let (mut source, mut uv) = ((0..vertices as u32).collect::<Vec<_>>(), vec![[0.0; 2]; vertices]);
        let mut is_taken = vec![false; vertices];
        for (old, &v) in self.source.iter().enumerate() {
            let is_again = std::mem::replace(&mut is_taken[v as usize], true);
            new_of_old[old] = if is_again { source.len() as u32 } else { v };
            if is_again {
                source.push(v);
                uv.push(self.uv[old]);
            } else {
                uv[v as usize] = self.uv[old];
            }
        }
        let triangles = self.triangles.iter().map(|t| t.map(|v| new_of_old[v as usize])).collect();
        Self { source, uv, triangles, ..self }
    }

    /// Corners of a triangle in texels: (0, 0) is the outer corner of the first one.
    pub(crate) fn texels(&self, triangle: usize) -> [[f32; 2]; 3] {
        let size = self.size as f32;
        self.triangles[triangle].map(|v| self.uv[v as usize].map(|c| c * size))
    }

    /// Share of the texels that triangles cover, 0 to 1.
    pub fn used(&self) -> f64 {
        let covered: f64 = (0..self.triangles.len()).map(|t| f64::from(area(self.texels(t)).abs())).sum();
        covered / f64::from(self.size).powi(2)
    }

    /// Millimetres on `mesh` that a texel is long, on average over the area.
    pub fn millimetres(&self, mesh: &Mesh) -> f64 {
        (mesh.area() * 1e6 / (self.used() * f64::from(self.size).powi(2)).max(1.0)).sqrt()
    }
}

/// Signed area, square texels.
pub(crate) fn area([a, b, c]: [[f32; 2]; 3]) -> f32 {
    0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]))
}
