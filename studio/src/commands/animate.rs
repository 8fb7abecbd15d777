//! `toile animate`: the layers in motion, as point caches.

use std::path::PathBuf;

use serde_json::json;
use toile_capture::printable_path;
use toile_character::Skinning;
use toile_pipeline::{AnimateOptions, Animated, Blend, Profile, Remarks, animate};

use crate::{
    StudioError,
    commands::reach::{motion_choice, must_exist},
    outcome::Answer,
    session::Session,
};

const AFTER: &str = "\
Writes SUBJECT/motion/NAME/: a point cache (PC2, metres, +Y up, vertices in the order of avatar.glb) for the body and each
garment, motion.glb (the same motion for any player of glTF, by helper joints), film.gif and stills.png to look at, and
report.json. Blender shows the caches with the
modifier Mesh Cache on the meshes of avatar.glb.

Cloth that lies on the body follows it, cloth that hangs swings, and layers that come through each other are moved apart;
report.json counts what still crosses in each frame. What the avatar lacks is built first.

Examples:
  toile animate anna
  toile animate anna --motion dance.bvh --fps 60
  toile animate anna --blend skinning
  toile animate anna --profile realtime";

/// Move the layers through a motion: skinning and cloth, as point caches
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER)]
pub struct Animate {
    /// The subject
    subject: PathBuf,
    /// Motion (BVH, or GLB or VRMA with an animation), or `walk` for the one that ships with Toile (without: the avatar's)
    #[arg(long, value_name = "FILE")]
    motion: Option<PathBuf>,
    /// Frames a second, at most those of the motion
    #[arg(long, default_value_t = 30.0, value_parser = rate)]
    fps: f64,
    /// As well as can be, or as fast as a screen needs
    #[arg(long, value_enum, default_value_t = Time::Bake)]
    profile: Time,
    /// What moves the garments in the profile bake (without: anchored)
    #[arg(long, value_enum)]
    blend: Option<Way>,
    /// Move the garments by all blends, and show them side by side: variants.gif, variants.png, and their times in report.json
    #[arg(long)]
    compare: bool,
    /// How skin weights are blended
    #[arg(long, value_enum, default_value_t = Weights::Linear)]
    skinning: Weights,
    /// Fabrics in SI units, and which garment is made of which (TOML; docs/fabrics.md); without: what its type is usually made of
    #[arg(long, value_name = "FILE")]
    fabrics: Option<PathBuf>,
    /// Settings of the stages; they win over those of SUBJECT/toile.toml
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Time {
    /// Cloth as it moves, layers moved apart at full resolution
    Bake,
    /// Three classes of cloth, layers kept in their order: faster, and not without crossings
    Realtime,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Way {
    /// By skin weights alone
    Skinning,
    /// Cloth held by nothing but contact, friction and waistbands
    Physics,
    /// Both mixed by one weight a garment, two for a skirt, as Hu et al. 2017 do (eq. 8 and 9)
    Seed,
    /// Cloth that is tied to the body the more closely it lies on it, and layers kept apart
    Anchored,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Weights {
    Linear,
    Log,
    Hybrid,
}

fn rate(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(fps) if (1.0..=480.0).contains(&fps) => Ok(fps),
        _ => Err("frames a second must be a number from 1 to 480".into()),
    }
}

impl Animate {
    /// Runs the command.
    ///
    /// # Errors
    /// [`StudioError`] where a stage has no answer or files cannot be read or written.
    pub fn run(&self, session: &Session) -> Result<Answer, StudioError> {
        must_exist(&self.subject)?;
        if matches!(self.profile, Time::Realtime) && (self.blend.is_some() || self.compare) {
            let reason = "--profile realtime moves the garments in a way of its own: leave --blend and --compare away";
            return Err(StudioError::Usage(reason.into()));
        }
        let options = AnimateOptions {
            motion: motion_choice(self.motion.as_deref()),
            fps: self.fps,
            profile: match self.profile {
                Time::Bake => Profile::Bake,
                Time::Realtime => Profile::Realtime,
            },
            blend: match self.blend {
                Some(Way::Skinning) => Blend::Skinning,
                Some(Way::Physics) => Blend::Physics,
                Some(Way::Seed) => Blend::Seed,
                None | Some(Way::Anchored) => Blend::Anchored,
            },
            skinning: match self.skinning {
                Weights::Linear => Skinning::Linear,
                Weights::Log => Skinning::Log,
                Weights::Hybrid => Skinning::Hybrid,
            },
            compare: self.compare,
            fabrics: self.fabrics.clone(),
            settings: self.settings.clone(),
            ..AnimateOptions::default()
        };
        let Animated { folder, report, remarks } = animate(&self.subject, &options, session.progress.as_ref())?;
        let text = format!(
            "{}\n{} frames, {:.0} ms a frame (95 %: {:.0} ms), {:.1} pairs of triangles cross on average\n",
            printable_path(&folder),
            report.frames.len(),
            report.ms_a_frame[0],
            report.ms_a_frame[1],
            report.crossing_mean,
        );
        let results = json!({ "folder": printable_path(&folder), "report": report });
        let Remarks { warnings, lost, failures } = remarks;
        Ok(Answer { text, results, warnings, lost, failures })
    }
}
