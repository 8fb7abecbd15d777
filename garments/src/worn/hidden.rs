//! Triangles of the body and of lower layers that clothes hide for good, so that an export may leave them out.

use std::f32::consts::TAU;

use nalgebra::{Point3, Rotation3, Unit, Vector3};
use rayon::prelude::*;
use toile_geometry::{Mesh, bvh::Bvh, edge_distance::distances_along_edges, topology::VertexNeighbors};

use super::posed::Worn;
use crate::{
    error::GarmentError,
    measure::body_parts::{BodyPart, part_shares},
    settings::CullSettings,
};

/// Angle from the normal, degrees, and number of the rays. The flattest come first, as they are the first to escape.
/// Flatter ones would escape below most cloth; the margin covers views from there.
const RINGS: [(f32, usize); 4] = [(65.0, 12), (45.0, 9), (20.0, 6), (0.0, 1)];
/// Parts that are never left out: they touch things or are looked at.
const ALWAYS_SHOWN: [BodyPart; 3] = [BodyPart::Head, BodyPart::Hand, BodyPart::Foot];
/// From this share of such parts on a vertex belongs to them.
const SHOWN_SHARE: f32 = 0.5;

/// Marks the triangles of each layer (the body first, then inside to outside, all in one pose) that layers further out
/// hide.
///
/// A fixed set of rays goes out from the centre of a triangle over its hemisphere. Each must meet a layer within
/// `settings.reach`, and the first one that it meets from that layer's inner side: what only a sleeve beside it covers is in
/// sight when the arm is raised. Triangles nearer than `settings.margin` to a vertex in sight, along edges (up to 15 %
/// longer than the straight way), are kept, as are head, hands and feet with the same margin. Nothing of the outermost
/// layer is marked. O(n log n).
///
/// # Errors
/// [`GarmentError::Mismatch`] where a layer does not have weights for each vertex, [`GarmentError::Settings`] where a setting
/// is outside of its range.
pub fn hidden_triangles(layers: &[Worn], settings: &CullSettings) -> Result<Vec<Vec<bool>>, GarmentError> {
    settings.check()?;
    if let Some(k) = layers.iter().position(|l| l.mesh.positions.len() != l.weights.len()) {
        let (vertices, weights) = (layers[k].mesh.positions.len(), layers[k].weights.len());
        return Err(GarmentError::Mismatch(format!("layer {k} has {vertices} vertices but weights for {weights}")));
    }
    let marked = layers.iter().enumerate().map(|(k, layer)| {
        let outer = outer_layers(&layers[k + 1..]);
        let covered = covered_triangles(layer.mesh, &outer, settings.reach);
        let mut in_sight = always_shown(layer);
        for (triangle, _) in layer.mesh.triangles.iter().zip(&covered).filter(|(_, covered)| !**covered) {
            triangle.iter().for_each(|&v| in_sight[v as usize] = true);
        }
        let far = beyond(layer.mesh, &in_sight, settings.margin);
        layer.mesh.triangles.iter().map(|t| t.iter().all(|&v| far[v as usize])).collect()
    });
    Ok(marked.collect())
}

/// All triangles of `layers` in one mesh.
fn outer_layers(layers: &[Worn]) -> Mesh {
    let mut all = Mesh::default();
    for layer in layers {
        let start = all.positions.len() as u32;
        all.positions.extend(&layer.mesh.positions);
        all.triangles.extend(layer.mesh.triangles.iter().map(|t| t.map(|v| v + start)));
    }
    all
}

/// True for each triangle whose rays all end at the inner side of `outer`.
fn covered_triangles(mesh: &Mesh, outer: &Mesh, reach: f32) -> Vec<bool> {
    let tree = Bvh::new(&outer.positions, &outer.triangles);
    let (normals, directions) = (outer.triangle_normals(), directions());
    let hit_inside = |from: &Point3<f32>, direction: &Vector3<f32>| {
        tree.ray(from, direction, reach).is_some_and(|hit| normals[hit.triangle as usize].dot(direction) > 0.0)
    };
    let own_normals = mesh.triangle_normals();
    (0..mesh.triangles.len())
        .into_par_iter()
        .map(|t| {
            let [a, b, c] = mesh.corners(t);
            let center = Point3::from((a.coords + b.coords + c.coords) / 3.0);
            let Some(normal) = Unit::try_new(own_normals[t], 0.5) else { return true };
            let turn = world_from_normal(&normal);
            directions.iter().all(|d| hit_inside(&center, &(turn * d)))
        })
        .collect()
}

/// Unit directions over the hemisphere around +Z.
fn directions() -> Vec<Vector3<f32>> {
    let ring = |&(angle, count): &(f32, usize)| {
        let (sin, cos) = angle.to_radians().sin_cos();
        (0..count).map(move |k| {
            let (y, x) = (TAU * k as f32 / count as f32).sin_cos();
            Vector3::new(sin * x, sin * y, cos)
        })
    };
    RINGS.iter().flat_map(ring).collect()
}

/// A turn that takes +Z to `normal`.
fn world_from_normal(normal: &Unit<Vector3<f32>>) -> Rotation3<f32> {
    // any turn will do where the normal is -Z
    Rotation3::rotation_between(&Vector3::z(), normal)
        .unwrap_or_else(|| Rotation3::from_axis_angle(&Vector3::x_axis(), TAU / 2.0))
}

/// True for the vertices of head, hands and feet.
fn always_shown(layer: &Worn) -> Vec<bool> {
    let shown = |shares: &[f32]| ALWAYS_SHOWN.iter().map(|&part| shares[part as usize]).sum::<f32>() >= SHOWN_SHARE;
    part_shares(layer.weights).iter().map(|shares| shown(shares)).collect()
}

/// True for the vertices at least `margin` metres from all of `sources`, along edges.
fn beyond(mesh: &Mesh, sources: &[bool], margin: f32) -> Vec<bool> {
    let neighbors = VertexNeighbors::new(mesh.positions.len(), &mesh.triangles);
    let starts = (0u32..).zip(sources).filter(|(_, source)| **source).map(|(v, _)| v);
    let distances = distances_along_edges(&mesh.positions, &neighbors, starts, margin, |_| true);
    distances.iter().map(|d| *d >= margin && *d > 0.0).collect()
}

#[cfg(test)]
mod tests {
    use toile_character::{Joint, SkinWeights, joint::JOINTS};

    use super::*;

    const RADIUS: f32 = 0.1;
    const SIDES: usize = 48;

    /// A tube around +Y, facing outwards, a ring of vertices every 20 mm from `from` mm to `to` mm.
    fn tube(radius: f32, from: usize, to: usize) -> Mesh {
        let heights: Vec<usize> = (from..=to).step_by(20).collect();
        let ring = |&y: &usize| {
            (0..SIDES).map(move |k| {
                let (sin, cos) = (TAU * k as f32 / SIDES as f32).sin_cos();
                Point3::new(radius * sin, y as f32 * 1e-3, radius * cos)
            })
        };
        let corner = |row: usize, k: usize| (row * SIDES + k % SIDES) as u32;
        let cell = |(row, k): (usize, usize)| {
            let [a, b, c, d] = [corner(row, k), corner(row, k + 1), corner(row + 1, k), corner(row + 1, k + 1)];
            [[a, b, d], [a, d, c]]
        };
        let cells = (0..heights.len() - 1).flat_map(|row| (0..SIDES).map(move |k| (row, k)));
        Mesh::new(heights.iter().flat_map(ring).collect(), cells.flat_map(cell).collect())
    }

    fn on(joint: Joint, mesh: &Mesh) -> SkinWeights {
        let joint = JOINTS.iter().position(|&j| j == joint).unwrap() as u8;
        let mut weights = SkinWeights::default();
        mesh.positions.iter().for_each(|_| weights.push(&[(joint, 1.0)]));
        weights
    }

    /// Lowest and highest height, mm, of the marked triangles of the lowest layer, and how many there are.
    fn marked(joint: Joint, meshes: &[&Mesh], settings: &CullSettings) -> Option<(i32, i32, usize)> {
        let weights: Vec<SkinWeights> = meshes.iter().map(|m| on(joint, m)).collect();
        let worn: Vec<Worn> = meshes.iter().zip(&weights).map(|(mesh, weights)| Worn { mesh, weights }).collect();
        let marks = hidden_triangles(&worn, settings).unwrap();
        assert!(marks.last().unwrap().iter().all(|hidden| !hidden), "the outermost layer is always in sight");
        let triangles: Vec<usize> = (0..marks[0].len()).filter(|&t| marks[0][t]).collect();
        let heights = triangles.iter().flat_map(|&t| meshes[0].corners(t).map(|p| (p.y * 1e3).round() as i32));
        let (low, high) = (heights.clone().min()?, heights.max()?);
        Some((low, high, triangles.len()))
    }

    #[test]
    fn under_a_sleeve_the_middle_is_hidden_and_a_margin_is_kept() {
        // rays at 65° from 2 mm below the cloth need 4.3 mm of it: the cells from 200 mm to 600 mm are covered
        let (arm, sleeve) = (tube(RADIUS, 0, 800), tube(RADIUS + 0.002, 190, 610));
        let with = |margin: f32| {
            let settings = CullSettings { margin, ..CullSettings::default() };
            marked(Joint::LeftUpperArm, &[&arm, &sleeve], &settings)
        };
        let cells = |low: usize, high: usize| Some((low as i32, high as i32, (high - low) / 20 * 2 * SIDES));
        // vertices at the border of what is covered are in sight themselves
        assert_eq!(with(0.0), cells(220, 580));
        assert_eq!(with(0.03), cells(240, 560));
        assert_eq!(with(0.05), cells(260, 540));
        assert_eq!(with(0.3), None);
    }

    #[test]
    fn hands_feet_and_head_are_kept_whatever_covers_them() {
        let (inner, outer) = (tube(RADIUS, 0, 800), tube(RADIUS + 0.002, 190, 610));
        for joint in [Joint::Head, Joint::LeftHand, Joint::RightIndexDistal, Joint::LeftToes] {
            assert_eq!(marked(joint, &[&inner, &outer], &CullSettings::default()), None, "{joint:?}");
        }
    }

    #[test]
    fn loose_and_open_cloth_hides_nothing() {
        let settings = CullSettings::default();
        let body = tube(RADIUS, 0, 800);
        // flat rays along the tube need 0.05 / cos 65° = 0.12 m
        assert_eq!(marked(Joint::Hips, &[&body, &tube(RADIUS + 0.05, 0, 800)], &settings), None);
        let mut open = tube(RADIUS + 0.002, 190, 610);
        let (closed, ()) = (open.clone(), open.triangles.retain(|t| t[0] as usize % SIDES >= SIDES / 4));
        let (all, part) =
            (marked(Joint::Hips, &[&body, &closed], &settings), marked(Joint::Hips, &[&body, &open], &settings));
        let (all, part) = (all.unwrap().2, part.unwrap().2);
        assert!(part < all * 3 / 4 && part > all / 2, "{part} of {all}");
    }

    #[test]
    fn what_lies_beside_a_sleeve_is_in_sight() {
        // cloth all around, but facing inwards: seen from there it is the outer side of something else
        let (body, mut beside) = (tube(RADIUS, 0, 800), tube(RADIUS + 0.002, 190, 610));
        beside.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        assert_eq!(marked(Joint::Hips, &[&body, &beside], &CullSettings::default()), None);
    }

    #[test]
    fn layers_hide_together() {
        let body = tube(RADIUS, 0, 800);
        let (low, high) = (tube(RADIUS + 0.002, 190, 410), tube(RADIUS + 0.004, 390, 610));
        let found = marked(Joint::Hips, &[&body, &low, &high], &CullSettings::default());
        assert_eq!(found, Some((240, 560, 16 * 2 * SIDES)));
    }

    #[test]
    fn weights_must_be_those_of_the_mesh() {
        let (mesh, weights) = (tube(RADIUS, 0, 100), SkinWeights::default());
        let worn = [Worn { mesh: &mesh, weights: &weights }];
        assert!(matches!(hidden_triangles(&worn, &CullSettings::default()), Err(GarmentError::Mismatch(_))));
    }
}
