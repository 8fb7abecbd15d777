//! A mesh under a scan at one resolution: which of its vertices are covered, and what draws them.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use toile_character::{Joint, SkinnedMesh};
use toile_geometry::{Mesh, mesh::vertex_normals};

use super::patches::Patches;
use crate::{
    FittingError, UnderSettings,
    solve::{
        Articulated, Columns, Gate, INDEPENDENT, JointPrior, Linearised, NormalEquations, Posed, Problem, Residual,
        State,
    },
    surface::{Cloud, Samples, Thinned, trust_of},
};

/// Number of independent measurements that all cloth together stands for: its stand-off is alike over whole limbs.
const INDEPENDENT_CLOTH: f64 = 50.0;
/// A step below this ends a resolution, metres and radians.
const SMALL_STEP: f64 = 2e-4;
/// Share of a patch that must be uncovered for a vertex in it to count fully is the inverse of this.
const SURROUNDINGS: f64 = 1.5;
/// The minimum weight of a match of any colour: light and shadow change colours too.
const ANY_COLOR: f64 = 0.02;

/// Sampling, gate and effort of one resolution.
pub(crate) struct Resolution {
    /// Cell of the scan's samples, metres.
    scan_cell: f32,
    /// Cell of the mesh's vertices, metres.
    mesh_cell: f32,
    gate: Gate,
}

/// The heading is still open: as far as arms swing out when the person steps again.
pub(crate) const COARSE: Resolution = Resolution {
    scan_cell: 0.03,
    mesh_cell: 0.045,
    gate: Gate { distance: 0.2, slip: 0.1, min_cos: 0.2, kernel: 0.05, noise: 0.02, cloth: None },
};
/// Within a hand's thickness.
pub(crate) const MIDDLE: Resolution = Resolution {
    scan_cell: 0.014,
    mesh_cell: 0.026,
    gate: Gate { distance: 0.1, slip: 0.04, min_cos: 0.4, kernel: 0.02, noise: 0.006, cloth: None },
};
/// The kernel is that of the cloth, from the settings.
pub(crate) const FINE: Resolution = Resolution {
    scan_cell: 0.007,
    mesh_cell: 0.013,
    gate: Gate { distance: 0.05, slip: 0.015, min_cos: 0.5, kernel: 0.0, noise: 0.002, cloth: None },
};

/// The mesh to be posed, ready to be thinned.
pub(crate) struct Source<'a> {
    pub dressed: &'a SkinnedMesh,
    normals: Vec<Vector3<f32>>,
    /// How surely each vertex is seen unchanged, 0–1.
    pub trust: Vec<f32>,
}

impl<'a> Source<'a> {
    /// `trust` has one entry a vertex, or none.
    pub fn new(dressed: &'a SkinnedMesh, trust: &[f32]) -> Self {
        let seen = trust_of(&dressed.mesh);
        let trust = if trust.is_empty() { seen } else { seen.iter().zip(trust).map(|(a, b)| a * b).collect() };
        Self { dressed, normals: dressed.mesh.vertex_normals(), trust }
    }
}

/// The scan with its normals and trust.
pub(crate) struct Target<'a> {
    pub scan: &'a Mesh,
    normals: Vec<Vector3<f32>>,
    trust: Vec<f32>,
}

impl<'a> Target<'a> {
    pub fn new(scan: &'a Mesh) -> Self {
        Self { scan, normals: scan.vertex_normals(), trust: trust_of(scan) }
    }
}

/// Thinned mesh and scan of one resolution.
pub(crate) struct Sampled<'a> {
    gate: Gate,
    pub body: Articulated,
    /// Trust and colour of each thinned vertex.
    trust: Vec<f32>,
    colors: Vec<[f32; 3]>,
    patches: Patches,
    pub scan: Cloud,
    settings: &'a UnderSettings,
}

/// How a vertex relates to the scan.
#[derive(Clone, Copy)]
pub(crate) struct Relation {
    pub residual: Residual,
    /// 0 (covered) to 1 (uncovered).
    pub uncovered: f64,
}

/// The pose of a mesh under a scan.
pub(crate) struct UnderProblem<'a> {
    sampled: &'a Sampled<'a>,
    prior: &'a JointPrior,
    columns: Columns,
    /// Whether covered vertices are drawn too: inside the scan, and to the middle of the sleeve.
    inside: bool,
}

impl Problem for UnderProblem<'_> {
    fn columns(&self) -> &Columns {
        &self.columns
    }

    fn linearised(&self, state: &State) -> Linearised {
        let posed = self.sampled.body.pose(state);
        let residuals = self.weighed(self.sampled.relations(&posed));
        let mut equations = NormalEquations::accumulate(&residuals, &self.sampled.body, &posed, &self.columns);
        self.prior.add(&mut equations, state, &posed.frames, &self.columns);
        Linearised { equations, frames: posed.frames, bounds: Vec::new() }
    }

    fn is_small(&self, step: &[f64], _: f64) -> bool {
        step.iter().all(|d| d.abs() < SMALL_STEP)
    }

    fn solved_for(&self) -> &'static str {
        "the pose under the scan"
    }
}

impl UnderProblem<'_> {
    /// The surface that draws each vertex: the scan itself where it is uncovered; where it is covered, the scan's inner side
    /// strongly and the middle of the sleeve a little.
    fn weighed(&self, relations: Vec<Option<Relation>>) -> Vec<Residual> {
        let Sampled { body, settings, gate, .. } = self.sampled;
        let noise = f64::from(gate.noise);
        let total: f64 = body.areas.iter().map(|&a| f64::from(a)).sum::<f64>().max(1e-12);
        let match_scale = INDEPENDENT / (total * noise.powi(2));
        let inside_scale = INDEPENDENT / (total * settings.inside_sigma.max(noise).powi(2));
        let center_scale = INDEPENDENT_CLOTH / (total * settings.stand_off.powi(2));
        let mut out = Vec::with_capacity(relations.len());
        for Relation { mut residual, uncovered } in relations.into_iter().flatten() {
            let (area, covered) = (residual.weight, 1.0 - uncovered);
            let cloth = if residual.value > 0.0 { inside_scale } else { center_scale };
            residual.weight = area * (uncovered * match_scale + if self.inside { covered * cloth } else { 0.0 });
            if residual.weight > 0.0 {
                out.push(residual);
            }
        }
        out
    }
}

impl<'a> Sampled<'a> {
    /// # Errors
    /// [`FittingError::Scan`] where no triangle of the scan has an area.
    pub fn new(
        source: &Source,
        target: &Target,
        resolution: &Resolution,
        settings: &'a UnderSettings,
    ) -> Result<Self, FittingError> {
        let mesh = &source.dressed.mesh;
        let picked = Thinned::new(mesh, &source.normals, resolution.mesh_cell, |_| true);
        let of = |v: &u32| mesh.colors.get(*v as usize).map(|c| c.map(f32::from));
        let samples = Samples::of_mesh(target.scan, &target.normals, &target.trust, resolution.scan_cell);
        let empty = || FittingError::Scan("its triangles have no area: scan the take again".into());
        Ok(Self {
            gate: resolution.gate,
            body: Articulated::of_skinned(source.dressed, &picked),
            trust: picked.vertices.iter().map(|&v| source.trust[v as usize]).collect(),
            colors: picked.vertices.iter().filter_map(of).collect(),
            patches: Patches::new(source.dressed, &picked),
            scan: Cloud::new(samples).ok_or_else(empty)?,
            settings,
        })
    }

    /// The problem over `joints`.
    pub fn problem(&'a self, prior: &'a JointPrior, joints: Vec<Joint>, inside: bool) -> UnderProblem<'a> {
        UnderProblem { sampled: self, prior, columns: Columns::new(joints, 0), inside }
    }

    /// How each thinned vertex relates to the scan; `None` where no scan lies near it.
    pub fn relations(&self, posed: &Posed) -> Vec<Option<Relation>> {
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
                r.uncovered *= (SURROUNDINGS * open / f64::max(area, 1e-12)).min(1.0).powi(2);
            }
        }
    }

    fn relation(&self, posed: &Posed, v: usize) -> Option<Relation> {
        let p = &posed.points[v];
        let samples = &self.scan.samples;
        let q = self.scan.nearest(p, &posed.normals[v], self.gate.distance, self.gate.min_cos)? as usize;
        let seen = f64::from(samples.weights[q] / samples.areas[q].max(f32::MIN_POSITIVE));
        let weight = f64::from(self.body.areas[v]) * seen;
        let residual = self.gate.pair(v as u32, p, &samples.points[q], &samples.normals[q], weight)?;
        let kernel = f64::from(self.gate.kernel).max(self.settings.cloth);
        let squared = kernel * kernel;
        let near = (squared / (squared + f64::from(residual.value).powi(2))).powi(2);
        let uncovered = near * f64::from(self.trust[v]) * self.color_agreement(v, q);
        Some(Relation { residual, uncovered })
    }

    /// 1 for the same colour, a quarter at the setting `color`.
    fn color_agreement(&self, v: usize, q: usize) -> f64 {
        let (Some(a), Some(b)) = (self.colors.get(v), self.scan.samples.colors.get(q)) else { return 1.0 };
        let squared = (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f32>() / 3.0;
        let half = f64::from(self.settings.color.max(1.0)).powi(2);
        ANY_COLOR + (1.0 - ANY_COLOR) * (half / (half + f64::from(squared))).powi(2)
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

    /// How surely each vertex of the whole mesh is uncovered, 0–1.
    pub fn uncovered_vertices(&self, source: &Source, state: &State) -> Vec<f32> {
        let positions = source.dressed.posed(&state.pose);
        let normals = vertex_normals(&positions, &source.dressed.mesh.triangles);
        let squared = self.settings.cloth.powi(2);
        let uncovered = |v: usize| {
            let p: &Point3<f32> = &positions[v];
            let near = self.scan.nearest(p, &normals[v], self.gate.distance, self.gate.min_cos);
            near.map_or(0.0, |q| {
                let q = q as usize;
                let value = f64::from((p - self.scan.samples.points[q]).dot(&self.scan.samples.normals[q]));
                ((squared / (squared + value * value)).powi(2)) as f32 * source.trust[v]
            })
        };
        (0..positions.len()).into_par_iter().with_min_len(128).map(uncovered).collect()
    }
}
