//! The rims of cloth: where it ends, which way it would go on, and which rim of one garment is which of another.

use nalgebra::{Point3, Vector3};
use toile_geometry::{
    Mesh,
    topology::{boundary_loops, loop_length},
};

/// Shorter rims are holes that a scan left, metres.
const SHORTEST: f32 = 0.15;
/// Rims further apart than this, from middle to middle, are not the same, metres: hems differ by less.
const APART: f32 = 0.60;
/// Metres that a rim counts as further away where it ends the opposite way.
const OPPOSITE: f32 = 0.30;
/// A rim is a ring around a limb or the trunk where it ends one way on the whole: this much of its directions' mean is left.
const ONE_WAY: f32 = 0.5;
/// Parts of an open rim belong together where they end the same way (cosine).
const SAME_END: f32 = 0.3;

/// A vertex at the end of cloth.
#[derive(Debug, Clone, Copy)]
pub(super) struct RimPoint {
    pub vertex: u32,
    pub at: Point3<f32>,
    /// Unit vector in the surface, away from the cloth.
    outward: Vector3<f32>,
}

/// One rim, in the order of its vertices.
#[derive(Debug, Clone)]
pub(super) struct Rim {
    pub points: Vec<RimPoint>,
    middle: Point3<f32>,
    /// Mean of the directions in which it ends.
    outward: Vector3<f32>,
}

/// The rims of `mesh` that are no small holes.
pub(super) fn rims(mesh: &Mesh) -> Vec<Rim> {
    let inner = inner_middles(mesh);
    let is_long = |cycle: &Vec<u32>| loop_length(&mesh.positions, cycle) >= SHORTEST;
    boundary_loops(&mesh.triangles).into_iter().filter(is_long).map(|cycle| Rim::new(mesh, &cycle, &inner)).collect()
}

/// Which of the rims `to` each of the rims `from` is; none where there are too few, or none near.
pub(super) fn partners(from: &[Rim], to: &[Rim]) -> Vec<Option<usize>> {
    let far = |a: &Rim, b: &Rim| (a.middle - b.middle).norm() + OPPOSITE * 0.5 * (1.0 - a.outward.dot(&b.outward));
    let pairs = from.iter().enumerate().flat_map(|(i, a)| to.iter().enumerate().map(move |(j, b)| (far(a, b), i, j)));
    let mut pairs: Vec<_> = pairs.filter(|p| p.0 < APART).collect();
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut found, mut taken) = (vec![None; from.len()], vec![false; to.len()]);
    for (_, i, j) in pairs {
        if found[i].is_none() && !taken[j] {
            (found[i], taken[j]) = (Some(j), true);
        }
    }
    found
}

impl Rim {
    fn new(mesh: &Mesh, cycle: &[u32], inner: &[Point3<f32>]) -> Self {
        let n = cycle.len();
        let at = |i: usize| mesh.positions[cycle[i % n] as usize];
        let point = |i: usize| {
            let along = (at(i + 1) - at(i + n - 1)).try_normalize(1e-9).unwrap_or_else(Vector3::zeros);
            let away = at(i) - inner[cycle[i] as usize];
            let outward = (away - along * along.dot(&away)).try_normalize(1e-9).unwrap_or_else(Vector3::zeros);
            RimPoint { vertex: cycle[i], at: at(i), outward }
        };
        let points: Vec<RimPoint> = (0..n).map(point).collect();
        let mean =
            |of: &dyn Fn(&RimPoint) -> Vector3<f32>| points.iter().map(of).sum::<Vector3<f32>>() / n.max(1) as f32;
        let (middle, outward) = (Point3::from(mean(&|p| p.at.coords)), mean(&|p| p.outward));
        Self { points, middle, outward }
    }

    /// True where it goes around a limb or the trunk; an opening in front ends in all directions.
    pub fn is_ring(&self) -> bool {
        self.outward.norm() > ONE_WAY
    }

    /// Where each point of this ring belongs on another one: at the same share of the way around, from the front on.
    pub fn around(&self, other: &Self) -> Vec<Point3<f32>> {
        let (own, there) = (self.way(), other.way());
        let at = |share: f32| {
            let k = there.partition_point(|w| w.0 <= share).clamp(1, there.len() - 1);
            let ((a, p), (b, q)) = (there[k - 1], there[k]);
            p + (q - p) * ((share - a) / (b - a).max(1e-9)).clamp(0.0, 1.0)
        };
        // Back from the order of the way to that of the points.
        let start = self.front();
        let n = self.points.len();
        (0..n).map(|i| at(own[(i + n - start) % n].0)).collect()
    }

    /// Shares of the way around from the front on and the points there, the first one again at its end.
    fn way(&self) -> Vec<(f32, Point3<f32>)> {
        let (n, start) = (self.points.len(), self.front());
        let mut way = vec![(0.0, self.points[start].at)];
        for i in 1..=n {
            let p = self.points[(start + i) % n].at;
            let (gone, before) = way[i - 1];
            way.push((gone + (p - before).norm(), p));
        }
        let whole = way[n].0.max(1e-9);
        way.iter_mut().for_each(|w| w.0 /= whole);
        way
    }

    /// The point that lies furthest to the front of the ring, seen along it.
    fn front(&self) -> usize {
        let axis = self.outward.try_normalize(1e-9).unwrap_or_else(Vector3::y);
        let front = Vector3::z() - axis * axis.z;
        let ahead = |i: &usize| {
            let from = (self.points[*i].at - self.middle).normalize();
            from.dot(&front)
        };
        (0..self.points.len()).max_by(|a, b| ahead(a).total_cmp(&ahead(b))).unwrap_or(0)
    }

    /// The point nearest to `p` that ends the way `point` does.
    pub fn nearest(&self, p: &Point3<f32>, point: &RimPoint) -> Option<Point3<f32>> {
        let same = self.points.iter().filter(|r| r.outward.dot(&point.outward) > SAME_END);
        let distance = |r: &&RimPoint| (r.at - p).norm_squared();
        same.min_by(|a, b| distance(a).total_cmp(&distance(b))).map(|r| r.at)
    }
}

/// Of each vertex the middle of the triangles around it.
fn inner_middles(mesh: &Mesh) -> Vec<Point3<f32>> {
    let mut sums = vec![(Vector3::zeros(), 0.0f32); mesh.positions.len()];
    for (t, corners) in mesh.triangles.iter().enumerate() {
        let middle = mesh.corners(t).iter().fold(Vector3::zeros(), |s, p| s + p.coords) / 3.0;
        for &v in corners {
            let (sum, count) = &mut sums[v as usize];
            *sum += middle;
            *count += 1.0;
        }
    }
    sums.into_iter().map(|(sum, n)| Point3::from(sum / n.max(1.0))).collect()
}
