//! The zero level of a field as a mesh (naive surface nets: Gibson 1998).

use nalgebra::{Point3, Vector3};
use toile_geometry::Mesh;

use crate::field::Field;

const NO_VERTEX: u32 = u32::MAX;

/// Meshes `field` = 0, normals towards positive values. Cells for which `wanted` does not hold are left out. Vertices are
/// then drawn onto the interpolated level.
pub fn mesh(field: &Field, wanted: impl Fn(&Point3<f32>) -> bool) -> Mesh {
    let grid = &field.grid;
    let mut vertex_of_cell = vec![NO_VERTEX; grid.node_count()];
    let mut positions = Vec::new();
    let cells = grid.dims.map(|n| n.saturating_sub(1));
    for z in 0..cells[2] {
        for y in 0..cells[1] {
            for x in 0..cells[0] {
                if let Some(p) = crossing_mean(field, [x, y, z]).filter(|p| wanted(p)) {
                    vertex_of_cell[grid.index([x, y, z])] = positions.len() as u32;
                    positions.push(p);
                }
            }
        }
    }
    let triangles = quads(field, &vertex_of_cell, &positions);
    positions.iter_mut().for_each(|p| *p = drawn_to_level(field, *p));
    Mesh::new(positions, triangles)
}

/// Mean of the points where the level crosses the cell's twelve edges.
fn crossing_mean(field: &Field, cell: [usize; 3]) -> Option<Point3<f32>> {
    let corner = |i: usize| {
        let node = [0, 1, 2].map(|k| cell[k] + (i >> k & 1));
        (field.values[field.grid.index(node)], field.grid.position(node))
    };
    let (mut sum, mut count) = (Vector3::zeros(), 0);
    for i in 0..8 {
        for k in (0..3).filter(|k| i >> k & 1 == 0) {
            let ((a, p), (b, q)) = (corner(i), corner(i | 1 << k));
            if (a < 0.0) != (b < 0.0) {
                sum += p.coords + (q - p) * (a / (a - b));
                count += 1;
            }
        }
    }
    (count > 0).then(|| Point3::from(sum / count as f32))
}

/// For each grid edge that the level crosses, the quad of the four cells around it, split at its shorter diagonal.
fn quads(field: &Field, vertex_of_cell: &[u32], positions: &[Point3<f32>]) -> Vec<[u32; 3]> {
    let grid = &field.grid;
    let mut triangles = Vec::new();
    for i in 0..grid.node_count() {
        let node = grid.node(i);
        for k in 0..3 {
            let (u, v) = ((k + 1) % 3, (k + 2) % 3);
            if node[k] + 1 >= grid.dims[k] || node[u] == 0 || node[v] == 0 {
                continue;
            }
            let mut next = node;
            next[k] += 1;
            let inside = field.values[i] < 0.0;
            if inside == (field.values[grid.index(next)] < 0.0) {
                continue;
            }
            let around = [[1, 1], [0, 1], [0, 0], [1, 0]].map(|[du, dv]| {
                let mut cell = node;
                cell[u] -= du;
                cell[v] -= dv;
                vertex_of_cell[grid.index(cell)]
            });
            push_quad(around, inside, positions, &mut triangles);
        }
    }
    triangles
}

fn push_quad(corners: [u32; 4], keep_order: bool, positions: &[Point3<f32>], triangles: &mut Vec<[u32; 3]>) {
    if corners.contains(&NO_VERTEX) {
        return;
    }
    let [a, b, c, d] = if keep_order { corners } else { [corners[3], corners[2], corners[1], corners[0]] };
    let length = |p: u32, q: u32| (positions[p as usize] - positions[q as usize]).norm_squared();
    let split = if length(a, c) <= length(b, d) { [[a, b, c], [a, c, d]] } else { [[b, c, d], [b, d, a]] };
    triangles.extend(split);
}

/// A few Newton steps along the gradient, no farther than a cell.
fn drawn_to_level(field: &Field, start: Point3<f32>) -> Point3<f32> {
    let mut p = start;
    for _ in 0..3 {
        let g = field.gradient(&p);
        let step = g * (field.sample(&p) / g.norm_squared().max(0.05));
        p -= step.cap_magnitude(0.5 * field.grid.cell);
    }
    if (p - start).norm() <= field.grid.cell { p } else { start }
}

#[cfg(test)]
mod tests {
    use toile_geometry::topology::Edges;

    use super::*;
    use crate::field::Grid;

    #[test]
    fn a_ball_comes_out_closed_round_and_outward() {
        let grid = Grid::covering(Point3::new(-1.0, -1.0, -1.0), Point3::new(1.0, 1.0, 1.0), 0.3, 0.1);
        let ball = Field::from_fn(&grid, |_, p| p.coords.norm() - 0.93);
        let mesh = mesh(&ball, |_| true);
        assert!(Edges::new(&mesh.triangles).is_closed());
        assert!(mesh.positions.iter().all(|p| (p.coords.norm() - 0.93).abs() < 0.004));
        assert!((mesh.signed_volume() - 4.0 / 3.0 * std::f64::consts::PI * 0.93f64.powi(3)).abs() < 0.06);
    }
}
