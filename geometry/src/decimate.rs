//! Decimation by edge collapse under quadric error (Garland and Heckbert 1997), attributes carried along.

use std::{cmp::Ordering, collections::BinaryHeap};

use nalgebra::{Matrix3, Point3, Vector3};

use crate::{Mesh, topology::Edges};

/// No corner.
const NONE: u32 = u32::MAX;
/// Weight of the planes that hold open borders in place.
const BORDER: f64 = 20.0;
/// Weight of each corner's own plane through the midpoint: keeps flat parts evenly meshed.
const SHAPE: f64 = 1e-4;
/// Cost of a colour difference of the whole range across an edge, as a distance in edge lengths.
const COLOR: f64 = 0.05;
/// A triangle may not turn by more than this (cosine) in one collapse.
const TURN: f64 = 0.3;

/// Symmetric quadric: squared distance to weighted planes.
#[derive(Debug, Clone, Copy, Default)]
struct Quadric {
    /// xx xy xz yy yz zz of the normals' outer products.
    a: [f64; 6],
    b: [f64; 3],
    c: f64,
}

#[derive(Debug, PartialEq)]
struct Candidate {
    cost: f64,
    vertices: [u32; 2],
    stamps: [u32; 2],
}

struct Collapser {
    positions: Vec<Point3<f64>>,
    quadrics: Vec<Quadric>,
    triangles: Vec<[u32; 3]>,
    alive: Vec<bool>,
    /// First corner at each vertex and the next corner after each: chains of triangle corners.
    head: Vec<u32>,
    tail: Vec<u32>,
    next: Vec<u32>,
    stamp: Vec<u32>,
    /// Merged attribute values: colours (0..255) and named attributes, one row a vertex.
    rows: Vec<f32>,
    width: usize,
    colors: usize,
    heap: BinaryHeap<Candidate>,
}

/// Collapses edges until at most `target` triangles are left or none can be collapsed without folding the surface
/// or changing its topology. Colours and attributes are interpolated along the collapsed edge; normals are computed
/// anew where the mesh had any. O(n log n); the result depends on the input alone.
pub fn decimate(mesh: &Mesh, target: usize) -> Mesh {
    let mut state = Collapser::new(mesh);
    let mut left = mesh.triangles.len();
    while left > target {
        let Some(candidate) = state.heap.pop() else { break };
        let [u, v] = candidate.vertices;
        if [state.stamp[u as usize], state.stamp[v as usize]] != candidate.stamps {
            continue;
        }
        left -= state.collapse(u, v);
    }
    state.into_mesh(mesh)
}

impl Collapser {
    fn new(mesh: &Mesh) -> Self {
        let count = mesh.positions.len();
        let colors = if mesh.colors.is_empty() { 0 } else { 3 };
        let width = colors + mesh.attributes.len();
        let mut rows = Vec::with_capacity(count * width);
        for v in 0..count {
            rows.extend(mesh.colors.get(v).into_iter().flatten().map(|&c| f32::from(c)));
            rows.extend(mesh.attributes.values().map(|a| a[v]));
        }
        let mut state = Self {
            positions: mesh.positions.iter().map(|p| p.cast()).collect(),
            quadrics: vec![Quadric::default(); count],
            triangles: mesh.triangles.clone(),
            alive: vec![true; mesh.triangles.len()],
            head: vec![NONE; count],
            tail: vec![NONE; count],
            next: vec![NONE; mesh.triangles.len() * 3],
            stamp: vec![0; count],
            rows,
            width,
            colors,
            heap: BinaryHeap::new(),
        };
        for t in 0..state.triangles.len() {
            for k in 0..3 {
                state.link(state.triangles[t][k], (t * 3 + k) as u32);
            }
        }
        state.add_planes(&Edges::new(&mesh.triangles));
        state
    }

    fn link(&mut self, v: u32, corner: u32) {
        let v = v as usize;
        match self.tail[v] {
            NONE => self.head[v] = corner,
            last => self.next[last as usize] = corner,
        }
        self.tail[v] = corner;
    }

    fn add_planes(&mut self, edges: &Edges) {
        for t in 0..self.triangles.len() {
            let tri = self.triangles[t];
            let [a, b, c] = tri.map(|v| self.positions[v as usize]);
            let cross = (b - a).cross(&(c - a));
            let area = cross.norm();
            let Some(n) = cross.try_normalize(1e-30) else { continue };
            for v in tri {
                self.quadrics[v as usize].add_plane(&n, &a, area / 6.0);
            }
            for k in 0..3 {
                if edges.uses[edges.of_triangle[t][k] as usize] == 1 {
                    let (p, q) = (tri[k], tri[(k + 1) % 3]);
                    let along = self.positions[q as usize] - self.positions[p as usize];
                    let Some(m) = along.cross(&n).try_normalize(1e-30) else { continue };
                    let weight = BORDER * along.norm_squared();
                    let on = self.positions[p as usize];
                    self.quadrics[p as usize].add_plane(&m, &on, weight);
                    self.quadrics[q as usize].add_plane(&m, &on, weight);
                }
            }
        }
        for &[u, v] in &edges.vertices {
            self.offer(u, v);
        }
    }

    /// Triangles alive at a vertex; forgets dead corners on the way.
    fn triangles_at(&self, v: u32) -> impl Iterator<Item = u32> + '_ {
        let mut corner = self.head[v as usize];
        std::iter::from_fn(move || {
            while corner != NONE {
                let t = corner / 3;
                corner = self.next[corner as usize];
                if self.alive[t as usize] {
                    return Some(t);
                }
            }
            None
        })
    }

    fn neighbors(&self, v: u32) -> Vec<u32> {
        let mut all: Vec<u32> =
            self.triangles_at(v).flat_map(|t| self.triangles[t as usize]).filter(|&c| c != v).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    fn offer(&mut self, u: u32, v: u32) {
        let (_, cost) = self.best_point(u, v);
        let stamps = [self.stamp[u as usize], self.stamp[v as usize]];
        self.heap.push(Candidate { cost, vertices: [u, v], stamps });
    }

    /// The point of least quadric error for a collapse and its cost.
    fn best_point(&self, u: u32, v: u32) -> (Point3<f64>, f64) {
        let (p, q) = (self.positions[u as usize], self.positions[v as usize]);
        let middle = nalgebra::center(&p, &q);
        let length2 = (p - q).norm_squared();
        let mut quadric = self.quadrics[u as usize].plus(&self.quadrics[v as usize]);
        let hold = SHAPE * quadric.trace().max(1e-12);
        for k in 0..3 {
            let axis = Vector3::ith(k, 1.0);
            quadric.add_plane(&axis, &middle, hold);
        }
        let solved = quadric.minimum().filter(|x| (x - middle).norm_squared() < 4.0 * length2);
        let point = solved.unwrap_or_else(|| {
            let all = [p, q, middle];
            all.into_iter().min_by(|a, b| quadric.at(a).total_cmp(&quadric.at(b))).unwrap_or(middle)
        });
        let row = |v: u32| &self.rows[v as usize * self.width..][..self.colors];
        let difference: f64 = row(u).iter().zip(row(v)).map(|(a, b)| f64::from((a - b) / 255.0).powi(2)).sum();
        (point, quadric.at(&point).max(0.0) + COLOR * COLOR * difference * length2 * length2)
    }

    /// Merges `v` into `u` where that is allowed; returns how many triangles went.
    fn collapse(&mut self, u: u32, v: u32) -> usize {
        let (point, _) = self.best_point(u, v);
        let shared: Vec<u32> = self.triangles_at(u).filter(|&t| self.triangles[t as usize].contains(&v)).collect();
        if shared.is_empty() || !self.keeps_topology(u, v, shared.len()) || !self.keeps_sides(u, v, &point) {
            return 0;
        }
        self.blend_rows(u, v, &point);
        self.positions[u as usize] = point;
        self.quadrics[u as usize] = self.quadrics[u as usize].plus(&self.quadrics[v as usize]);
        for &t in &shared {
            self.alive[t as usize] = false;
        }
        let moved: Vec<u32> = self.triangles_at(v).collect();
        for t in moved {
            for corner in &mut self.triangles[t as usize] {
                if *corner == v {
                    *corner = u;
                }
            }
        }
        let (head, tail) = (self.head[v as usize], self.tail[v as usize]);
        if head != NONE {
            self.next[self.tail[u as usize] as usize] = head;
            self.tail[u as usize] = tail;
        }
        self.head[v as usize] = NONE;
        self.stamp[v as usize] += 1;
        self.stamp[u as usize] += 1;
        self.forget_dead(u);
        for n in self.neighbors(u) {
            self.offer(u, n);
        }
        shared.len()
    }

    fn forget_dead(&mut self, u: u32) {
        let mut corners = Vec::new();
        let mut corner = self.head[u as usize];
        while corner != NONE {
            if self.alive[corner as usize / 3] {
                corners.push(corner);
            }
            corner = self.next[corner as usize];
        }
        self.head[u as usize] = corners.first().copied().unwrap_or(NONE);
        self.tail[u as usize] = corners.last().copied().unwrap_or(NONE);
        for pair in corners.windows(2) {
            self.next[pair[0] as usize] = pair[1];
        }
        if let Some(&last) = corners.last() {
            self.next[last as usize] = NONE;
        }
    }

    /// The link condition: the ends share exactly the vertices opposite the edge, and no border is pinched.
    fn keeps_topology(&self, u: u32, v: u32, shared: usize) -> bool {
        let (around_u, around_v) = (self.neighbors(u), self.neighbors(v));
        let common = around_u.iter().filter(|n| around_v.binary_search(n).is_ok()).count();
        if common != shared || shared > 2 || around_u.len() + around_v.len() < shared + 5 {
            return false;
        }
        let open = |v: u32, around: &[u32]| self.triangles_at(v).count() < around.len();
        shared == 1 || !(open(u, &around_u) && open(v, &around_v))
    }

    /// No remaining triangle turns over or becomes a needle.
    fn keeps_sides(&self, u: u32, v: u32, point: &Point3<f64>) -> bool {
        [(u, v), (v, u)].into_iter().all(|(from, other)| {
            self.triangles_at(from).all(|t| {
                let tri = self.triangles[t as usize];
                if tri.contains(&other) {
                    return true;
                }
                let old = tri.map(|c| self.positions[c as usize]);
                let new = tri.map(|c| if c == from { *point } else { self.positions[c as usize] });
                let n0 = (old[1] - old[0]).cross(&(old[2] - old[0]));
                let n1 = (new[1] - new[0]).cross(&(new[2] - new[0]));
                let longest = (0..3).map(|k| (new[k] - new[(k + 1) % 3]).norm_squared()).fold(0.0, f64::max);
                n1.norm() > 0.02 * longest && n0.dot(&n1) >= TURN * n0.norm() * n1.norm()
            })
        })
    }

    fn blend_rows(&mut self, u: u32, v: u32, point: &Point3<f64>) {
        let (p, q) = (self.positions[u as usize], self.positions[v as usize]);
        let along = q - p;
        let share = ((point - p).dot(&along) / along.norm_squared().max(1e-30)).clamp(0.0, 1.0) as f32;
        for k in 0..self.width {
            let (a, b) = (self.rows[u as usize * self.width + k], self.rows[v as usize * self.width + k]);
            self.rows[u as usize * self.width + k] = a + (b - a) * share;
        }
    }

    fn into_mesh(self, source: &Mesh) -> Mesh {
        let row = |v: usize, k: usize| self.rows[v * self.width + k];
        let color = |v: usize| [0, 1, 2].map(|k| row(v, k).round().clamp(0.0, 255.0) as u8);
        let count = self.positions.len();
        let attribute = |k: usize| (0..count).map(|v| row(v, self.colors + k)).collect();
        let all = Mesh {
            positions: self.positions.iter().map(|p| p.cast()).collect(),
            triangles: self.triangles.clone(),
            normals: Vec::new(),
            colors: if self.colors > 0 { (0..count).map(color).collect() } else { Vec::new() },
            attributes: source.attributes.keys().enumerate().map(|(k, n)| (n.clone(), attribute(k))).collect(),
        };
        let (mut mesh, _) = all.filter_triangles(|t| self.alive[t]);
        if !source.normals.is_empty() {
            mesh.recompute_normals();
        }
        mesh
    }
}

impl Quadric {
    fn add_plane(&mut self, n: &Vector3<f64>, on: &Point3<f64>, weight: f64) {
        let d = -n.dot(&on.coords);
        let products = [n.x * n.x, n.x * n.y, n.x * n.z, n.y * n.y, n.y * n.z, n.z * n.z];
        self.a.iter_mut().zip(products).for_each(|(a, p)| *a += weight * p);
        (0..3).for_each(|k| self.b[k] += weight * d * n[k]);
        self.c += weight * d * d;
    }

    fn plus(&self, other: &Self) -> Self {
        Self {
            a: std::array::from_fn(|k| self.a[k] + other.a[k]),
            b: std::array::from_fn(|k| self.b[k] + other.b[k]),
            c: self.c + other.c,
        }
    }

    fn trace(&self) -> f64 {
        self.a[0] + self.a[3] + self.a[5]
    }

    fn at(&self, p: &Point3<f64>) -> f64 {
        let [xx, xy, xz, yy, yz, zz] = self.a;
        let (x, y, z) = (p.x, p.y, p.z);
        let quadratic = x * (xx * x + 2.0 * (xy * y + xz * z)) + y * (yy * y + 2.0 * yz * z) + zz * z * z;
        quadratic + 2.0 * (self.b[0] * x + self.b[1] * y + self.b[2] * z) + self.c
    }

    fn minimum(&self) -> Option<Point3<f64>> {
        let [xx, xy, xz, yy, yz, zz] = self.a;
        let matrix = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        let x = matrix.cholesky()?.solve(&-Vector3::from(self.b));
        x.iter().all(|c| c.is_finite()).then(|| Point3::from(x))
    }
}

impl Eq for Candidate {}

impl Ord for Candidate {
    /// The cheapest is the greatest; ties go to the smaller vertices.
    fn cmp(&self, other: &Self) -> Ordering {
        other.cost.total_cmp(&self.cost).then_with(|| other.vertices.cmp(&self.vertices))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::Bvh;

    /// A closed unit sphere from a subdivided octahedron.
    fn sphere(levels: usize) -> Mesh {
        let p = |x: f32, y: f32, z: f32| Point3::new(x, y, z);
        let mut mesh = Mesh::new(
            vec![p(1., 0., 0.), p(-1., 0., 0.), p(0., 1., 0.), p(0., -1., 0.), p(0., 0., 1.), p(0., 0., -1.)],
            vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]],
        );
        for _ in 0..levels {
            let edges = Edges::new(&mesh.triangles);
            let base = mesh.positions.len() as u32;
            for [a, b] in &edges.vertices {
                let m = nalgebra::center(&mesh.positions[*a as usize], &mesh.positions[*b as usize]);
                mesh.positions.push(Point3::from(m.coords.normalize()));
            }
            let split = |(t, tri): (usize, &[u32; 3])| {
                let m = edges.of_triangle[t].map(|e| base + e);
                [[tri[0], m[0], m[2]], [tri[1], m[1], m[0]], [tri[2], m[2], m[1]], m]
            };
            mesh.triangles = mesh.triangles.iter().enumerate().flat_map(split).collect();
        }
        mesh
    }

    #[test]
    fn a_sphere_stays_closed_and_round_and_keeps_its_attributes() {
        let mut mesh = sphere(5);
        mesh.attributes.insert("height".into(), mesh.positions.iter().map(|p| p.y).collect());
        mesh.colors = mesh.positions.iter().map(|p| [((p.x + 1.0) * 127.0) as u8, 0, 9]).collect();
        let small = decimate(&mesh, 800);
        assert!(small.triangles.len() <= 800 && small.triangles.len() > 700, "{}", small.triangles.len());
        assert!(Edges::new(&small.triangles).is_closed());
        small.validate().unwrap();
        let bvh = Bvh::new(&mesh.positions, &mesh.triangles);
        for (p, h) in small.positions.iter().zip(&small.attributes["height"]) {
            assert!(bvh.closest(p, 1.0).unwrap().distance < 0.01, "{p}");
            assert!((p.y - h).abs() < 0.03, "{} {h}", p.y);
        }
        let lost = mesh.signed_volume() - small.signed_volume();
        assert!(lost.abs() < 0.03, "{lost}"); // inscribed it would lose 0.05
    }

    #[test]
    fn an_open_border_stays_where_it_is() {
        let n = 20;
        let positions = (0..n * n).map(|i| Point3::new((i % n) as f32, (i / n) as f32, 0.0)).collect();
        let quad = |i: usize| {
            let v = (i / (n - 1) * n + i % (n - 1)) as u32;
            [[v, v + 1, v + n as u32], [v + 1, v + n as u32 + 1, v + n as u32]]
        };
        let mesh = Mesh::new(positions, (0..(n - 1) * (n - 1)).flat_map(quad).collect());
        let small = decimate(&mesh, 60);
        assert!(small.triangles.len() <= 60);
        assert!((small.area() - mesh.area()).abs() < 0.05 * mesh.area(), "{} {}", small.area(), mesh.area());
        assert_eq!(small.bounds().map(|b| (b.0.x.round(), b.1.y.round())), Some((0.0, 19.0)));
    }
}
