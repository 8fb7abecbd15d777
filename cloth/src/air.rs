//! The air's resistance.

use nalgebra::Vector3;
use toile_geometry::mesh::vertex_normals;

use crate::Sheet;

/// Density of air at 20 °C and sea level, kg/m³.
const DENSITY: f64 = 1.204;
/// Drag of a flat plate across the wind (S. F. Hoerner 1965, "Fluid-dynamic drag", 3-16).
const PLATE: f64 = 1.17;

/// Slows `velocities` against `wind` over `h` seconds, along each vertex's normal: v' + k v'² = v, with k of the plate's drag.
/// Solved exactly, so that no step is too long.
pub(crate) fn slow_down(sheet: &Sheet, velocities: &mut [Vector3<f64>], wind: &Vector3<f64>, h: f64) {
    let points: Vec<nalgebra::Point3<f32>> = sheet.positions.iter().map(|p| p.cast::<f32>().into()).collect();
    let normals = vertex_normals(&points, &sheet.rest.triangles);
    for (v, (velocity, normal)) in velocities.iter_mut().zip(normals).enumerate() {
        let normal = normal.cast::<f64>();
        let across = (*velocity - wind).dot(&normal);
        // Mass over area is the fabric's density.
        let k = 0.5 * DENSITY * PLATE * h / sheet.rest.fabric.density;
        let slowed = ((1.0 + 4.0 * k * across.abs()).sqrt() - 1.0) / (2.0 * k);
        *velocity -= normal * (across.signum() * (across.abs() - slowed));
        debug_assert!(velocity.iter().all(|c| c.is_finite()), "vertex {v}");
    }
}
