//! Holes closed: those that something hid, and small ones.

use nalgebra::Point3;
use toile_geometry::{
    polygon::triangulate,
    topology::{boundary_loops, loop_length},
};

use super::{
    draft::{Channel, Draft},
    pieces::SAID,
};
use crate::{
    labels::closed_patches::SURROUNDED,
    measure::bones::{Bone, passes},
};

/// Loops with more vertices than this are not closed: triangulating costs the cube.
const MAX_RIM_VERTICES: usize = 450;

/// Closes the scan's own holes whose rims belong to the garment all round, unless a bone passes through them: what
/// another garment, an arm or the camera's angle hid.
pub(super) fn close_hidden(draft: &mut Draft, garment: &[bool], bones: &[Bone]) {
    let belongs = |rim: &[u32]| {
        let inside = rim.iter().filter(|&&v| garment[v as usize]).count();
        inside as f64 > SURROUNDED * rim.len() as f64
    };
    fill_where(draft, |draft, rim| belongs(rim) && !passes(&draft.surface.positions, rim, bones));
}

/// Closes boundary loops up to `longest` metres unless one of `bones` passes through them or strokes cut them. The new
/// triangles are few; remeshing refines them. The rims of closed holes are marked as filled.
pub(super) fn fill_holes(draft: &mut Draft, bones: &[Bone], longest: f32) {
    fill_where(draft, |draft, rim| {
        let positions = &draft.surface.positions;
        loop_length(positions, rim) <= longest && !passes(positions, rim, bones) && !is_cut_by_hand(draft, rim)
    });
}

/// True where most of a rim was made by strokes.
fn is_cut_by_hand(draft: &Draft, rim: &[u32]) -> bool {
    let by_hand = &draft.channels[Channel::ByHand];
    2 * rim.iter().filter(|&&v| by_hand[v as usize] < -SAID).count() > rim.len()
}

fn fill_where(draft: &mut Draft, wanted: impl Fn(&Draft, &[u32]) -> bool) {
    for rim in boundary_loops(&draft.surface.triangles) {
        if rim.len() < 3 || rim.len() > MAX_RIM_VERTICES || !wanted(draft, &rim) {
            continue;
        }
        // The loop runs along the surface's triangles; the filling runs against it.
        let against: Vec<u32> = rim.iter().rev().copied().collect();
        let corners: Vec<Point3<f32>> = against.iter().map(|&v| draft.surface.positions[v as usize]).collect();
        let Some(filling) = triangulate(&corners, &|_, _| false) else { continue };
        draft.surface.triangles.extend(filling.into_iter().map(|t| t.map(|corner| against[corner as usize])));
        rim.iter().for_each(|&v| draft.channels[Channel::Filled][v as usize] = 1.0);
    }
}

#[cfg(test)]
mod tests {
    use toile_geometry::{Mesh, topology::Edges};

    use super::*;

    fn tube_end() -> Mesh {
        let n = 12u32;
        let ring = |y: f32| {
            (0..n).map(move |i| {
                let a = i as f32 / n as f32 * std::f32::consts::TAU;
                Point3::new(0.03 * a.sin(), y, 0.03 * a.cos())
            })
        };
        let positions = ring(0.0).chain(ring(0.1)).collect();
        let triangles = (0..n)
            .flat_map(|i| {
                let j = (i + 1) % n;
                [[i, j, n + i], [j, n + j, n + i]]
            })
            .collect();
        Mesh::new(positions, triangles)
    }

    #[test]
    fn holes_are_closed_but_not_where_a_limb_passes() {
        let mut draft = Draft::of(&tube_end());
        let bone = [Point3::new(0.0, -0.2, 0.0), Point3::new(0.0, 0.05, 0.0)];
        fill_holes(&mut draft, &[bone], 0.3);
        assert_eq!(boundary_loops(&draft.surface.triangles).len(), 1);
        fill_holes(&mut draft, &[], 0.3);
        assert!(Edges::new(&draft.surface.triangles).is_closed());
        let volume = draft.surface.signed_volume();
        assert!((volume - 0.1 * 12.0 * 0.5 * 0.0009 * 0.5).abs() < 1e-5, "{volume}");
    }

    #[test]
    fn long_rims_stay_open() {
        let mut draft = Draft::of(&tube_end());
        let triangles = draft.surface.triangles.len();
        fill_holes(&mut draft, &[], 0.1);
        assert_eq!(draft.surface.triangles.len(), triangles);
    }
}
