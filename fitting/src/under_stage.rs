//! One resolution of the fit under a scan: which vertices are covered, and the Gauss–Newton steps.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use toile_character::{Joint, Pose, SkinnedMesh};
use toile_geometry::Mesh;

use crate::{
    FittingError, UnderFit, UnderReport, UnderSettings, Verdict,
    articulated::{Articulated, Columns, Posed, State},
    body_fit::trust_of,
    cloud::{Cloud, Samples},
    correspond::INDEPENDENT,
    equations::{NormalEquations, Residual},
    level::clamped,
    prior::JointPrior,
    thin::Thinned,
};

/// How many independent measurements all cloth together stands for: its stand-off is alike over whole limbs.
const INDEPENDENT_CLOTH: f64 = 50.0;
/// Side of the patches that are covered or uncovered together, metres: about a limb's width.
const PATCH: f32 = 0.12;

/// Sampling and kernels of one resolution, metres.
pub(crate) struct Scale {
    scan_cell: f32,
    mesh_cell: f32,
    distance: f32,
    slip: f32,
    min_cos: f32,
    kernel: f32,
    noise: f32,
}

pub(crate) const COARSE: Scale =
    Scale { scan_cell: 0.03, mesh_cell: 0.045, distance: 0.2, slip: 0.1, min_cos: 0.2, kernel: 0.05, noise: 0.02 };
pub(crate) const MIDDLE: Scale =
    Scale { scan_cell: 0.014, mesh_cell: 0.026, distance: 0.1, slip: 0.04, min_cos: 0.4, kernel: 0.02, noise: 0.006 };
pub(crate) const FINE: Scale =
    Scale { scan_cell: 0.007, mesh_cell: 0.013, distance: 0.05, slip: 0.015, min_cos: 0.5, kernel: 0.0, noise: 0.002 };

/// The mesh to be posed, ready to be thinned.
pub(crate) struct Source<'a> {
    dressed: &'a SkinnedMesh,
    normals: Vec<Vector3<f32>>,
    trust: Vec<f32>,
}

impl<'a> Source<'a> {
    pub fn new(dressed: &'a SkinnedMesh, trust: &[f32]) -> Self {
        let seen = trust_of(&dressed.mesh);
        let trust = if trust.is_empty() { seen } else { seen.iter().zip(trust).map(|(a, b)| a * b).collect() };
        Self { dressed, normals: dressed.mesh.vertex_normals(), trust }
    }
}

pub(crate) struct Target<'a> {
    scan: &'a Mesh,
    normals: Vec<Vector3<f32>>,
    trust: Vec<f32>,
}

impl<'a> Target<'a> {
    pub fn new(scan: &'a Mesh) -> Self {
        Self { scan, normals: scan.vertex_normals(), trust: trust_of(scan) }
    }
}

/// One resolution: thinned mesh and scan.
pub(crate) struct Stage<'a> {
    scale: &'a Scale,
    pub body: Articulated,
    /// Trust and colour of each thinned vertex.
    trust: Vec<f32>,
    colors: Vec<[f32; 3]>,
    patches: Patches,
    pub scan: Cloud,
    settings: &'a UnderSettings,
}

/// Parts of the mesh that are covered or uncovered together: cells of a grid at rest, one limb's vertices each.
struct Patches {
    of_vertex: Vec<u32>,
    count: usize,
}

impl Patches {
    fn new(dressed: &SkinnedMesh, picked: &Thinned) -> Self {
        let key = |v: &u32| {
            let p = dressed.mesh.positions[*v as usize];
            (dressed.weights.joints[*v as usize][0], [p.x, p.y, p.z].map(|c| (c / PATCH).floor() as i32))
        };
        let mut keys: Vec<_> = picked.vertices.iter().map(key).collect();
        keys.sort_unstable();
        keys.dedup();
        let of_vertex = picked.vertices.iter().map(|v| keys.binary_search(&key(v)).unwrap_or(0) as u32).collect();
        Self { of_vertex, count: keys.len() }
    }
}

pub(crate) struct StageEnd {
    pub state: State,
    pub iterations: usize,
    pub converged: bool,
}

pub(crate) struct End {
    pub iterations: usize,
    pub converged: bool,
}

/// How a vertex relates to the scan.
#[derive(Clone, Copy)]
struct Relation {
    residual: Residual,
    /// 0 (covered) to 1 (uncovered).
    uncovered: f64,
}

impl<'a> Stage<'a> {
    pub fn new(
        source: &Source,
        target: &Target,
        scale: &'a Scale,
        settings: &'a UnderSettings,
    ) -> Result<Self, FittingError> {
        let mesh = &source.dressed.mesh;
        let picked = Thinned::new(mesh, &source.normals, scale.mesh_cell, |_| true);
        let of = |v: &u32| mesh.colors.get(*v as usize).map(|c| c.map(f32::from));
        let samples = Samples::of_mesh(target.scan, &target.normals, &target.trust, scale.scan_cell);
        let empty = || FittingError::Scan("its triangles have no area; scan the take again".into());
        Ok(Self {
            scale,
            body: Articulated::of_skinned(source.dressed, &picked),
            trust: picked.vertices.iter().map(|&v| source.trust[v as usize]).collect(),
            colors: picked.vertices.iter().filter_map(of).collect(),
            patches: Patches::new(source.dressed, &picked),
            scan: Cloud::new(samples).ok_or_else(empty)?,
            settings,
        })
    }

    /// Gauss–Newton steps over `joints` from `state`.
    pub fn run(
        &self,
        mut state: State,
        prior: &JointPrior,
        joints: Vec<Joint>,
        iterations: usize,
        inside: bool,
    ) -> Result<StageEnd, FittingError> {
        let columns = Columns::new(joints, 0);
        let (mut done, mut converged) = (0, false);
        while done < iterations && !converged {
            let posed = self.body.pose(&state);
            let residuals = self.residuals(&posed, inside);
            let mut equations = NormalEquations::sum(&residuals, &self.body, &posed, &columns);
            prior.add(&mut equations, &state, &posed, &columns);
            let delta = equations.step(1e-4).ok_or(FittingError::Singular { what: "the pose under the scan" })?;
            converged = delta.iter().all(|d| d.abs() < 2e-4);
            state = state.stepped(&clamped(delta.as_slice(), &columns), &columns, &posed.frames);
            done += 1;
        }
        Ok(StageEnd { state, iterations: done, converged })
    }

    /// What pulls each vertex: the scan itself where it is uncovered; where it is covered, the scan's inner side
    /// strongly and the middle of the sleeve a little.
    fn residuals(&self, posed: &Posed, inside: bool) -> Vec<Residual> {
        let relations = self.relations(posed);
        let total: f64 = self.body.areas.iter().map(|&a| f64::from(a)).sum::<f64>().max(1e-12);
        let match_scale = INDEPENDENT / (total * f64::from(self.scale.noise).powi(2));
        let inside_scale = INDEPENDENT / (total * self.settings.inside_sigma.max(f64::from(self.scale.noise)).powi(2));
        let center_scale = INDEPENDENT_CLOTH / (total * self.settings.stand_off.powi(2));
        let mut out = Vec::with_capacity(relations.len());
        for Relation { mut residual, uncovered } in relations.into_iter().flatten() {
            let (area, covered) = (residual.weight, 1.0 - uncovered);
            let cloth = if residual.value > 0.0 { inside_scale } else { center_scale };
            residual.weight = area * (uncovered * match_scale + if inside { covered * cloth } else { 0.0 });
            if residual.weight > 0.0 {
                out.push(residual);
            }
        }
        out
    }

    fn relations(&self, posed: &Posed) -> Vec<Option<Relation>> {
        let mut all: Vec<Option<Relation>> =
            (0..self.body.len()).into_par_iter().with_min_len(128).map(|v| self.relation(posed, v)).collect();
        self.agree_with_surroundings(&mut all);
        all
    }

    /// Cloth covers patches, not points: where most of a patch is covered, a vertex that happens to lie near the cloth
    /// (the knee at the front of the trousers) is covered too.
    fn agree_with_surroundings(&self, all: &mut [Option<Relation>]) {
        let mut sums = vec![(0.0, 0.0); self.patches.count];
        for (v, relation) in all.iter().enumerate() {
            let sum = &mut sums[self.patches.of_vertex[v] as usize];
            let area = f64::from(self.body.areas[v]);
            *sum = (sum.0 + area, sum.1 + relation.map_or(0.0, |r| area * r.uncovered));
        }
        for (v, relation) in all.iter_mut().enumerate() {
            let (area, open) = sums[self.patches.of_vertex[v] as usize];
            if let Some(r) = relation {
                r.uncovered *= (1.5 * open / f64::max(area, 1e-12)).min(1.0).powi(2);
            }
        }
    }

    fn relation(&self, posed: &Posed, v: usize) -> Option<Relation> {
        let s = self.scale;
        let p = &posed.points[v];
        let q = self.scan.nearest(p, &posed.normals[v], s.distance, s.min_cos)? as usize;
        let samples = &self.scan.samples;
        let (point, normal) = (samples.points[q], samples.normals[q]);
        let d = p - point;
        let value = d.dot(&normal);
        if (d - normal * value).norm() > s.slip {
            return None;
        }
        let seen = f64::from(samples.weights[q] / samples.areas[q].max(f32::MIN_POSITIVE));
        let weight = f64::from(self.body.areas[v]) * seen;
        let residual = Residual { vertex: v as u32, normal, value, weight };
        Some(Relation { residual, uncovered: self.uncovered(v, q, value) })
    }

    /// Robust weight of a match: near, trusted, of the same colour.
    fn uncovered(&self, v: usize, q: usize, value: f32) -> f64 {
        let kernel = f64::from(self.scale.kernel).max(self.settings.cloth);
        let squared = kernel * kernel;
        let near = (squared / (squared + f64::from(value).powi(2))).powi(2);
        near * f64::from(self.trust[v]) * self.color_agreement(v, q)
    }

    fn color_agreement(&self, v: usize, q: usize) -> f64 {
        let (Some(a), Some(b)) = (self.colors.get(v), self.scan.samples.colors.get(q)) else { return 1.0 };
        let squared = (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f32>() / 3.0;
        let half = f64::from(self.settings.color.max(1.0)).powi(2);
        // never nothing: light and shadow change colours too
        0.02 + 0.98 * (half / (half + f64::from(squared))).powi(2)
    }

    /// Share of the area that does not agree with the scan, 0–1.
    pub fn misfit(&self, state: &State) -> f64 {
        let relations = self.relations(&self.body.pose(state));
        let (mut cost, mut total) = (0.0, 0.0);
        for (relation, &area) in relations.iter().zip(&self.body.areas) {
            total += f64::from(area);
            cost += f64::from(area) * (1.0 - relation.map_or(0.0, |r| r.uncovered));
        }
        cost / f64::max(total, 1e-12)
    }

    pub fn finish(&self, dressed: &SkinnedMesh, source: &Source, state: State, initial: &Pose, end: End) -> UnderFit {
        let relations = self.relations(&self.body.pose(&state));
        let mut report = self.report(&relations, &end);
        let turn = state.pose.rotation(Joint::Hips) * initial.rotation(Joint::Hips).inverse();
        let front = turn * Vector3::z();
        report.heading_deg = front.x.atan2(front.z).to_degrees();
        report.decide();
        let uncovered = self.uncovered_vertices(dressed, source, &state);
        UnderFit { pose: state.pose, uncovered, report }
    }

    fn report(&self, relations: &[Option<Relation>], end: &End) -> UnderReport {
        let (mut total, mut open, mut squares, mut outside) = (0.0, 0.0, 0.0, 0.0);
        for (relation, &area) in relations.iter().zip(&self.body.areas) {
            let area = f64::from(area);
            total += area;
            let Some(r) = relation else { continue };
            open += area * r.uncovered;
            squares += area * r.uncovered * f64::from(r.residual.value).powi(2);
            outside += if r.residual.value > 0.002 { area } else { 0.0 };
        }
        let total = f64::max(total, 1e-12);
        UnderReport {
            verdict: Verdict::Trusted,
            reasons: Vec::new(),
            iterations: end.iterations,
            converged: end.converged,
            heading_deg: 0.0,
            uncovered: open / total,
            uncovered_rms_mm: 1e3 * (squares / f64::max(open, 1e-12)).sqrt(),
            outside: outside / total,
        }
    }

    /// How surely each vertex of the whole mesh is uncovered.
    fn uncovered_vertices(&self, dressed: &SkinnedMesh, source: &Source, state: &State) -> Vec<f32> {
        let positions = dressed.posed(&state.pose);
        let normals = toile_geometry::mesh::vertex_normals(&positions, &dressed.mesh.triangles);
        (0..positions.len())
            .into_par_iter()
            .with_min_len(128)
            .map(|v| {
                let p: &Point3<f32> = &positions[v];
                let Some(q) = self.scan.nearest(p, &normals[v], self.scale.distance, self.scale.min_cos) else {
                    return 0.0;
                };
                let q = q as usize;
                let value = f64::from((p - self.scan.samples.points[q]).dot(&self.scan.samples.normals[q]));
                let squared = self.settings.cloth.powi(2);
                ((squared / (squared + value * value)).powi(2)) as f32 * source.trust[v]
            })
            .collect()
    }
}
