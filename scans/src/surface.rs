//! A surface as a file gives it.

use std::{collections::HashMap, sync::Arc};

use image::RgbImage;
use nalgebra::Point3;

/// A surface as a file gives it, in the file's own units and axes.
///
/// `colors` is empty or as long as `positions`; `texture_coordinates` and `material_of` are empty or as long as `triangles`.
#[derive(Debug, Clone, Default)]
pub struct Surface {
    /// Vertex positions.
    pub positions: Vec<Point3<f32>>,
    /// Vertex indices of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// sRGB vertex colours, or empty.
    pub colors: Vec<[u8; 3]>,
    /// Where in its picture each corner of a triangle lies: shares of the width from the left and of the height from the
    /// top; or empty.
    pub texture_coordinates: Vec<[[f32; 2]; 3]>,
    /// Which of the materials each triangle has, or empty.
    pub material_of: Vec<u32>,
    /// The materials.
    pub materials: Vec<Material>,
    /// What could not be read or was left out, a sentence each.
    pub notices: Vec<String>,
}

/// The colour of triangles.
#[derive(Debug, Clone, Default)]
pub struct Material {
    /// Its name in the file.
    pub name: String,
    /// Its colour, sRGB, where it has no picture.
    pub color: Option<[u8; 3]>,
    /// Its picture.
    pub picture: Option<Arc<RgbImage>>,
}

impl Surface {
    /// Positions and triangles alone.
    pub fn new(positions: Vec<Point3<f32>>, triangles: Vec<[u32; 3]>) -> Self {
        Self { positions, triangles, ..Self::default() }
    }

    /// Checks indices, the lengths of lists, and that all positions are finite.
    ///
    /// # Errors
    /// A sentence that names the first rule that is broken.
    pub fn validate(&self) -> Result<(), String> {
        if self.triangles.is_empty() {
            return Err("holds no triangles: export the surface, not only its points".into());
        }
        let count = self.positions.len();
        if let Some(t) = self.triangles.iter().position(|t| t.iter().any(|&v| v as usize >= count)) {
            return Err(format!("triangle {t} names a vertex beyond the last of {count}"));
        }
        if let Some(v) = self.positions.iter().position(|p| !p.coords.iter().all(|c| c.is_finite())) {
            return Err(format!("vertex {v} is not finite"));
        }
        let fits = |length: usize, all: usize| length == 0 || length == all;
        let of_triangles = [self.texture_coordinates.len(), self.material_of.len()];
        if !fits(self.colors.len(), count) || !of_triangles.iter().all(|&n| fits(n, self.triangles.len())) {
            return Err("its colours or texture coordinates do not match its vertices and triangles".into());
        }
        if self.material_of.iter().any(|&m| m as usize >= self.materials.len()) {
            return Err("a triangle names a material that is not there".into());
        }
        Ok(())
    }

    /// True where it says which colours its surface has.
    pub fn has_colors(&self) -> bool {
        let by_material =
            |m: &Material| m.color.is_some() || (m.picture.is_some() && !self.texture_coordinates.is_empty());
        !self.colors.is_empty() || self.materials.iter().any(by_material)
    }

    /// The sRGB colour of triangle `t` at the barycentric coordinates `w`: of its picture, of its vertices, or of its
    /// material, whichever there is first; `None` where there is none.
    pub fn color_at(&self, t: usize, w: [f32; 3]) -> Option<[u8; 3]> {
        let material = self.material_of.get(t).and_then(|&m| self.materials.get(m as usize));
        let picture = material.and_then(|m| m.picture.as_deref());
        if let (Some(picture), Some(corners)) = (picture, self.texture_coordinates.get(t)) {
            return Some(sample(picture, [0, 1].map(|k| (0..3).map(|c| w[c] * corners[c][k]).sum())));
        }
        if !self.colors.is_empty() {
            let corners = self.triangles[t].map(|v| self.colors[v as usize].map(f32::from));
            return Some([0, 1, 2].map(|k| (0..3).map(|c| w[c] * corners[c][k]).sum::<f32>().round() as u8));
        }
        material.and_then(|m| m.color)
    }

    /// Makes vertices at the very same place one, as long as all of them have the same colour or none.
    pub(crate) fn weld(&mut self) {
        let mut index_of: HashMap<([u32; 3], [u8; 3]), u32> = HashMap::with_capacity(self.positions.len());
        let (mut positions, mut colors) = (Vec::new(), Vec::new());
        let mut new_of_old = Vec::with_capacity(self.positions.len());
        for (v, p) in self.positions.iter().enumerate() {
            let color = self.colors.get(v).copied();
            // Adding 0 makes -0 and 0 the same.
            let key = ([p.x, p.y, p.z].map(|c| (c + 0.0).to_bits()), color.unwrap_or_default());
            let new = *index_of.entry(key).or_insert(positions.len() as u32);
            if new as usize == positions.len() {
                positions.push(*p);
                colors.extend(color);
            }
            new_of_old.push(new);
        }
        self.triangles.iter_mut().for_each(|t| *t = t.map(|v| new_of_old[v as usize]));
        (self.positions, self.colors) = (positions, colors);
    }
}

/// The picture's colour at shares of its width and height, between its four nearest pixels; it repeats beyond its borders.
fn sample(picture: &RgbImage, [u, v]: [f32; 2]) -> [u8; 3] {
    let (width, height) = picture.dimensions();
    let place = |share: f32, size: u32| {
        let at = share.rem_euclid(1.0) * size as f32 - 0.5;
        let low = at.floor();
        (low as i64, at - low)
    };
    let ((x, fx), (y, fy)) = (place(u, width), place(v, height));
    let wrap = |i: i64, size: u32| i.rem_euclid(i64::from(size)) as u32;
    let pixel = |dx, dy| picture.get_pixel(wrap(x + dx, width), wrap(y + dy, height)).0.map(f32::from);
    let [a, b, c, d] = [pixel(0, 0), pixel(1, 0), pixel(0, 1), pixel(1, 1)];
    [0, 1, 2].map(|k| {
        let (top, bottom) = (a[k] + fx * (b[k] - a[k]), c[k] + fx * (d[k] - c[k]));
        (top + fy * (bottom - top)).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_come_from_the_picture_then_from_vertices_then_from_the_material() {
        let p = |x, y| Point3::new(x, y, 0.0);
        let mut surface = Surface::new(vec![p(0.0, 0.0), p(1.0, 0.0), p(0.0, 1.0)], vec![[0, 1, 2]]);
        assert_eq!((surface.color_at(0, [1.0, 0.0, 0.0]), surface.has_colors()), (None, false));
        surface.materials = vec![Material { color: Some([9; 3]), ..Material::default() }];
        surface.material_of = vec![0];
        assert_eq!(surface.color_at(0, [1.0, 0.0, 0.0]), Some([9; 3]));
        surface.colors = vec![[0; 3], [100; 3], [200; 3]];
        assert_eq!(surface.color_at(0, [0.0, 0.5, 0.5]), Some([150; 3]));
        let mut picture = RgbImage::new(2, 2);
        picture.put_pixel(1, 0, image::Rgb([250, 0, 0]));
        surface.materials[0].picture = Some(Arc::new(picture));
        surface.texture_coordinates = vec![[[0.75, 0.25], [1.75, -0.75], [0.25, 0.25]]];
        assert_eq!(surface.color_at(0, [1.0, 0.0, 0.0]), Some([250, 0, 0]), "the right upper pixel");
        assert_eq!(surface.color_at(0, [0.0, 1.0, 0.0]), Some([250, 0, 0]), "a picture repeats");
        assert_eq!(surface.color_at(0, [0.5, 0.0, 0.5]), Some([125, 0, 0]), "between two pixels");
    }

    #[test]
    fn vertices_at_one_place_become_one() {
        let p = |x: f32| Point3::new(x, 0.0, 1.0);
        let mut surface =
            Surface::new(vec![p(0.0), p(1.0), p(2.0), p(-0.0), p(1.0), p(3.0)], vec![[0, 1, 2], [4, 3, 5]]);
        surface.weld();
        assert_eq!((surface.positions.len(), surface.triangles), (4, vec![[0, 1, 2], [1, 0, 3]]));
    }
}
