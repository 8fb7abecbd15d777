//! Step `report`: the page for the operator.
//!
//! Reads everything that was built; writes `report.html` in the subject's folder.

use std::{collections::BTreeMap, path::PathBuf};

use serde_json::{Value, json};
use toile_character::{Motion, Pose, SkinWeights, dress_pose::t_pose, skinning};
use toile_fitting::{BodyMeasure, MeasureTable};
use toile_fusion::FusionReport;
use toile_garments::{LayerReport, PosedReport};
use toile_geometry::Mesh;

use crate::{
    PipelineError, Run,
    avatar_choice::AvatarChoice,
    body_file::{Body, BodyFile},
    garment::Garment,
    hash, json,
    look::sampled,
    meshes::{read_mesh, read_skinned},
    motion,
    report::{self, Contents, Figures},
    step::{Product, Step},
    summary::{Summary, TakeSummary},
};

/// Times of the motion that are shown.
const FRAMES: usize = 3;

/// Writing the page.
pub struct Page<'a> {
    /// The run.
    pub run: &'a Run<'a>,
    /// The body.
    pub body: &'a Body,
    /// The garments, inside to outside.
    pub garments: &'a [Garment],
    /// The choices that the avatar was made with.
    pub choice: &'a AvatarChoice,
    /// The decisions and remarks of the other steps.
    pub summary: &'a Summary,
}

impl Step for Page<'_> {
    type Report = ();
    const NAME: &'static str = "report";
    const VERSION: u32 = 8;
    const SECONDS: f64 = 4.0;
    const OUTPUTS_VARY: bool = true;

    fn label(&self) -> String {
        self.run.label("report", "draw")
    }

    fn folder(&self) -> PathBuf {
        self.run.folders.build().join("report")
    }

    fn inputs(&self) -> Result<Vec<PathBuf>, PipelineError> {
        let folders = &self.run.folders;
        let of_body = [self.choice.body_mesh(folders), folders.body_json(), folders.measurements(), folders.glb()];
        let scans = self.run.layers.iter().map(|l| folders.scan(l));
        let garments = self.garments.iter().map(|g| folders.garment(&g.layer));
        Ok(of_body.into_iter().chain(scans).chain(garments).collect())
    }

    fn settings(&self) -> Result<Value, PipelineError> {
        let remarks = &self.summary.remarks;
        let decided = Value::Object(self.summary.decided.by_step()?).to_string();
        Ok(json!({
            "name": self.run.title(),
            "layers": self.run.layers,
            "warnings": remarks.warnings,
            "lost": remarks.lost,
            "failures": remarks.failures,
            "decided": hash::bytes(decided.as_bytes()),
        }))
    }

    fn outputs(&self) -> Vec<PathBuf> {
        vec![self.run.folders.report()]
    }

    fn work(&self, progress: &(dyn Fn(f32) + Sync)) -> Result<Product<()>, PipelineError> {
        let path = self.run.folders.report();
        let html = report::write(&self.contents()?, &path, progress)?;
        Ok(Product::new(vec![(path, html.into_bytes())], (), Vec::new()))
    }
}

impl Page<'_> {
    fn contents(&self) -> Result<Contents, PipelineError> {
        let (run, folders, decided) = (self.run, &self.run.folders, &self.summary.decided);
        let read_scan = |layer: &String| Ok((layer.clone(), read_mesh(&folders.scan(layer))?));
        let read_garment = |garment: &Garment| read_skinned(&folders.garment(&garment.layer));
        let worn: Vec<(Mesh, SkinWeights)> = self.garments.iter().map(read_garment).collect::<Result<_, _>>()?;
        let body = read_mesh(&self.choice.body_mesh(folders))?;
        let table: MeasureTable = json::read(&folders.measurements())?;
        let found: BodyFile = json::read(&folders.body_json())?;
        let floor = body.bounds().map_or(0.0, |(low, _)| f64::from(low.y));
        let layers: Vec<String> = self.garments.iter().map(|g| g.name.clone()).collect();
        let stacked = decided.stack.as_ref().map_or(&[][..], |s| &s.layers);
        Ok(Contents {
            name: run.title().to_string(),
            subtitle: run.subtitle(),
            takes: of_takes(&decided.takes),
            stacked: self.of_garments(),
            measurements: measurement_rows(&table),
            tapes: table.measures.into_iter().map(|m| m.path).collect(),
            sections: found.girths.into_iter().map(|(name, girth)| (name, floor + girth.height_m)).collect(),
            landmarks: found.landmarks,
            standing: read_mesh(&folders.standing())?,
            remarks: self.summary.remarks.clone(),
            scans: run.layers.iter().map(read_scan).collect::<Result<_, PipelineError>>()?,
            motion: self.motion_frames(&body, &worn)?,
            gaps: layers.iter().cloned().zip(stacked.iter().map(gap_shares)).collect(),
            garments: layers.into_iter().zip(worn.into_iter().map(|(mesh, _)| mesh)).collect(),
            body,
            seconds: self.seconds(),
        })
    }

    /// The moves of stacking, and the layers in the motion and in the T-pose.
    fn of_garments(&self) -> Figures {
        let mut figures = Figures { layers: self.garments.iter().map(|g| g.name.clone()).collect(), rows: Vec::new() };
        let decided = &self.summary.decided;
        if let Some(stack) = &decided.stack {
            for (what, of) in REST {
                figures.row(what, stack.layers.iter().map(of).collect());
            }
            let share = |share: &Option<f32>| share.map_or("–".into(), |x| format!("{:.0}", 100.0 * x));
            figures.row("hangs free, %", stack.free_share.iter().map(share).collect());
        }
        if let Some(avatar) = &decided.avatar {
            let look = &avatar.look;
            // A layer that is hidden as a whole is not in the avatar.
            let find = |reports: &[PosedReport], layer: &String, of: fn(&PosedReport) -> String| {
                let at = look.layers.iter().position(|l| l == layer);
                at.and_then(|k| reports.get(k)).map_or("–".into(), of)
            };
            for (what, of) in MOVING {
                figures.row(what, figures.layers.iter().map(|l| find(&look.in_motion, l, of)).collect());
            }
            for (what, of) in T_POSE {
                figures.row(what, figures.layers.iter().map(|l| find(&look.in_t_pose, l, of)).collect());
            }
        }
        figures
    }

    /// All layers at a few times of the motion, and in the T-pose.
    fn motion_frames(
        &self,
        body_mesh: &Mesh,
        worn: &[(Mesh, SkinWeights)],
    ) -> Result<Vec<(String, Vec<Mesh>)>, PipelineError> {
        let (skeleton, pose0) = (&self.body.skinned.skeleton, &self.body.pose0);
        let path = self.choice.motion_path(&self.run.folders);
        let mut layers = vec![(body_mesh, &self.body.skinned.weights)];
        layers.extend(worn.iter().map(|(mesh, weights)| (mesh, weights)));
        let meshes: Vec<&Mesh> = layers.iter().map(|l| l.0).collect();
        let settings = &self.run.settings.motion;
        let motion: Motion =
            motion::load_clothed(path.as_deref(), &self.body.skinned, pose0, &meshes, settings)?.motion;
        let rest_from_pose0 = pose0.skinning_transforms(skeleton);
        let rest: Vec<_> =
            layers.iter().map(|(mesh, w)| skinning::unskin(&mesh.positions, w, &rest_from_pose0)).collect();
        let posed = |pose: &Pose| {
            let transforms = pose.skinning_transforms(skeleton);
            let layer = |((mesh, weights), rest): (&(&Mesh, &SkinWeights), &Vec<_>)| {
                let positions = skinning::skin(rest, weights, &transforms);
                let mut posed = Mesh { positions, normals: Vec::new(), ..Mesh::clone(mesh) };
                posed.recompute_normals();
                posed
            };
            layers.iter().zip(&rest).map(layer).collect::<Vec<Mesh>>()
        };
        let caption = |k: usize| format!("{} at {:.1} s", motion.name, k as f64 * motion.frame_time);
        let times = sampled(motion.poses.len(), FRAMES).into_iter();
        let mut frames: Vec<_> = times.map(|k| (caption(k), posed(&motion.poses[k]))).collect();
        frames.push(("T-pose of avatar.vrm".into(), posed(&t_pose(skeleton))));
        Ok(frames)
    }

    /// Seconds by folder and stage, as the timings files say.
    fn seconds(&self) -> BTreeMap<String, f64> {
        let folders = &self.run.folders;
        let places = self.run.layers.iter().map(|l| (l.clone(), folders.layer(l)));
        let others = [("body", folders.body()), ("layers", folders.layers()), ("avatar", folders.avatar())];
        let mut all = BTreeMap::new();
        for (name, folder) in places.chain(others.map(|(n, f)| (n.to_string(), f))) {
            let timings: BTreeMap<String, Value> = json::read(&folder.join("timings.json")).unwrap_or_default();
            let seconds = |(step, t): (&String, &Value)| Some((format!("{name}: {step}"), t["seconds"].as_f64()?));
            all.extend(timings.iter().filter_map(seconds));
        }
        all
    }
}

/// A row of a table: what it shows, and its value for a layer.
type Row<R> = (&'static str, fn(&R) -> String);

/// A garment after stacking; "seen" is where the scan saw it.
const REST: [Row<LayerReport>; 6] = [
    ("moved where seen, mean mm", |l| format!("{:.2}", 1e3 * l.moved_seen_mean_m)),
    ("moved where seen, p95 mm", |l| format!("{:.2}", 1e3 * l.moved_seen_p95_m)),
    ("gap aimed at, mm", |l| format!("{:.1}", 1e3 * l.gap_m)),
    ("smallest gap, mm", |l| format!("{:.1}", 1e3 * l.least_gap_m)),
    ("crossing pairs", |l| l.crossing_pairs.to_string()),
    ("self-crossings added", |l| l.self_crossings[1].saturating_sub(l.self_crossings[0]).to_string()),
];

/// A garment in the motion.
const MOVING: [Row<PosedReport>; 4] = [
    ("poked through in the motion, pairs", |p| format!("{:.0}", p.crossing_pairs_mean)),
    ("the same in the worst pose", |p| p.crossing_pairs_most.to_string()),
    ("limbs that meet in the motion, pairs", |p| format!("{:.0}", p.touching_pairs_mean)),
    ("largest stretch in the motion", |p| format!("{:.1}", p.stretch_most)),
];

/// A garment in the T-pose.
const T_POSE: [Row<PosedReport>; 2] = [
    ("poked through in the T-pose, pairs", |p| p.crossing_pairs_most.to_string()),
    ("largest stretch in the T-pose", |p| format!("{:.1}", p.stretch_most)),
];

/// The decisions of the steps of each take, in figures.
fn of_takes(takes: &[TakeSummary]) -> Figures {
    let mut figures = Figures { layers: takes.iter().map(|t| t.layer.clone()).collect(), rows: Vec::new() };
    for (what, of) in TAKES {
        figures.row(what, takes.iter().map(of).collect());
    }
    figures
}

const TAKES: [Row<TakeSummary>; 11] = [
    ("finished scan", |t| t.read.as_ref().map_or("–".into(), |read| read.file.clone())),
    ("frames fused", |t| fused(t, |fuse| fuse.frames_fused.to_string())),
    ("left out", |t| fused(t, |fuse| fuse.dropped.len().to_string())),
    ("turned, °", |t| fused(t, |fuse| format!("{:.0}", fuse.turned_deg))),
    ("residual, mm", |t| fused(t, |fuse| format!("{:.2}", fuse.residual_mm))),
    ("seam, mm", |t| fused(t, |fuse| format!("{:.2}", fuse.seam_after_mm))),
    ("unseen, %", |t| {
        let read = t.read.as_ref().map(|read| read.cleaned.filled_percent);
        read.map_or_else(|| fused(t, |fuse| format!("{:.1}", fuse.filled_percent)), |percent| format!("{percent:.1}"))
    }),
    ("garment", |t| {
        let guessed = |cut: &toile_garments::ExtractionReport| if cut.type_guessed { " (guessed)" } else { "" };
        t.cut.as_ref().map_or("–".into(), |cut| format!("{}{}", cut.garment_type, guessed(cut)))
    }),
    ("area, m²", |t| t.cut.as_ref().map_or("–".into(), |cut| format!("{:.2}", cut.area_m2))),
    ("filled, %", |t| t.cut.as_ref().map_or("–".into(), |cut| format!("{:.1}", 100.0 * cut.filled_share))),
    ("unsure, %", |t| t.cut.as_ref().map_or("–".into(), |cut| format!("{:.1}", 100.0 * cut.unsure_share))),
];

/// A figure of fusion; a finished scan has none.
fn fused(take: &TakeSummary, of: fn(&FusionReport) -> String) -> String {
    take.fuse.as_ref().map_or("–".into(), of)
}

fn gap_shares(layer: &LayerReport) -> Vec<f64> {
    layer.gaps.iter().map(|share| f64::from(*share)).collect()
}

fn measurement_rows(table: &MeasureTable) -> Vec<(String, String)> {
    let row = |m: &BodyMeasure| (m.name.clone(), m.text());
    let mut rows: Vec<_> = table.measures.iter().map(row).collect();
    rows.push(("volume".into(), format!("{:.1} l", table.volume_l)));
    rows
}
