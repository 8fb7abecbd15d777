//! Any skinned mesh posed inside a more dressed scan (Hu et al. 2017, §6.1, eq. 5 and 6; articulated ICP after
//! Tagliasacchi et al. 2015).
//!
//! Vertices that stay uncovered match the scan; vertices that new cloth covers only have to stay inside it. Which is
//! which is decided anew in every step: by the distance outward, by colour, and by the trust the caller gives.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use serde::Serialize;
use toile_character::{Joint, Pose, SkinnedMesh};
use toile_geometry::Mesh;

use crate::{
    FittingError, UnderSettings, Verdict,
    articulated::{Articulated, Columns, Posed, State},
    body_fit::trust_of,
    cloud::{Cloud, Samples},
    correspond::INDEPENDENT,
    equations::{NormalEquations, Residual},
    level::{body_joints, clamped},
    prior::JointPrior,
    thin::Thinned,
};

/// Pose of a mesh under a scan.
#[derive(Debug, Clone)]
pub struct UnderFit {
    /// The pose in the scan's frame.
    pub pose: Pose,
    /// For each vertex of the mesh: how surely it is uncovered skin or cloth of before, 0–1.
    pub uncovered: Vec<f32>,
    /// What was decided and how good it is.
    pub report: UnderReport,
}

/// What a fit under a scan decided.
#[derive(Debug, Clone, Serialize)]
pub struct UnderReport {
    /// Whether to trust it.
    pub verdict: Verdict,
    /// Why not, in words.
    pub reasons: Vec<String>,
    /// Gauss–Newton steps over all starts.
    pub iterations: usize,
    /// Whether the finest level came to rest.
    pub converged: bool,
    /// Turn of the whole mesh against the initial pose about the vertical, degrees.
    pub heading_deg: f64,
    /// Part of the mesh's area that stayed uncovered, 0–1.
    pub uncovered: f64,
    /// Root mean square distance of uncovered vertices from the scan, millimetres.
    pub uncovered_rms_mm: f64,
    /// Part of the mesh's area that lies more than 2 mm outside the scan, 0–1.
    pub outside: f64,
}

/// Poses `dressed` (the body, or the scan of the take before, rigged) inside `scan`, which shows one layer more.
///
/// `trust`: how surely each vertex of `dressed` is seen unchanged in the scan, 0–1; empty where nothing is known.
/// `initial`: its pose in the take before; joints may turn a few degrees from it, the whole may stand anywhere near the
/// scan's middle at any heading. The scan is in metres, +Y up. Same result for any number of threads.
///
/// # Errors
/// [`FittingError`] where a mesh is empty or broken, or lengths differ. A poor fit is a verdict in the report.
pub fn pose_under(
    dressed: &SkinnedMesh,
    trust: &[f32],
    initial: &Pose,
    scan: &Mesh,
    settings: &UnderSettings,
    progress: &(dyn Fn(f32) + Sync),
) -> Result<UnderFit, FittingError> {
    check(dressed, trust, scan, settings)?;
    progress(0.0);
    let source = Source::new(dressed, trust);
    let target = Target::new(scan);
    let coarse = Stage::new(&source, &target, &COARSE, settings)?;
    let starts = headings(&coarse, dressed, initial, settings);
    progress(0.2);
    let middle = Stage::new(&source, &target, &MIDDLE, settings)?;
    let (mut state, mut iterations) = best_heading(&middle, starts, settings)?;
    progress(0.6);
    let fine = Stage::new(&source, &target, &FINE, settings)?;
    let prior = JointPrior::around(state.initial.clone(), settings.joint_sigma);
    let end = fine.run(state.now.clone(), &prior, body_joints(), settings.fine_iterations, true)?;
    iterations += end.iterations;
    state.now = end.state;
    progress(0.95);
    let fit = fine.finish(dressed, &source, state.now, initial, End { iterations, converged: end.converged });
    progress(1.0);
    Ok(fit)
}

fn check(dressed: &SkinnedMesh, trust: &[f32], scan: &Mesh, settings: &UnderSettings) -> Result<(), FittingError> {
    dressed.mesh.validate().map_err(|e| FittingError::Mesh(e.to_string()))?;
    scan.validate().map_err(|e| FittingError::Scan(e.to_string()))?;
    let count = dressed.mesh.positions.len();
    if !trust.is_empty() && trust.len() != count {
        return Err(FittingError::Mesh(format!("{count} vertices but trust for {}", trust.len())));
    }
    if dressed.mesh.is_empty() {
        return Err(FittingError::Mesh("it has no triangles".into()));
    }
    if scan.is_empty() {
        return Err(FittingError::Scan("it has no triangles; scan the take again".into()));
    }
    let positive = [settings.joint_sigma, settings.cloth, settings.stand_off, settings.inside_sigma];
    if !positive.iter().all(|s| *s > 0.0) {
        let reason = "joint_sigma, cloth, stand_off and inside_sigma must be above 0".into();
        return Err(FittingError::Setting { name: "joint_sigma", reason });
    }
    Ok(())
}

/// How many independent measurements all cloth together stands for: its stand-off is alike over whole limbs.
const INDEPENDENT_CLOTH: f64 = 50.0;
/// Side of the patches that are covered or uncovered together, metres: about a limb's width.
const PATCH: f32 = 0.12;

/// Sampling and kernels of one resolution, metres.
struct Scale {
    scan_cell: f32,
    mesh_cell: f32,
    distance: f32,
    slip: f32,
    min_cos: f32,
    kernel: f32,
    noise: f32,
}

const COARSE: Scale =
    Scale { scan_cell: 0.03, mesh_cell: 0.045, distance: 0.2, slip: 0.1, min_cos: 0.2, kernel: 0.05, noise: 0.02 };
const MIDDLE: Scale =
    Scale { scan_cell: 0.014, mesh_cell: 0.026, distance: 0.1, slip: 0.04, min_cos: 0.4, kernel: 0.02, noise: 0.006 };
const FINE: Scale =
    Scale { scan_cell: 0.007, mesh_cell: 0.013, distance: 0.05, slip: 0.015, min_cos: 0.5, kernel: 0.0, noise: 0.002 };

/// The mesh to be posed, ready to be thinned.
struct Source<'a> {
    dressed: &'a SkinnedMesh,
    normals: Vec<Vector3<f32>>,
    trust: Vec<f32>,
}

impl<'a> Source<'a> {
    fn new(dressed: &'a SkinnedMesh, trust: &[f32]) -> Self {
        let seen = trust_of(&dressed.mesh);
        let trust = if trust.is_empty() { seen } else { seen.iter().zip(trust).map(|(a, b)| a * b).collect() };
        Self { dressed, normals: dressed.mesh.vertex_normals(), trust }
    }
}

struct Target<'a> {
    scan: &'a Mesh,
    normals: Vec<Vector3<f32>>,
    trust: Vec<f32>,
}

impl<'a> Target<'a> {
    fn new(scan: &'a Mesh) -> Self {
        Self { scan, normals: scan.vertex_normals(), trust: trust_of(scan) }
    }
}

/// One resolution: thinned mesh and scan.
struct Stage<'a> {
    scale: &'a Scale,
    body: Articulated,
    /// Trust and colour of each thinned vertex.
    trust: Vec<f32>,
    colors: Vec<[f32; 3]>,
    patches: Patches,
    scan: Cloud,
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

struct StageEnd {
    state: State,
    iterations: usize,
    converged: bool,
}

struct End {
    iterations: usize,
    converged: bool,
}

/// How a vertex relates to the scan.
#[derive(Clone, Copy)]
struct Relation {
    residual: Residual,
    /// 0 (covered) to 1 (uncovered).
    uncovered: f64,
}

impl<'a> Stage<'a> {
    fn new(
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
    fn run(
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
    fn misfit(&self, state: &State) -> f64 {
        let relations = self.relations(&self.body.pose(state));
        let (mut cost, mut total) = (0.0, 0.0);
        for (relation, &area) in relations.iter().zip(&self.body.areas) {
            total += f64::from(area);
            cost += f64::from(area) * (1.0 - relation.map_or(0.0, |r| r.uncovered));
        }
        cost / f64::max(total, 1e-12)
    }

    fn finish(&self, dressed: &SkinnedMesh, source: &Source, state: State, initial: &Pose, end: End) -> UnderFit {
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

struct Candidate {
    /// The pose to which joints are drawn, at this heading.
    initial: Pose,
    now: State,
}

/// The initial pose turned about the vertical through the scan's middle, the most promising headings first.
fn headings(stage: &Stage, dressed: &SkinnedMesh, initial: &Pose, settings: &UnderSettings) -> Vec<Candidate> {
    let from =
        middle_of(&stage.body.pose(&State { pose: initial.clone(), beta: Vec::new() }).points, &stage.body.areas);
    let to = middle_of(&stage.scan.samples.points, &stage.scan.samples.areas);
    let count = settings.headings.max(1);
    let mut judged: Vec<(f64, Candidate)> = (0..count)
        .into_par_iter()
        .map(|k| {
            let angle = std::f64::consts::TAU * k as f64 / count as f64;
            let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle);
            let mut shift = to - turn * from;
            shift.y = 0.0;
            let moved = initial.moved(&Isometry3::from_parts(Translation3::from(shift), turn), &dressed.skeleton);
            let now = State { pose: moved.clone(), beta: Vec::new() };
            (stage.misfit(&now), Candidate { initial: moved, now })
        })
        .collect();
    judged.sort_by(|a, b| a.0.total_cmp(&b.0));
    judged.into_iter().take(4).map(|j| j.1).collect()
}

fn middle_of(points: &[Point3<f32>], areas: &[f32]) -> Vector3<f64> {
    let total: f64 = areas.iter().map(|&a| f64::from(a)).sum::<f64>().max(1e-12);
    points.iter().zip(areas).map(|(p, &a)| p.coords.cast::<f64>() * f64::from(a)).sum::<Vector3<f64>>() / total
}

/// Moves each candidate as a whole, then its limbs; keeps the one that agrees best with the scan.
fn best_heading(
    stage: &Stage,
    candidates: Vec<Candidate>,
    settings: &UnderSettings,
) -> Result<(Candidate, usize), FittingError> {
    let run = |mut c: Candidate| -> Result<(f64, usize, Candidate), FittingError> {
        let prior = JointPrior::around(c.initial.clone(), settings.joint_sigma);
        let rigid = stage.run(c.now, &prior, vec![Joint::Hips], 12, false)?;
        let bent = stage.run(rigid.state, &prior, body_joints(), 8, true)?;
        c.now = bent.state;
        Ok((stage.misfit(&c.now), rigid.iterations + bent.iterations, c))
    };
    let ends = candidates.into_par_iter().map(run).collect::<Result<Vec<_>, _>>()?;
    let iterations = ends.iter().map(|e| e.1).sum();
    let best = ends.into_iter().reduce(|a, b| if b.0 < a.0 { b } else { a });
    best.map(|b| (b.2, iterations)).ok_or(FittingError::Singular { what: "the heading" })
}

impl UnderReport {
    fn decide(&mut self) {
        if self.uncovered < 0.1 {
            self.verdict = Verdict::Doubtful;
            self.reasons.push(format!(
                "only {:.0} % of the mesh is seen again in the scan: hands, head or feet should stay uncovered",
                100.0 * self.uncovered
            ));
        }
        if self.outside > 0.1 {
            let failed = self.outside > 0.3;
            self.verdict = if failed { Verdict::Failed } else { Verdict::Doubtful };
            self.reasons.push(format!(
                "{:.0} % of the mesh lies outside the scan: is it the same person, wearing one layer more?",
                100.0 * self.outside
            ));
        }
    }
}
