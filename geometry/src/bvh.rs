//! A bounding-volume hierarchy over triangles: closest point, rays, overlaps, winding numbers.
//!
//! Median split on the longest axis of the centroids, leaves of a few triangles, nodes in one array. Building is
//! deterministic; queries may run in parallel.

use nalgebra::{Point3, Vector3};

use crate::triangle;

/// Triangles in a leaf.
const LEAF: usize = 4;
/// More triangles than this are built by two threads.
const PARALLEL: usize = 4096;

/// The closest point of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closest {
    /// Triangle index.
    pub triangle: u32,
    /// Barycentric coordinates in it.
    pub barycentric: [f32; 3],
    /// The point itself.
    pub point: Point3<f32>,
    /// Distance from the query, metres.
    pub distance: f32,
}

/// Where a ray meets a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayHit {
    /// Triangle index.
    pub triangle: u32,
    /// Barycentric coordinates in it.
    pub barycentric: [f32; 3],
    /// Ray parameter: metres where the direction is a unit vector.
    pub t: f32,
}

#[derive(Debug, Clone, Copy)]
struct Node {
    lo: Point3<f32>,
    hi: Point3<f32>,
    /// Leaf: first entry of `order`. Inner: index of the right child (the left one follows its parent).
    start: u32,
    /// Leaf: number of triangles. Inner: 0.
    count: u32,
    /// Sum of area-weighted normals below (half cross products), for far-field winding numbers.
    dipole: Vector3<f32>,
    /// Area-weighted centre below.
    center: Point3<f32>,
    /// Radius around `center` that holds everything below.
    radius: f32,
}

impl Node {
    const EMPTY: Self = Self {
        lo: Point3::new(0.0, 0.0, 0.0),
        hi: Point3::new(0.0, 0.0, 0.0),
        start: 0,
        count: 0,
        dipole: Vector3::new(0.0, 0.0, 0.0),
        center: Point3::new(0.0, 0.0, 0.0),
        radius: 0.0,
    };
}

/// A bounding-volume hierarchy that owns copies of its triangles' corners.
#[derive(Debug, Clone)]
pub struct Bvh {
    nodes: Vec<Node>,
    order: Vec<u32>,
    corners: Vec<[Point3<f32>; 3]>,
}

impl Bvh {
    /// Builds the hierarchy. Triangle indices must be in range. O(n log n).
    pub fn new(positions: &[Point3<f32>], triangles: &[[u32; 3]]) -> Self {
        let all: Vec<[Point3<f32>; 3]> = triangles.iter().map(|t| t.map(|v| positions[v as usize])).collect();
        let mut order: Vec<u32> = (0..all.len() as u32).collect();
        let centroids: Vec<Point3<f32>> =
            all.iter().map(|[a, b, c]| Point3::from((a.coords + b.coords + c.coords) / 3.0)).collect();
        let mut nodes = Vec::new();
        if !all.is_empty() {
            nodes.resize(node_counts(all.len()).0, Node::EMPTY);
            divide(&mut nodes, &mut order, (0, 0), &centroids);
        }
        let corners = order.iter().map(|&t| all[t as usize]).collect();
        let mut tree = Self { nodes, order, corners };
        tree.summarise();
        tree
    }

    /// Takes over moved `positions` of the mesh it was built from (`triangles` as then), and keeps the division: a fraction of the cost of
    /// building anew. Queries stay exact; they get slower where neighbours in space have become others. O(n).
    pub fn refit(&mut self, positions: &[Point3<f32>], triangles: &[[u32; 3]]) {
        for (corners, &t) in self.corners.iter_mut().zip(&self.order) {
            *corners = triangles[t as usize].map(|v| positions[v as usize]);
        }
        self.summarise();
    }

    /// Sums up every node's triangles, leaves first: children follow their parents.
    fn summarise(&mut self) {
        let mut sums = vec![Sum::default(); self.nodes.len()];
        for n in (0..self.nodes.len()).rev() {
            let (start, count) = (self.nodes[n].start as usize, self.nodes[n].count as usize);
            sums[n] = if count > 0 {
                self.corners[start..start + count].iter().fold(Sum::default(), |sum, corners| sum.with(corners))
            } else {
                sums[n + 1].merged(&sums[start])
            };
            sums[n].write(&mut self.nodes[n]);
        }
    }

    /// The closest point within `max_distance`, or `None`. Of equally near triangles the first met wins.
    pub fn closest(&self, p: &Point3<f32>, max_distance: f32) -> Option<Closest> {
        self.closest_where(p, max_distance, |_| true)
    }

    /// The closest point on a triangle that `accept` takes, within `max_distance`.
    pub fn closest_where(&self, p: &Point3<f32>, max_distance: f32, accept: impl Fn(u32) -> bool) -> Option<Closest> {
        let mut best: Option<(f32, usize, [f32; 3])> = None;
        let mut limit = max_distance * max_distance;
        let mut stack = Stack::new();
        if let Some(root) = self.nodes.first() {
            stack.push((box_distance2(root, p), 0));
        }
        while let Some((d2, n)) = stack.pop() {
            if d2 > limit || (d2 == limit && best.is_some()) {
                continue;
            }
            let node = &self.nodes[n as usize];
            if node.count > 0 {
                for i in node.start as usize..(node.start + node.count) as usize {
                    if !accept(self.order[i]) {
                        continue;
                    }
                    let [a, b, c] = &self.corners[i];
                    let w = triangle::closest_barycentric(p, a, b, c);
                    let d2 = (triangle::at(w, a, b, c) - p).norm_squared();
                    if d2 < limit || (d2 <= limit && best.is_none()) {
                        limit = d2;
                        best = Some((d2, i, w));
                    }
                }
                continue;
            }
            let (l, r) = (n + 1, node.start);
            let (dl, dr) = (box_distance2(&self.nodes[l as usize], p), box_distance2(&self.nodes[r as usize], p));
            let (near, far) = if dl <= dr { ((dl, l), (dr, r)) } else { ((dr, r), (dl, l)) };
            stack.push(far);
            stack.push(near);
        }
        best.map(|(d2, i, w)| {
            let [a, b, c] = &self.corners[i];
            Closest { triangle: self.order[i], barycentric: w, point: triangle::at(w, a, b, c), distance: d2.sqrt() }
        })
    }

    /// The first hit of the ray with `t` in `[0, max_t]`, from either side.
    pub fn ray(&self, origin: &Point3<f32>, direction: &Vector3<f32>, max_t: f32) -> Option<RayHit> {
        let inverse = direction.map(|d| 1.0 / d);
        let (mut limit, mut best) = (max_t, None);
        let mut stack = Stack::new();
        stack.push((0.0, 0));
        while let Some((enter, n)) = stack.pop() {
            let Some(node) = self.nodes.get(n as usize).filter(|_| enter <= limit) else { continue };
            if node.count == 0 {
                self.push_ray_children(n, node.start, origin, &inverse, limit, &mut stack);
                continue;
            }
            for i in node.start as usize..(node.start + node.count) as usize {
                if let Some((t, w)) = triangle::ray_hit(origin, direction, &self.corners[i]).filter(|h| h.0 <= limit) {
                    limit = t;
                    best = Some(RayHit { triangle: self.order[i], barycentric: w, t });
                }
            }
        }
        best
    }

    fn push_ray_children(
        &self,
        parent: u32,
        right: u32,
        origin: &Point3<f32>,
        inverse: &Vector3<f32>,
        limit: f32,
        stack: &mut Stack,
    ) {
        let enter = |n: u32| ray_box(&self.nodes[n as usize], origin, inverse, limit);
        let (l, r) = ((enter(parent + 1), parent + 1), (enter(right), right));
        let (near, far) = if l.0 <= r.0 { (l, r) } else { (r, l) };
        for (t, n) in [far, near] {
            if t.is_finite() {
                stack.push((t, n));
            }
        }
    }

    /// Calls `visit` with every triangle whose bounding box overlaps the box `lo`–`hi`.
    pub fn overlapping(&self, lo: &Point3<f32>, hi: &Point3<f32>, mut visit: impl FnMut(u32)) {
        let mut stack = vec![0u32];
        while let Some(n) = stack.pop() {
            let Some(node) = self.nodes.get(n as usize) else { continue };
            if !boxes_overlap(&node.lo, &node.hi, lo, hi) {
                continue;
            }
            if node.count == 0 {
                stack.extend([node.start, n + 1]);
                continue;
            }
            for i in node.start as usize..(node.start + node.count) as usize {
                let [a, b, c] = &self.corners[i];
                if boxes_overlap(&a.inf(b).inf(c), &a.sup(b).sup(c), lo, hi) {
                    visit(self.order[i]);
                }
            }
        }
    }

    /// Generalised winding number at `p` (Jacobson et al. 2013; far field by dipoles, Barill et al. 2018, with the
    /// opening ratio 2): about 1 inside a closed outward surface, 0 outside, in between near holes.
    pub fn winding_number(&self, p: &Point3<f32>) -> f32 {
        let mut sum = 0.0f64;
        let mut stack = vec![0u32];
        while let Some(n) = stack.pop() {
            let Some(node) = self.nodes.get(n as usize) else { continue };
            let to_center = node.center - p;
            let distance = to_center.norm();
            if distance > 2.0 * node.radius {
                sum += f64::from(node.dipole.dot(&to_center)) / f64::from(distance).powi(3);
            } else if node.count == 0 {
                stack.extend([node.start, n + 1]);
            } else {
                let leaf = node.start as usize..(node.start + node.count) as usize;
                sum += leaf.map(|i| solid_angle(p, &self.corners[i])).sum::<f64>();
            }
        }
        (sum / (4.0 * std::f64::consts::PI)) as f32
    }

    /// True where the winding number says that `p` lies inside.
    pub fn contains(&self, p: &Point3<f32>) -> bool {
        self.winding_number(p) > 0.5
    }
}

/// A small stack that starts on the machine's own.
struct Stack {
    items: [(f32, u32); 64],
    len: usize,
}

impl Stack {
    fn new() -> Self {
        Self { items: [(0.0, 0); 64], len: 0 }
    }
    // The tree is balanced by medians, so 64 entries serve two to the power of 60 triangles.
    #[inline]
    fn push(&mut self, item: (f32, u32)) {
        self.items[self.len] = item;
        self.len += 1;
    }
    #[inline]
    fn pop(&mut self) -> Option<(f32, u32)> {
        self.len = self.len.checked_sub(1)?;
        Some(self.items[self.len])
    }
}

/// Number of nodes over `count` and over `count + 1` triangles.
fn node_counts(count: usize) -> (usize, usize) {
    if count < LEAF {
        return (1, 1);
    }
    let (half, more) = node_counts(count / 2);
    let (here, next) = if count.is_multiple_of(2) { (2 * half, half + more) } else { (half + more, 2 * more) };
    (if count == LEAF { 1 } else { 1 + here }, 1 + next)
}

/// Divides the triangles `order` among `nodes` (all those over them, still without bounds); `at` is the index of the
/// first node and of the first entry of the order.
fn divide(nodes: &mut [Node], order: &mut [u32], at: (usize, usize), centroids: &[Point3<f32>]) {
    let count = order.len();
    let (node, below) = nodes.split_at_mut(1);
    if count <= LEAF {
        (node[0].start, node[0].count) = (at.1 as u32, count as u32);
        return;
    }
    let c = |t: u32| centroids[t as usize];
    let lo = order.iter().fold(c(order[0]), |m, &t| m.inf(&c(t)));
    let hi = order.iter().fold(c(order[0]), |m, &t| m.sup(&c(t)));
    let axis = (hi - lo).imax();
    let middle = count / 2;
    order.select_nth_unstable_by(middle, |&a, &b| c(a)[axis].total_cmp(&c(b)[axis]).then(a.cmp(&b)));
    let (left, right) = order.split_at_mut(middle);
    let (left_nodes, right_nodes) = below.split_at_mut(node_counts(middle).0);
    let right_at = (at.0 + 1 + left_nodes.len(), at.1 + middle);
    node[0].start = right_at.0 as u32;
    let mut low = || divide(left_nodes, left, (at.0 + 1, at.1), centroids);
    let mut high = || divide(right_nodes, right, right_at, centroids);
    if count > PARALLEL {
        rayon::join(low, high);
    } else {
        low();
        high();
    }
}

/// What a node says about the triangles below it, before division.
#[derive(Debug, Clone, Copy)]
struct Sum {
    lo: Point3<f32>,
    hi: Point3<f32>,
    dipole: Vector3<f64>,
    /// Sum of centres times areas.
    center: Vector3<f64>,
    area: f64,
}

impl Default for Sum {
    fn default() -> Self {
        let (lo, hi) = ([f32::INFINITY; 3].into(), [f32::NEG_INFINITY; 3].into());
        Self { lo, hi, dipole: Vector3::zeros(), center: Vector3::zeros(), area: 0.0 }
    }
}

impl Sum {
    fn with(self, corners: &[Point3<f32>; 3]) -> Self {
        let [a, b, c] = corners.map(|p| p.coords.cast::<f64>());
        let n = (b - a).cross(&(c - a)) * 0.5;
        Self {
            lo: corners.iter().fold(self.lo, |lo, p| lo.inf(p)),
            hi: corners.iter().fold(self.hi, |hi, p| hi.sup(p)),
            dipole: self.dipole + n,
            center: self.center + (a + b + c) / 3.0 * n.norm(),
            area: self.area + n.norm(),
        }
    }

    fn merged(&self, other: &Self) -> Self {
        Self {
            lo: self.lo.inf(&other.lo),
            hi: self.hi.sup(&other.hi),
            dipole: self.dipole + other.dipole,
            center: self.center + other.center,
            area: self.area + other.area,
        }
    }

    fn write(&self, node: &mut Node) {
        (node.lo, node.hi, node.dipole) = (self.lo, self.hi, self.dipole.cast());
        node.center = match self.area > 0.0 {
            true => Point3::from((self.center / self.area).cast::<f32>()),
            false => nalgebra::center(&self.lo, &self.hi),
        };
        node.radius = (self.hi - node.center).sup(&(node.center - self.lo)).norm();
    }
}

#[inline]
fn box_distance2(node: &Node, p: &Point3<f32>) -> f32 {
    let mut sum = 0.0;
    for k in 0..3 {
        let d = (node.lo[k] - p[k]).max(p[k] - node.hi[k]).max(0.0);
        sum += d * d;
    }
    sum
}

/// Ray parameter at which the box is entered, infinite where it is missed.
fn ray_box(node: &Node, origin: &Point3<f32>, inverse: &Vector3<f32>, limit: f32) -> f32 {
    let (mut enter, mut leave) = (0.0f32, limit);
    for k in 0..3 {
        let (a, b) = ((node.lo[k] - origin[k]) * inverse[k], (node.hi[k] - origin[k]) * inverse[k]);
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    if enter <= leave * (1.0 + 1e-5) { enter } else { f32::INFINITY }
}

fn boxes_overlap(alo: &Point3<f32>, ahi: &Point3<f32>, blo: &Point3<f32>, bhi: &Point3<f32>) -> bool {
    (0..3).all(|k| alo[k] <= bhi[k] && blo[k] <= ahi[k])
}

/// Signed solid angle of a triangle (van Oosterom and Strackee 1983).
fn solid_angle(p: &Point3<f32>, corners: &[Point3<f32>; 3]) -> f64 {
    let [a, b, c] = corners.map(|q| (q - p).cast::<f64>());
    let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
    let det = a.dot(&b.cross(&c));
    let div = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
    2.0 * det.atan2(div)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A unit octahedron cut finer, pushed onto the sphere.
    fn sphere(levels: usize) -> (Vec<Point3<f32>>, Vec<[u32; 3]>) {
        let mut corners: Vec<[Point3<f32>; 3]> = Vec::new();
        for s in 0..8 {
            let sign = |bit: usize| if s >> bit & 1 == 0 { 1.0 } else { -1.0 };
            let (x, y, z) =
                (Point3::new(sign(0), 0.0, 0.0), Point3::new(0.0, sign(1), 0.0), Point3::new(0.0, 0.0, sign(2)));
            let outward = sign(0) * sign(1) * sign(2) > 0.0;
            corners.push(if outward { [x, y, z] } else { [x, z, y] });
        }
        for _ in 0..levels {
            let mid = |a: Point3<f32>, b: Point3<f32>| Point3::from((a.coords + b.coords).normalize());
            corners = corners
                .iter()
                .flat_map(|&[a, b, c]| {
                    let (ab, bc, ca) = (mid(a, b), mid(b, c), mid(c, a));
                    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
                })
                .collect();
        }
        let positions = corners.iter().flatten().copied().collect();
        let triangles = (0..corners.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        (positions, triangles)
    }

    fn probes() -> impl Iterator<Item = Point3<f32>> {
        (0..300).map(|i| {
            let t = i as f32;
            Point3::new((t * 0.7).sin() * 1.7, (t * 1.3).cos() * 1.6, (t * 0.37).sin() * 1.5)
        })
    }

    #[test]
    fn closest_agrees_with_brute_force() {
        let (positions, triangles) = sphere(3);
        let bvh = Bvh::new(&positions, &triangles);
        for p in probes() {
            let brute = triangles
                .iter()
                .map(|t| {
                    let [a, b, c] = t.map(|v| positions[v as usize]);
                    (triangle::at(triangle::closest_barycentric(&p, &a, &b, &c), &a, &b, &c) - p).norm()
                })
                .fold(f32::INFINITY, f32::min);
            let hit = bvh.closest(&p, f32::INFINITY).unwrap();
            assert!((hit.distance - brute).abs() < 1e-6, "{} against {brute}", hit.distance);
            assert!(bvh.closest(&p, brute * 0.99).is_none());
        }
    }

    #[test]
    fn rays_agree_with_brute_force() {
        let (positions, triangles) = sphere(3);
        let bvh = Bvh::new(&positions, &triangles);
        for (i, p) in probes().enumerate() {
            let d = Vector3::new((i as f32).cos(), (i as f32 * 2.1).sin(), 0.3).normalize();
            let brute = triangles
                .iter()
                .filter_map(|t| triangle::ray_hit(&p, &d, &t.map(|v| positions[v as usize])))
                .map(|h| h.0)
                .fold(f32::INFINITY, f32::min);
            let found = bvh.ray(&p, &d, f32::INFINITY).map_or(f32::INFINITY, |h| h.t);
            assert!(found == brute || (found - brute).abs() < 1e-5, "{found} against {brute}");
        }
    }

    #[test]
    fn refitted_answers_as_built_anew() {
        let (mut positions, triangles) = sphere(3);
        let mut refitted = Bvh::new(&positions, &triangles);
        positions.iter_mut().for_each(|p| *p = Point3::new(p.x * 1.3 + 0.2 * p.y, p.y, p.z * 0.8 - 0.1));
        refitted.refit(&positions, &triangles);
        let built = Bvh::new(&positions, &triangles);
        for p in probes() {
            let of = |tree: &Bvh| tree.closest(&p, f32::INFINITY).unwrap().distance;
            assert!((of(&refitted) - of(&built)).abs() < 1e-6);
            let of = |tree: &Bvh| tree.ray(&p, &-p.coords, f32::INFINITY).map(|h| h.t);
            assert_eq!(of(&refitted), of(&built));
            assert!((refitted.winding_number(&p) - built.winding_number(&p)).abs() < 0.02);
        }
    }

    #[test]
    fn winding_number_tells_inside_from_outside() {
        let (positions, triangles) = sphere(3);
        let bvh = Bvh::new(&positions, &triangles);
        for p in probes().filter(|p| (p.coords.norm() - 1.0).abs() > 0.03) {
            let inside = p.coords.norm() < 1.0;
            let w = bvh.winding_number(&p);
            assert!((w - f32::from(u8::from(inside))).abs() < 0.05, "{w} at {p}");
        }
    }

    #[test]
    fn an_empty_mesh_answers_nothing() {
        let bvh = Bvh::new(&[], &[]);
        assert!(bvh.closest(&Point3::origin(), 1.0).is_none());
        assert!(bvh.ray(&Point3::origin(), &Vector3::x(), 1.0).is_none());
        assert_eq!(bvh.winding_number(&Point3::origin()), 0.0);
    }
}
