//! The seed's own way: each scan vertex has the label of the nearest vertex of the body (Hu et al. 2017, §6.2).

use nalgebra::Point3;
use rayon::prelude::*;
use toile_character::GarmentType;
use toile_geometry::bvh::Bvh;

use super::{
    template::covered_parts,
    types::{Labels, Reason},
};
use crate::{
    error::GarmentError,
    measure::{
        Measured,
        body_parts::{PART_COUNT, part_shares},
    },
};

/// Log odds where the template decides, nats: as large as evidence and place together can be.
const TEMPLATE_ODDS: f32 = 7.0;

/// Labels of a scan by the template of a type: the rough segmentation that the seed leaves to a painter.
///
/// # Errors
/// [`GarmentError::NoTemplate`] for a type that can be anywhere.
pub(super) fn label_by_nearest_body_vertex(on: &Measured, garment_type: GarmentType) -> Result<Labels, GarmentError> {
    let covered = covered_parts(garment_type).ok_or(GarmentError::NoTemplate(garment_type))?;
    let share = |shares: &[f32; PART_COUNT]| covered.iter().map(|&part| shares[part as usize]).sum::<f32>();
    let on_template: Vec<bool> = part_shares(on.take.weights).iter().map(|shares| share(shares) > 0.5).collect();
    let vertices = point_tree(&on.take.body.positions);
    // Every triangle of the tree is a vertex.
    let nearest =
        |p: &Point3<f32>| vertices.closest(p, f32::INFINITY).is_some_and(|hit| on_template[hit.triangle as usize]);
    let garment: Vec<bool> = on.graph.positions.par_iter().map(nearest).collect();
    let log_odds = garment.iter().map(|&g| if g { TEMPLATE_ODDS } else { -TEMPLATE_ODDS }).collect();
    let count = garment.len();
    Ok(Labels { garment, confidence: vec![1.0; count], log_odds, reasons: vec![Reason::Template; count] })
}

/// A hierarchy whose triangle k is vertex k.
fn point_tree(points: &[Point3<f32>]) -> Bvh {
    let triangles: Vec<[u32; 3]> = (0..points.len() as u32).map(|v| [v; 3]).collect();
    Bvh::new(points, &triangles)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tree_of_points_finds_the_nearest() {
        let at = |k: usize| Point3::new((k as f32 * 0.7).sin(), (k as f32 * 1.3).cos(), (k as f32 * 0.31).sin());
        let points: Vec<Point3<f32>> = (0..200).map(at).collect();
        let tree = point_tree(&points);
        for k in 0..50 {
            let p = at(1000 + k);
            let by_hand = (0..200).min_by(|&a, &b| (points[a] - p).norm().total_cmp(&(points[b] - p).norm()));
            assert_eq!(tree.closest(&p, f32::INFINITY).map(|hit| hit.triangle as usize), by_hand);
        }
    }
}
