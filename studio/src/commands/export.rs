//! `toile export`: the avatar's files, or a recording in a plain encoding.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use toile_capture::{
    Replay, export_standard,
    files::{atomic_write, read_bytes},
    printable_path,
};
use toile_character::JointNaming;
use toile_garments::CullSettings;
use toile_pipeline::{FEWEST_TRIANGLES, FileFormat, Goal, HiddenChoice, Options};

use crate::{
    StudioError,
    commands::{
        output::{Model, check_model, check_new, is_same_place},
        reach::{motion_choice, must_exist, reach},
        springs::SpringsChoice,
    },
    outcome::Answer,
    session::Session,
};

const AFTER: &str = "\
A subject's avatar.glb (pose of the first scan, with the motion as a clip) and avatar.vrm (T-pose) are written into its
folder; missing steps before it are run. A recording can be converted so that other viewers of MCAP show its depth.

With --cull-hidden both files lack what no one can see under closed cloth: body and lower layers end --cull-margin
inside of each hem, collar and cuff. Head, hands and feet stay, and what only loose or open cloth covers. The files are
smaller, and nothing can poke through where nothing is; export again without it for whole layers.

Where a skirt, dress or coat hangs loose around the legs, avatar.vrm has chains of spring bones (VRMC_springBone) on which it
swings in other programs; --springs off leaves them out.

--to writes further files beside them, all in metres with +Y up: avatar.obj with avatar.mtl and avatar-LAYER.ply (the layers in the
pose of the first scan), avatar.bvh (the motion), avatar.usda (everything). Those that a later --to does not name are removed.

--lod writes the avatar again with fewer triangles, a file a level: avatar-60k.glb, avatar-20k.glb, avatar-6k.glb, avatar-2k.glb, so that any
program reads them. Layers keep their skin weights and their places in the texture; what they lost of the relief is in a normal map. A layer
with fewer triangles is whole.

Motion, joint names, springs, formats, levels and hidden triangles that are left out are remembered in SUBJECT/edits/: later runs make the same avatar.

Examples:
  toile export anna --motion dance.bvh
  toile export anna --glb anna-today.glb
  toile export anna --cull-hidden --cull-margin 50
  toile export anna --to glb,vrm,obj,bvh,usda
  toile export anna --lod
  toile export anna --lod 30k,3k
  toile export anna --joint-names mixamo --glb for-unity.glb
  toile export anna/takes/00-body.mcap --mcap plain.mcap";

/// Write the avatar: GLB with a motion, VRM; or a take in a plain encoding
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER)]
pub struct Export {
    /// The subject; with --mcap a recording
    path: PathBuf,
    /// Motion for the avatar (BVH, or GLB or VRMA with an animation), or `walk` for the one that ships with Toile (without: as the avatar was made last)
    #[arg(long, value_name = "FILE")]
    motion: Option<PathBuf>,
    /// The names of the joints in avatar.glb: as VRM names its bones, by H-Anim, or as Mixamo does, which other
    /// programs map by themselves (without: as the avatar was made last; vrm the first time)
    #[arg(long, value_enum)]
    joint_names: Option<Names>,
    /// The formats of the avatar's files, with commas between; GLB and VRM are always written (without: as the avatar was made
    /// last; glb,vrm the first time)
    #[arg(long, value_enum, value_delimiter = ',', value_name = "FORMAT")]
    to: Option<Vec<Format>>,
    /// Levels of detail as files of their own, triangles a layer with commas between, or `off`; alone 60k,20k,6k,2k
    /// (without: as the avatar was made last; off the first time)
    #[arg(long, value_name = "TRIANGLES", value_delimiter = ',', num_args = 0..=1, default_missing_value = "60k,20k,6k,2k")]
    lod: Option<Vec<Triangles>>,
    /// Put a copy of the GLB here
    #[arg(long, value_name = "FILE")]
    glb: Option<PathBuf>,
    /// Put a copy of the VRM here
    #[arg(long, value_name = "FILE")]
    vrm: Option<PathBuf>,
    /// Leave out triangles of body and lower layers that clothes hide
    #[arg(long)]
    cull_hidden: bool,
    /// Keep this much inside of hems and openings, along the surface [default: 30]
    #[arg(long, value_name = "MM", requires = "cull_hidden")]
    cull_margin: Option<f32>,
    /// Whether skirts, dresses and coats swing by spring bones in avatar.vrm (without: as the avatar was made last; on the first time)
    #[arg(long, value_enum)]
    springs: Option<SpringsChoice>,
    /// Settings of the stages; they win over those of SUBJECT/toile.toml
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// Convert a recording: depth as plain 16-bit images (16UC1), which other viewers display
    #[arg(long, value_name = "FILE", conflicts_with_all = ["motion", "joint_names", "glb", "vrm", "cull_hidden", "springs", "to", "lod"])]
    mcap: Option<PathBuf>,
}

/// A system of joint names on the command line.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Names {
    Vrm,
    Hanim,
    Mixamo,
}

impl From<Names> for JointNaming {
    fn from(names: Names) -> Self {
        match names {
            Names::Vrm => Self::Vrm,
            Names::Hanim => Self::HAnim,
            Names::Mixamo => Self::Mixamo,
        }
    }
}

/// How many triangles a level of detail has on the command line: `20k`, `1500`, or `off`.
#[derive(Debug, Clone, Copy)]
struct Triangles(Option<usize>);

impl std::str::FromStr for Triangles {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "off" {
            return Ok(Self(None));
        }
        let (digits, unit) = text.strip_suffix('k').map_or((text, 1), |digits| (digits, 1000));
        let count = digits.parse::<usize>().ok().and_then(|n| n.checked_mul(unit)).filter(|n| *n >= FEWEST_TRIANGLES);
        let wrong =
            || format!("a level has {FEWEST_TRIANGLES} triangles or more, such as 20k or 1500; `off` for no levels");
        count.map(|n| Self(Some(n))).ok_or_else(wrong)
    }
}

/// A format on the command line.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Format {
    /// Everything: layers, skeleton, motion
    Glb,
    /// The same in T-pose, with spring bones
    Vrm,
    /// avatar.obj and avatar.mtl: the layers in the pose of the first scan
    Obj,
    /// avatar-LAYER.ply: each layer alone, with its skin weights
    Ply,
    /// avatar.bvh: the motion on the avatar's skeleton
    Bvh,
    /// avatar.usda: layers, skeleton and motion as USD text
    Usda,
}

impl From<Format> for FileFormat {
    fn from(format: Format) -> Self {
        match format {
            Format::Glb => Self::Glb,
            Format::Vrm => Self::Vrm,
            Format::Obj => Self::Obj,
            Format::Ply => Self::Ply,
            Format::Bvh => Self::Bvh,
            Format::Usda => Self::Usda,
        }
    }
}

impl Export {
    /// Runs the command.
    ///
    /// # Errors
    /// [`StudioError`] where a stage has no answer or files cannot be read or written.
    pub fn run(&self, session: &Session) -> Result<Answer, StudioError> {
        must_exist(&self.path)?;
        if let Some(plain) = &self.mcap {
            check_new(plain)?;
            return convert(&self.path, plain);
        }
        let copies = [(&self.glb, Model::Glb), (&self.vrm, Model::Vrm)];
        if let (Some(glb), Some(vrm)) = (&self.glb, &self.vrm)
            && is_same_place(glb, vrm)
        {
            return Err(StudioError::Usage(format!("--glb and --vrm are the same file: {}", printable_path(glb))));
        }
        for (copy, model) in copies {
            copy.iter().try_for_each(|copy| check_model(copy, model, &self.path))?;
        }
        let options = Options {
            motion: motion_choice(self.motion.as_deref()),
            joint_names: self.joint_names.map(Into::into),
            hidden: self.hidden()?,
            springs: self.springs.map(Into::into),
            levels: self.lod.as_ref().map(|lod| lod.iter().filter_map(|n| n.0).collect()),
            formats: self.to.as_ref().map(|to| to.iter().copied().map(Into::into).collect()),
            settings: self.settings.clone(),
            ..Options::default()
        };
        options.check()?;
        let mut answer = reach(&self.path, Goal::Avatar, &options, session)?;
        for (copy, model) in copies {
            let Some(copy) = copy else { continue };
            atomic_write(copy, &read_bytes(&self.path.join(model.file_name()))?)?;
            answer.text.push_str(&format!("{}\n", printable_path(copy)));
        }
        answer.text.push_str(&left_out(&answer.results));
        Ok(answer)
    }

    fn hidden(&self) -> Result<HiddenChoice, StudioError> {
        let defaults = CullSettings::default();
        let margin = self.cull_margin.map_or(defaults.margin, |mm| mm * 1e-3);
        if !(0.0..=1.0).contains(&margin) {
            return Err(StudioError::Usage(format!("--cull-margin {} is not between 0 and 1000 mm", margin * 1e3)));
        }
        let left_out = HiddenChoice::LeftOut(CullSettings { margin, ..defaults });
        Ok(if self.cull_hidden { left_out } else { HiddenChoice::Whole })
    }
}

/// A line for each layer that something was left out of.
fn left_out(results: &Value) -> String {
    let layers = results["stages"]["avatar/export"]["left_out"].as_object();
    let line = |(layer, reported): (&String, &Value)| {
        format!("{layer}: {} of {} triangles left out\n", reported["triangles"], reported["of"])
    };
    layers.into_iter().flatten().filter(|(_, reported)| reported["triangles"] != 0).map(line).collect()
}

fn convert(recording: &Path, plain: &Path) -> Result<Answer, StudioError> {
    let shown = printable_path(recording);
    let mut lost: Vec<String> = Replay::open(recording)?.lost().map(|l| format!("{shown}: {l}")).into_iter().collect();
    let written = export_standard(recording, plain)?;
    if let Some(first) = written.unreadable.first() {
        let count = written.unreadable.len();
        lost.push(format!("{shown}: {count} frames cannot be read and are left out; the first: {first}"));
    }
    let text = format!("{}: {} frames\n", printable_path(plain), written.frames);
    let results = json!({ "file": printable_path(plain), "frames": written.frames, "bytes": written.bytes });
    Ok(Answer { text, results, lost, ..Answer::default() })
}
