//! A mesh while its edges are collapsed, cheapest first.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::{corners::Corners, quadric::Quadric, rings::Rings};
use crate::Mesh;

/// Weight of the planes that hold open borders in place.
const BORDER: f64 = 20.0;
/// Weight of the middle of the edge: keeps flat parts evenly meshed.
const SHAPE: f64 = 1e-4;
/// Cost of a colour difference of the whole range across an edge, as a distance in edge lengths.
const COLOR: f64 = 0.05;
/// A triangle may not turn by more than this (cosine) in one collapse.
const TURN: f64 = 0.3;

/// A mesh while its edges are collapsed.
pub(super) struct Collapser {
    positions: Vec<Point3<f64>>,
    quadrics: Vec<Quadric>,
    pub(super) corners: Corners,
    /// Vertices on an open border.
    open: Vec<bool>,
    /// Vertices that a collapse of the present round has moved or removed.
    touched: Vec<bool>,
    /// Merged attribute values: colours (0..255) and named attributes, one row a vertex.
    rows: Vec<f32>,
    width: usize,
    colors: usize,
}

impl Collapser {
    pub(super) fn new(mesh: &Mesh) -> Self {
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
            corners: Corners::new(mesh.triangles.clone(), count),
            open: vec![false; count],
            touched: vec![false; count],
            rows,
            width,
            colors,
        };
        state.add_planes();
        state
    }

    fn add_planes(&mut self) {
        for t in 0..self.corners.triangles.len() {
            let tri = self.corners.triangles[t];
            let [a, b, c] = tri.map(|v| self.positions[v as usize]);
            let cross = (b - a).cross(&(c - a));
            let area = cross.norm();
            let Some(n) = cross.try_normalize(1e-30) else { continue };
            for v in tri {
                self.quadrics[v as usize].add_plane(&n, &a, area / 6.0);
            }
            for k in 0..3 {
                let (p, q) = (tri[k], tri[(k + 1) % 3]);
                if !self.corners.is_single(p, q) {
                    continue;
                }
                self.open[p as usize] = true;
                self.open[q as usize] = true;
                let along = self.positions[q as usize] - self.positions[p as usize];
                let Some(m) = along.cross(&n).try_normalize(1e-30) else { continue };
                let weight = BORDER * along.norm_squared();
                let on = self.positions[p as usize];
                self.quadrics[p as usize].add_plane(&m, &on, weight);
                self.quadrics[q as usize].add_plane(&m, &on, weight);
            }
        }
    }

    /// One round of collapses, cheapest first; returns the number of triangles that went.
    pub(super) fn round(&mut self, target: usize, share: f64, rings: &mut Rings) -> usize {
        let (edges, order) = self.cheapest(share);
        self.touched.iter_mut().for_each(|t| *t = false);
        let before = self.corners.triangles.len();
        let mut left = before;
        for key in order {
            if left <= target {
                break;
            }
            let [u, v] = edges[(key & u64::from(u32::MAX)) as usize];
            if !self.touched[u as usize] && !self.touched[v as usize] {
                left -= self.collapse(u, v, rings);
            }
        }
        if left < before {
            self.corners.chain();
        }
        before - left
    }

    /// All edges, and the cheapest share of them as keys in ascending order: cost above, index below.
    fn cheapest(&self, share: f64) -> (Vec<[u32; 2]>, Vec<u64>) {
        let side = |&[u, v]: &[u32; 2]| {
            u < v || self.open[u as usize] && self.open[v as usize] && self.corners.is_single(u, v)
        };
        let sides = |t: &[u32; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
        let edges: Vec<[u32; 2]> = self.corners.triangles.iter().flat_map(sides).filter(side).collect();
        let key =
            |(i, &[u, v]): (usize, &[u32; 2])| u64::from((self.best_point(u, v).1 as f32).to_bits()) << 32 | i as u64;
        let mut keys: Vec<u64> = edges.par_iter().with_min_len(4096).enumerate().map(key).collect();
        let wanted = ((keys.len() as f64 * share) as usize).max(64);
        if wanted < keys.len() {
            keys.select_nth_unstable(wanted);
            keys.truncate(wanted);
        }
        keys.sort_unstable();
        (edges, keys)
    }

    /// The point with the minimum quadric error for a collapse, and its cost (at least 0).
    fn best_point(&self, u: u32, v: u32) -> (Point3<f64>, f64) {
        let (p, q) = (self.positions[u as usize], self.positions[v as usize]);
        let middle = nalgebra::center(&p, &q);
        let length2 = (p - q).norm_squared();
        let quadric = self.held(u, v, &middle);
        let solved = quadric.inverse().map(|i| quadric.minimum(&i));
        let point = solved.filter(|x| (x - middle).norm_squared() < 4.0 * length2).unwrap_or_else(|| {
            let all = [p, q, middle];
            all.into_iter().min_by(|a, b| quadric.at(a).total_cmp(&quadric.at(b))).unwrap_or(middle)
        });
        let row = |v: u32| &self.rows[v as usize * self.width..][..self.colors];
        let difference: f64 = row(u).iter().zip(row(v)).map(|(a, b)| f64::from((a - b) / 255.0).powi(2)).sum();
        (point, quadric.at(&point).max(0.0) + COLOR * COLOR * difference * length2 * length2)
    }

    /// The quadric of a collapsed edge, held towards its middle.
    fn held(&self, u: u32, v: u32, middle: &Point3<f64>) -> Quadric {
        let mut quadric = self.quadrics[u as usize].plus(&self.quadrics[v as usize]);
        quadric.add_point(middle, SHAPE * quadric.trace().max(1e-12));
        quadric
    }

    /// Merges `v` into `u` where that is allowed; returns the number of triangles that went.
    fn collapse(&mut self, u: u32, v: u32, rings: &mut Rings) -> usize {
        rings.gather(&self.corners, u, v);
        if rings.shared.is_empty() || !self.keeps_topology(u, v, rings) {
            return 0;
        }
        let least = self.best_point(u, v).0;
        let kept = self.keep_volume(u, v, &least, rings).filter(|p| self.keeps_sides(u, v, p, rings));
        let Some(point) = kept.or_else(|| Some(least).filter(|p| self.keeps_sides(u, v, p, rings))) else { return 0 };
        self.blend_rows(u, v, &point);
        self.positions[u as usize] = point;
        self.quadrics[u as usize] = self.quadrics[u as usize].plus(&self.quadrics[v as usize]);
        self.open[u as usize] |= self.open[v as usize];
        self.corners.merge(u, v, &rings.shared, &rings.triangles[1]);
        self.touched[u as usize] = true;
        self.touched[v as usize] = true;
        rings.shared.len()
    }

    /// The point `least` moved, where the quadric grows least, onto the plane of points that keep the volume.
    fn keep_volume(&self, u: u32, v: u32, least: &Point3<f64>, rings: &Rings) -> Option<Point3<f64>> {
        let (p, q) = (self.positions[u as usize], self.positions[v as usize]);
        if self.open[u as usize] || self.open[v as usize] {
            return None;
        }
        let middle = nalgebra::center(&p, &q);
        // Six volumes about the middle: what the triangles around hold now, and what one corner at x would.
        let (mut held, mut gradient) = (0.0, Vector3::zeros());
        let mut add = |t: u32, moving: bool| {
            let tri = self.corners.triangles[t as usize];
            let [a, b, c] = tri.map(|k| self.positions[k as usize] - middle);
            held += a.dot(&b.cross(&c));
            if moving {
                let at = tri.iter().position(|&k| k == u || k == v).unwrap_or(0);
                let [b, c] = [1, 2].map(|k| self.positions[tri[(at + k) % 3] as usize] - middle);
                gradient += b.cross(&c);
            }
        };
        rings.shared.iter().for_each(|&t| add(t, false));
        rings.triangles.iter().flatten().for_each(|&t| add(t, true));
        let inverse = self.held(u, v, &middle).inverse()?;
        let way = inverse * gradient;
        let slope = gradient.dot(&way);
        let step = way * ((held - gradient.dot(&(least - middle))) / slope);
        (slope > 0.0 && step.norm_squared() < 0.25 * (p - q).norm_squared()).then(|| least + step)
    }

    /// The link condition: the ends share exactly the vertices opposite the edge, and no border is pinched.
    fn keeps_topology(&self, u: u32, v: u32, rings: &Rings) -> bool {
        let (shared, [around_u, around_v]) = (rings.shared.len(), &rings.neighbors);
        let common = around_u.iter().filter(|n| around_v.contains(n)).count();
        if common != shared || shared > 2 || around_u.len() + around_v.len() < shared + 5 {
            return false;
        }
        shared == 1 || !(self.open[u as usize] && self.open[v as usize])
    }

    /// No remaining triangle turns over or becomes a needle.
    fn keeps_sides(&self, u: u32, v: u32, point: &Point3<f64>, rings: &Rings) -> bool {
        rings.triangles.iter().flatten().all(|&t| {
            let tri = self.corners.triangles[t as usize];
            let old = tri.map(|c| self.positions[c as usize]);
            let new = tri.map(|c| if c == u || c == v { *point } else { self.positions[c as usize] });
            let n0 = (old[1] - old[0]).cross(&(old[2] - old[0]));
            let n1 = (new[1] - new[0]).cross(&(new[2] - new[0]));
            let longest = (0..3).map(|k| (new[k] - new[(k + 1) % 3]).norm_squared()).fold(0.0, f64::max);
            let size = n1.norm();
            size > 0.02 * longest && n0.dot(&n1) >= TURN * n0.norm() * size
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

    pub(super) fn into_mesh(self, source: &Mesh) -> Mesh {
        let row = |v: usize, k: usize| self.rows[v * self.width + k];
        let color = |v: usize| [0, 1, 2].map(|k| row(v, k).round().clamp(0.0, 255.0) as u8);
        let count = self.positions.len();
        let attribute = |k: usize| (0..count).map(|v| row(v, self.colors + k)).collect();
        let all = Mesh {
            positions: self.positions.iter().map(|p| p.cast()).collect(),
            triangles: self.corners.triangles.clone(),
            normals: Vec::new(),
            colors: if self.colors > 0 { (0..count).map(color).collect() } else { Vec::new() },
            attributes: source.attributes.keys().enumerate().map(|(k, n)| (n.clone(), attribute(k))).collect(),
        };
        let (mut mesh, _) = all.filter_triangles(|_| true);
        if !source.normals.is_empty() {
            mesh.recompute_normals();
        }
        mesh
    }
}
