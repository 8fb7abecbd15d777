//! Parts of a draft that are not the garment's: small pieces, and strips that fusion spun across openings.

use toile_geometry::{
    areas::triangle_area,
    rims::grow,
    topology::{VertexNeighbors, boundary_loops, vertex_components},
};

use super::draft::{Channel, Draft};

/// Rings around the inside of a mesh that are not part of a strip.
const STRIP_REACH: usize = 3;
/// A vertex between others is said to belong, or not to, from this share of [`Channel::ByHand`] on.
pub(super) const SAID: f32 = 0.3;

/// The draft without pieces smaller than `share` of its largest one (by area), except for those that strokes added.
pub(super) fn keep_large_pieces(draft: &Draft, share: f32) -> Draft {
    let mesh = &draft.surface;
    let (set, count) = vertex_components(mesh.positions.len(), &mesh.triangles);
    let mut areas = vec![0.0f32; count];
    for (t, tri) in mesh.triangles.iter().enumerate() {
        areas[set[tri[0] as usize] as usize] += triangle_area(mesh.corners(t));
    }
    let largest = areas.iter().copied().fold(0.0, f32::max);
    let mut kept: Vec<bool> = areas.iter().map(|a| *a >= share * largest).collect();
    let by_hand = draft.channels[Channel::ByHand].iter().zip(&set);
    by_hand.filter(|(said, _)| **said > SAID).for_each(|(_, s)| kept[*s as usize] = true);
    draft.filter(|t| kept[set[mesh.triangles[t][0] as usize] as usize])
}

/// The draft without strips of a few triangles' width. Vertices stay that lie within [`STRIP_REACH`] rings of one that
/// is further than one ring from every rim, and those that strokes added.
pub(super) fn drop_strips(draft: &Draft) -> Draft {
    let mesh = &draft.surface;
    let neighbors = VertexNeighbors::new(mesh.positions.len(), &mesh.triangles);
    let rims: Vec<u32> = boundary_loops(&mesh.triangles).concat();
    let mut inner = vec![true; mesh.positions.len()];
    grow(rims, &neighbors, 1).iter().for_each(|&v| inner[v as usize] = false);
    let core: Vec<u32> = (0..mesh.positions.len() as u32).filter(|&v| inner[v as usize]).collect();
    let mut kept: Vec<bool> = draft.channels[Channel::ByHand].iter().map(|said| *said > SAID).collect();
    grow(core, &neighbors, STRIP_REACH).iter().for_each(|&v| kept[v as usize] = true);
    draft.filter(|t| mesh.triangles[t].iter().all(|&v| kept[v as usize]))
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;
    use toile_geometry::Mesh;

    use super::*;

    #[test]
    fn a_thread_across_a_hole_is_dropped_and_the_sheet_stays() {
        let n = 31u32;
        let at = |i: u32| Point3::new((i % n) as f32 * 0.006, (i / n) as f32 * 0.006, 0.0);
        let triangles = (0..n - 1)
            .flat_map(|j| (0..n - 1).map(move |i| j * n + i))
            .flat_map(|a| [[a, a + 1, a + n + 1], [a, a + n + 1, a + n]])
            .collect();
        let sheet = Draft::of(&Mesh::new((0..n * n).map(at).collect(), triangles));
        // At most the tips of its corners are lost.
        assert!(drop_strips(&sheet).surface.triangles.len() + 4 >= sheet.surface.triangles.len());
        let far = |p: &Point3<f32>| (p - Point3::new(0.09, 0.09, 0.0)).norm() > 0.05 || (p.x - 0.09).abs() < 0.007;
        let threaded = sheet.filter(|t| sheet.surface.corners(t).iter().all(far));
        assert_eq!(boundary_loops(&threaded.surface.triangles).len(), 3);
        assert_eq!(boundary_loops(&drop_strips(&threaded).surface.triangles).len(), 2);
    }
}
