//! Isotropic remeshing (Botsch and Kobbelt 2004): long edges split, short ones collapsed, valences evened out,
//! vertices relaxed in the tangent plane and projected back onto the surface. Open rims stay on their curve.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use crate::{
    Mesh,
    bvh::{Bvh, Closest},
    topology::Edges,
};

/// Rounds of split, collapse, flip, relax.
const ROUNDS: usize = 4;
/// A new triangle may turn at most this much (cosine) against the one that it replaces.
const TURN: f32 = 0.3;

/// The same surface in triangles with edges of about `edge_length` metres. Colours, normals and attributes are
/// interpolated from the closest point of `mesh`.
pub fn isotropic(mesh: &Mesh, edge_length: f32) -> Mesh {
    if mesh.is_empty() || edge_length.is_nan() || edge_length <= 0.0 {
        return mesh.clone();
    }
    let bvh = Bvh::new(&mesh.positions, &mesh.triangles);
    let mut work = Work::new(mesh);
    for _ in 0..ROUNDS {
        work.split_long(edge_length * 4.0 / 3.0);
        work.collapse_short(edge_length * 0.8, edge_length * 4.0 / 3.0);
        work.even_valences();
        work.relax(&bvh, edge_length);
    }
    let triangles: Vec<[u32; 3]> =
        (0..work.triangles.len()).filter(|&t| work.alive(t)).map(|t| work.triangles[t]).collect();
    let bare = Mesh::new(work.positions, triangles).filter_triangles(|_| true).0;
    with_attributes(bare, mesh, &bvh)
}

/// Carries everything but positions over from the closest points of `source`.
fn with_attributes(mut mesh: Mesh, source: &Mesh, bvh: &Bvh) -> Mesh {
    let hits: Vec<Closest> = mesh.positions.iter().filter_map(|p| bvh.closest(p, f32::INFINITY)).collect();
    if hits.len() != mesh.positions.len() {
        return mesh;
    }
    let corners = |h: &Closest| source.triangles[h.triangle as usize].map(|v| v as usize);
    if !source.colors.is_empty() {
        let channel = |h: &Closest, k: usize| {
            let sum: f32 = corners(h).iter().zip(h.barycentric).map(|(&v, w)| f32::from(source.colors[v][k]) * w).sum();
            sum.round() as u8
        };
        mesh.colors = hits.iter().map(|h| std::array::from_fn(|k| channel(h, k))).collect();
    }
    for (name, values) in &source.attributes {
        let value = |h: &Closest| corners(h).iter().zip(h.barycentric).map(|(&v, w)| values[v] * w).sum();
        mesh.attributes.insert(name.clone(), hits.iter().map(value).collect());
    }
    if !source.normals.is_empty() {
        mesh.recompute_normals();
    }
    mesh
}

struct Work {
    positions: Vec<Point3<f32>>,
    triangles: Vec<[u32; 3]>,
    around: Vec<Vec<u32>>,
}

impl Work {
    fn new(mesh: &Mesh) -> Self {
        let mut around = vec![Vec::new(); mesh.positions.len()];
        for (t, tri) in mesh.triangles.iter().enumerate() {
            tri.iter().for_each(|&v| around[v as usize].push(t as u32));
        }
        Self { positions: mesh.positions.clone(), triangles: mesh.triangles.clone(), around }
    }

    fn alive(&self, t: usize) -> bool {
        self.triangles[t][0] != u32::MAX
    }

    fn length(&self, [a, b]: [u32; 2]) -> f32 {
        (self.positions[a as usize] - self.positions[b as usize]).norm()
    }

    /// Edges of the living triangles, ascending.
    fn edges(&self) -> Vec<[u32; 2]> {
        let mut edges: Vec<[u32; 2]> = (0..self.triangles.len())
            .filter(|&t| self.alive(t))
            .flat_map(|t| {
                let [a, b, c] = self.triangles[t];
                [[a, b], [b, c], [c, a]].map(|[i, j]| [i.min(j), i.max(j)])
            })
            .collect();
        edges.sort_unstable();
        edges.dedup();
        edges
    }

    fn at_edge(&self, [a, b]: [u32; 2]) -> Vec<u32> {
        self.around[a as usize].iter().copied().filter(|&t| self.triangles[t as usize].contains(&b)).collect()
    }

    fn on_rim(&self, v: u32) -> bool {
        self.neighbors(v).iter().any(|&n| self.at_edge([v, n]).len() != 2)
    }

    fn neighbors(&self, v: u32) -> Vec<u32> {
        let mut out: Vec<u32> = self.around[v as usize].iter().flat_map(|&t| self.triangles[t as usize]).collect();
        out.sort_unstable();
        out.dedup();
        out.retain(|&n| n != v);
        out
    }

    fn normal(&self, tri: [u32; 3]) -> Vector3<f32> {
        let [a, b, c] = tri.map(|v| self.positions[v as usize]);
        (b - a).cross(&(c - a))
    }

    fn split_long(&mut self, max_length: f32) {
        let mut edges: Vec<(f32, [u32; 2])> = self.edges().into_iter().map(|e| (self.length(e), e)).collect();
        edges.retain(|e| e.0 > max_length);
        edges.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        for (_, [a, b]) in edges {
            let both = self.at_edge([a, b]);
            let middle = self.positions.len() as u32;
            self.positions.push(nalgebra::center(&self.positions[a as usize], &self.positions[b as usize]));
            self.around.push(Vec::new());
            for t in both {
                let old = self.triangles[t as usize];
                let new = self.triangles.len() as u32;
                self.triangles[t as usize] = old.map(|v| if v == b { middle } else { v });
                self.triangles.push(old.map(|v| if v == a { middle } else { v }));
                let third = old.into_iter().find(|&v| v != a && v != b).unwrap_or(a);
                self.around[b as usize].retain(|&x| x != t);
                self.around[b as usize].push(new);
                self.around[third as usize].push(new);
                self.around[middle as usize].extend([t, new]);
            }
        }
    }

    fn collapse_short(&mut self, min_length: f32, max_length: f32) {
        let mut edges: Vec<(f32, [u32; 2])> = self.edges().into_iter().map(|e| (self.length(e), e)).collect();
        edges.retain(|e| e.0 < min_length);
        edges.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for (_, [a, b]) in edges {
            let exists = !self.at_edge([a, b]).is_empty();
            if exists && self.length([a, b]) < min_length {
                self.collapse(a, b, max_length);
            }
        }
    }

    /// Merges b into a where that keeps the surface a surface.
    fn collapse(&mut self, a: u32, b: u32, max_length: f32) {
        let both = self.at_edge([a, b]);
        let (rim_a, rim_b) = (self.on_rim(a), self.on_rim(b));
        let (na, nb) = (self.neighbors(a), self.neighbors(b));
        let common = na.iter().filter(|n| nb.contains(n)).count();
        let bridges = rim_a && rim_b && both.len() == 2;
        if both.len() > 2 || common != both.len() || bridges || (common == 2 && na.len() + nb.len() < 8) {
            return;
        }
        let target = match (rim_a, rim_b) {
            (true, false) => self.positions[a as usize],
            (false, true) => self.positions[b as usize],
            _ => nalgebra::center(&self.positions[a as usize], &self.positions[b as usize]),
        };
        let too_long = |n: &u32| (self.positions[*n as usize] - target).norm() > max_length;
        if na.iter().chain(&nb).any(|n| *n != a && *n != b && too_long(n)) || !self.keeps_sides(a, b, &both, target) {
            return;
        }
        self.positions[a as usize] = target;
        for &t in &both {
            for v in self.triangles[t as usize] {
                self.around[v as usize].retain(|&x| x != t);
            }
            self.triangles[t as usize] = [u32::MAX; 3];
        }
        for t in std::mem::take(&mut self.around[b as usize]) {
            self.triangles[t as usize] = self.triangles[t as usize].map(|v| if v == b { a } else { v });
            self.around[a as usize].push(t);
        }
    }

    /// True where no triangle around a or b turns over when both move to `target`.
    fn keeps_sides(&self, a: u32, b: u32, both: &[u32], target: Point3<f32>) -> bool {
        self.around[a as usize].iter().chain(&self.around[b as usize]).filter(|t| !both.contains(t)).all(|&t| {
            let tri = self.triangles[t as usize];
            let [p, q, r] = tri.map(|v| if v == a || v == b { target } else { self.positions[v as usize] });
            let (old, new) = (self.normal(tri), (q - p).cross(&(r - p)));
            old.dot(&new) > TURN * old.norm() * new.norm() && new.norm() > 0.0
        })
    }

    fn even_valences(&mut self) {
        let edges = self.edges();
        let mut valence: Vec<i32> = vec![0; self.positions.len()];
        let mut uses: BTreeMap<u32, bool> = BTreeMap::new();
        for &[a, b] in &edges {
            valence[a as usize] += 1;
            valence[b as usize] += 1;
            if self.at_edge([a, b]).len() != 2 {
                uses.insert(a, true);
                uses.insert(b, true);
            }
        }
        for [a, b] in edges {
            let both = self.at_edge([a, b]);
            let [s, t] = both[..] else { continue };
            let apex = |t: u32| self.triangles[t as usize].into_iter().find(|&v| v != a && v != b).unwrap_or(a);
            let (c, d) = (apex(s), apex(t));
            let miss = |v: u32, change: i32| {
                let goal = if uses.contains_key(&v) { 4 } else { 6 };
                (valence[v as usize] + change - goal).pow(2)
            };
            let before = miss(a, 0) + miss(b, 0) + miss(c, 0) + miss(d, 0);
            let after = miss(a, -1) + miss(b, -1) + miss(c, 1) + miss(d, 1);
            if after < before && c != d && self.at_edge([c, d]).is_empty() && self.flip([a, b], [c, d], [s, t]) {
                for (v, change) in [(a, -1), (b, -1), (c, 1), (d, 1)] {
                    valence[v as usize] += change;
                }
            }
        }
    }

    /// Replaces edge ab by cd where neither new triangle turns over.
    fn flip(&mut self, [a, b]: [u32; 2], [c, d]: [u32; 2], [s, t]: [u32; 2]) -> bool {
        let old = [self.triangles[s as usize], self.triangles[t as usize]];
        // Triangle s keeps its direction with b replaced by d, triangle t with a replaced by c.
        let new = [old[0].map(|v| if v == b { d } else { v }), old[1].map(|v| if v == a { c } else { v })];
        let mean = self.normal(old[0]) + self.normal(old[1]);
        let fits = |tri: [u32; 3]| {
            let n = self.normal(tri);
            n.dot(&mean) > 0.7 * n.norm() * mean.norm() && n.norm() > 1e-12
        };
        if !new.into_iter().all(fits) {
            return false;
        }
        (self.triangles[s as usize], self.triangles[t as usize]) = (new[0], new[1]);
        self.around[b as usize].retain(|&x| x != s);
        self.around[a as usize].retain(|&x| x != t);
        self.around[d as usize].push(s);
        self.around[c as usize].push(t);
        true
    }

    /// Moves inner vertices towards their neighbours' centre within the tangent plane, then onto the surface.
    fn relax(&mut self, bvh: &Bvh, edge_length: f32) {
        let living: Vec<[u32; 3]> = self.triangles.iter().copied().filter(|t| t[0] != u32::MAX).collect();
        let edges = Edges::new(&living);
        let normals = crate::mesh::vertex_normals(&self.positions, &living);
        let mut sums = vec![(Vector3::<f32>::zeros(), 0u32, true); self.positions.len()];
        for (&[a, b], &uses) in edges.vertices.iter().zip(&edges.uses) {
            for (v, n) in [(a, b), (b, a)] {
                let sum = &mut sums[v as usize];
                sum.0 += self.positions[n as usize].coords;
                sum.1 += 1;
                sum.2 &= uses == 2;
            }
        }
        for (v, (sum, count, inner)) in sums.into_iter().enumerate() {
            if !inner || count == 0 {
                continue;
            }
            let p = self.positions[v];
            let step = (sum / count as f32 - p.coords) * 0.5;
            let moved = p + step - normals[v] * step.dot(&normals[v]);
            let on_surface = bvh.closest(&moved, 2.0 * edge_length).map_or(moved, |h| h.point);
            let fits = self.around[v].iter().all(|&t| {
                let tri = self.triangles[t as usize];
                let [a, b, c] = tri.map(|u| if u as usize == v { on_surface } else { self.positions[u as usize] });
                let (old, new) = (self.normal(tri), (b - a).cross(&(c - a)));
                old.dot(&new) > TURN * old.norm() * new.norm()
            });
            if fits {
                self.positions[v] = on_surface;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::topology::boundary_loops;

    /// An open tube of radius 0.1 and height 0.3 in 40 × 60 thin quads, its angle as attribute.
    fn tube() -> Mesh {
        let (n, rows) = (40u32, 60u32);
        let angle = |i: u32| i as f32 / n as f32 * std::f32::consts::TAU;
        let positions: Vec<Point3<f32>> = (0..=rows)
            .flat_map(|r| (0..n).map(move |i| (r, i)))
            .map(|(r, i)| Point3::new(0.1 * angle(i).sin(), 0.3 * r as f32 / rows as f32, 0.1 * angle(i).cos()))
            .collect();
        let triangles = (0..rows)
            .flat_map(|r| (0..n).map(move |i| (r * n + i, r * n + (i + 1) % n)))
            .flat_map(|(a, b)| [[a, b, b + n], [a, b + n, a + n]])
            .collect();
        let mut mesh = Mesh::new(positions, triangles);
        mesh.attributes.insert("height".into(), mesh.positions.iter().map(|p| p.y).collect());
        mesh
    }

    #[test]
    fn edges_become_even_and_the_shape_stays() {
        let before = tube();
        let after = isotropic(&before, 0.012);
        after.validate().unwrap();
        let edges = Edges::new(&after.triangles);
        assert!(edges.uses.iter().all(|&u| u <= 2));
        assert_eq!(boundary_loops(&after.triangles).len(), 2);
        let length = |e: &[u32; 2]| (after.positions[e[0] as usize] - after.positions[e[1] as usize]).norm();
        let good = edges.vertices.iter().filter(|e| (0.006..0.018).contains(&length(e))).count();
        assert!(good as f32 > 0.97 * edges.vertices.len() as f32, "{good} of {}", edges.vertices.len());
        assert!((after.area() / before.area() - 1.0).abs() < 0.02);
        assert!(after.positions.iter().all(|p| (p.x.hypot(p.z) - 0.1).abs() < 0.002));
        assert!(after.positions.iter().zip(&after.attributes["height"]).all(|(p, h)| (p.y - h).abs() < 1e-4));
        assert!(after.triangle_normals().iter().zip(&after.triangles).all(|(n, t)| {
            let p = after.positions[t[0] as usize];
            n.dot(&Vector3::new(p.x, 0.0, p.z)) > 0.0
        }));
    }

    #[test]
    fn nothing_stays_nothing() {
        assert!(isotropic(&Mesh::default(), 0.01).is_empty());
        assert_eq!(isotropic(&tube(), 0.0), tube());
    }
}
