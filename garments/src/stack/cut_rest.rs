//! The last resort of stacking: the few triangles that still cross or come too near are cut out of the upper layer.
//! Vertices stay, so that what goes with them (weights, attributes) stays valid.

use std::collections::BTreeSet;

use toile_geometry::{Mesh, intersection::self_crossings};

use super::{
    contact::Contact,
    layer::{Layer, crossing_pairs},
};

/// More than this share of a layer's triangles is not cut: such a layer cannot be parted.
const MAX_SHARE: f32 = 0.005;
/// At least this much must be left of the gap that a contact aims at, metres.
const TOO_NEAR: f32 = 0.001;

/// Cuts triangles of layer `upper`: those that cross a layer below, those whose contact among `left` lacks too much, and
/// one of each pair that crosses within the layer but is not among `own_before`. Returns how many were cut.
pub(super) fn cut_rest(layers: &mut [Layer], upper: usize, own_before: &[[u32; 2]], left: &[Contact]) -> usize {
    let (mesh, gap) = (layers[upper].mesh(), layers[upper].gap);
    let mut cut: BTreeSet<u32> = crossing_pairs(layers, upper).iter().map(|pair| pair[0]).collect();
    for pair in self_crossings(mesh, &layers[upper].surface.bvh) {
        if own_before.binary_search(&pair).is_err() && !cut.contains(&pair[0]) {
            cut.insert(pair[1]);
        }
    }
    let allowed = (gap - TOO_NEAR).max(0.5 * gap);
    let lacks = |c: &&Contact| c.upper.layer == upper && c.by.norm() > allowed;
    let near: BTreeSet<u32> = left.iter().filter(lacks).map(|c| c.upper.nearest_corner()).collect();
    let at_near = |t: &u32| mesh.triangles[*t as usize].iter().any(|v| near.contains(v));
    cut.extend((0..mesh.triangles.len() as u32).filter(at_near));
    if cut.is_empty() || cut.len() as f32 > MAX_SHARE * mesh.triangles.len() as f32 {
        return 0;
    }
    let mut rest = mesh.clone();
    let kept = (0u32..).zip(&mesh.triangles).filter(|(t, _)| !cut.contains(t));
    rest.triangles = kept.map(|(_, &corners)| corners).collect();
    tidy(&mut rest, mesh, &cut);
    layers[upper] = Layer::new(&rest, gap);
    cut.len()
}

/// Vertices that lost all their triangles go where a vertex lies that kept some, so that none strays.
fn tidy(rest: &mut Mesh, mesh: &Mesh, cut: &BTreeSet<u32>) {
    let mut kept = vec![false; mesh.positions.len()];
    rest.triangles.iter().flatten().for_each(|&v| kept[v as usize] = true);
    let around: BTreeSet<u32> = cut.iter().flat_map(|&t| mesh.triangles[t as usize]).collect();
    for &lost in around.iter().filter(|v| !kept[**v as usize]) {
        let p = mesh.positions[lost as usize];
        let distance = |v: &&u32| (mesh.positions[**v as usize] - p).norm_squared();
        let near = around.iter().filter(|v| kept[**v as usize]).min_by(|a, b| distance(a).total_cmp(&distance(b)));
        rest.positions[lost as usize] = near.map_or(p, |&v| mesh.positions[v as usize]);
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;
    use crate::stack::contact::Anchor;

    /// A sheet over nothing with one vertex that was pushed through its neighbours' triangles.
    fn folded() -> Layer {
        let n = 31u32;
        let at = |i: u32| Point3::new((i % n) as f32 * 0.01, (i / n) as f32 * 0.01, 0.0);
        let triangles = (0..n - 1)
            .flat_map(|j| (0..n - 1).map(move |i| j * n + i))
            .flat_map(|a| [[a, a + 1, a + n + 1], [a, a + n + 1, a + n]])
            .collect();
        let mut mesh = Mesh::new((0..n * n).map(at).collect(), triangles);
        mesh.positions[(10 * n + 10) as usize] = Point3::new(0.125, 0.125, -0.002);
        mesh.positions[(11 * n + 11) as usize].z = 0.004;
        mesh.positions[(10 * n + 11) as usize] = Point3::new(0.095, 0.118, 0.003);
        Layer::new(&mesh, 0.0015)
    }

    #[test]
    fn crossings_within_a_layer_are_cut_where_they_are_new_and_left_where_they_were() {
        let below = || Layer::new(&Mesh::default(), 0.0);
        let pairs = |s: &Layer| self_crossings(s.mesh(), &s.surface.bvh);
        let mut layers = [below(), folded()];
        let before = pairs(&layers[1]);
        assert!(!before.is_empty());
        assert_eq!(cut_rest(&mut layers, 1, &before, &[]), 0);
        assert_eq!(pairs(&layers[1]), before);
        let cut = cut_rest(&mut layers, 1, &[], &[]);
        assert!(0 < cut && cut <= before.len(), "{cut} of {before:?}");
        assert!(pairs(&layers[1]).is_empty());
    }

    #[test]
    fn only_what_lacks_half_a_gap_is_cut_for_being_near() {
        let sheet = folded().surface.mesh;
        let contact = |v: u32, lacks: f32| {
            let upper = Anchor { layer: 1, corners: [v; 3], weights: [1.0, 0.0, 0.0] };
            let lower = Anchor { layer: 0, corners: [0; 3], weights: [1.0, 0.0, 0.0] };
            Contact { upper, lower, by: nalgebra::Vector3::z() * lacks * 0.0015 }
        };
        let (near, enough) = (20 * 31 + 20, 25 * 31 + 5);
        let mut layers = [Layer::new(&Mesh::default(), 0.0), Layer::new(&sheet, 0.0015)];
        let own = self_crossings(layers[1].mesh(), &layers[1].surface.bvh);
        let left = [contact(near, 0.51), contact(enough, 0.49)];
        assert_eq!(cut_rest(&mut layers, 1, &own, &left), 6);
        let kept: Vec<[u32; 3]> = sheet.triangles.into_iter().filter(|t| !t.contains(&near)).collect();
        assert_eq!(layers[1].mesh().triangles, kept);
    }

    #[test]
    fn a_spike_through_a_sheet_is_cut_and_a_sheet_through_a_sheet_is_not() {
        let n = 31u32;
        let sheet = |height: &dyn Fn(u32, u32) -> f32| {
            let at = |i: u32| Point3::new((i % n) as f32 * 0.01, (i / n) as f32 * 0.01, height(i % n, i / n));
            let triangles = (0..n - 1)
                .flat_map(|j| (0..n - 1).map(move |i| j * n + i))
                .flat_map(|a| [[a, a + 1, a + n + 1], [a, a + n + 1, a + n]])
                .collect();
            Layer::new(&Mesh::new((0..n * n).map(at).collect(), triangles), 0.0015)
        };
        let spike = |i: u32, j: u32| if (i, j) == (15, 15) { -0.005 } else { 0.003 };
        let mut layers = [sheet(&|_, _| 0.0), sheet(&spike)];
        let around: Vec<[u32; 3]> =
            layers[1].mesh().triangles.iter().filter(|t| t.contains(&(15 * n + 15))).copied().collect();
        let whole = layers[1].mesh().triangles.clone();
        assert_eq!(cut_rest(&mut layers, 1, &[], &[]), around.len());
        let kept: Vec<[u32; 3]> = whole.into_iter().filter(|t| !around.contains(t)).collect();
        assert_eq!((layers[1].mesh().triangles.clone(), around.len()), (kept, 6), "those of the spike and no others");
        assert_eq!(layers[1].mesh().positions.len() as u32, n * n);
        assert!(layers[1].mesh().positions.iter().all(|p| p.z == 0.003), "nothing strays");
        assert_eq!(cut_rest(&mut layers, 1, &[], &[]), 0);
        let mut through = [sheet(&|_, _| 0.0), sheet(&|i, _| i as f32 * 0.001 - 0.0152)];
        assert_eq!(cut_rest(&mut through, 1, &[], &[]), 0);
    }
}
