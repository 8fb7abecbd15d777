//! `toile sculpt`: bodies of implicit primitives: fitted to a subject, new ones, and changes by hand.

use std::{
    io::Read,
    path::{Path, PathBuf},
};

use serde_json::json;
use toile_capture::{
    files::{is_there, open_regular},
    printable_path,
};
use toile_implicit::{Edit, Scaling};
use toile_pipeline::{PoseChoice, Remarks, SculptFile, Sculpted, sculpt};

use crate::{
    StudioError,
    commands::{
        output::{check_new, is_same_place},
        reach::must_exist,
        shape::Sex,
    },
    outcome::Answer,
    session::Session,
};

const AFTER: &str = "\
Of a SUBJECT, writes SUBJECT/build/implicit/: body.toml (ellipsoids on the skeleton, some 25 kB, to be read and edited), body.ply
(their surface in the pose of the body's scan) and avatar-implicit.glb (the surface with skeleton, weights and the walk). The
body is fitted first where it is missing. Of a FILE.toml, checks it, changes it and shows its surface. Primitives are named by
number (--list) or name; WORDS are those of the file, millimetres and degrees. docs/implicit.md describes the file.

Examples:
  toile sculpt anna
  toile sculpt --new --sex woman --toml woman.toml
  toile sculpt woman.toml --pose walk.bvh --frame 7 --out stride.ply
  toile sculpt woman.toml --add 'joint = \"head\", center = [0, 150, 0], axes = [30, 30, 30]' --delete 12
  toile sculpt woman.toml --move 7 'by = [0, 5, 0], scale = [1.2, 1, 1]' --scale total-height=1.05 --toml tall.toml";

/// Fit implicit primitives to the body: a compact body that can be edited
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER)]
pub struct Sculpt {
    /// The subject, or a file of primitives
    #[arg(value_name = "SUBJECT|FILE", required_unless_present = "new", conflicts_with = "new")]
    what: Option<PathBuf>,
    /// Begin with the mean person
    #[arg(long)]
    new: bool,
    /// With --new: a woman or a man; between the two where nothing is said
    #[arg(long, value_enum, requires = "new")]
    sex: Option<Sex>,
    /// Add a primitive
    #[arg(long, value_name = "WORDS")]
    add: Vec<String>,
    /// Take a primitive away
    #[arg(long, value_name = "WHICH")]
    delete: Vec<String>,
    /// Move a primitive `by` a way, `turn` it about its centre, `scale` its half axes
    #[arg(long = "move", num_args = 2, value_names = ["WHICH", "WORDS"])]
    moves: Vec<String>,
    /// Other proportions: total-height, frontal, high-lateral, low-lateral or spine-origin, as a factor
    #[arg(long, value_name = "NAME=FACTOR", value_parser = factor)]
    scale: Vec<(String, f64)>,
    /// Where the primitives go: FILE itself, or body.toml with --new
    #[arg(long, value_name = "FILE")]
    toml: Option<PathBuf>,
    /// Print the primitives with their numbers
    #[arg(long)]
    list: bool,
    /// A motion (BVH, GLB, VRMA) for --out
    #[arg(long, value_name = "MOTION", requires = "out")]
    pose: Option<PathBuf>,
    /// The frame of --pose that a PLY shows, from 0
    #[arg(long, default_value_t = 0, requires = "pose")]
    frame: usize,
    /// Level of detail of --out, from 0 (finest) to 3
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u8).range(0..4), requires = "out")]
    level: u8,
    /// Surface: one frame as .ply, muscles included, or a .glb with skeleton, weights and the motion
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Settings of the stages; they win over those of SUBJECT/toile.toml
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
}

const FACTORS: [&str; 5] = ["total-height", "frontal", "high-lateral", "low-lateral", "spine-origin"];

fn factor(text: &str) -> Result<(String, f64), String> {
    let wrong = || format!("`{text}` is not NAME=FACTOR with a NAME of {}", FACTORS.join(", "));
    let (name, value) = text.split_once('=').ok_or_else(wrong)?;
    let value = value.parse().map_err(|_| wrong())?;
    if FACTORS.contains(&name) { Ok((name.to_string(), value)) } else { Err(wrong()) }
}

impl Sculpt {
    /// Runs the command.
    ///
    /// # Errors
    /// [`StudioError`] where a stage has no answer, a file is not what it should be, or cannot be read or written.
    pub fn run(&self, session: &Session) -> Result<Answer, StudioError> {
        if let Some(path) = &self.what {
            must_exist(path)?;
        }
        match &self.what {
            Some(subject) if subject.is_dir() => self.of_subject(subject, session),
            _ => self.of_file(),
        }
    }

    fn of_subject(&self, subject: &Path, session: &Session) -> Result<Answer, StudioError> {
        let is_edited = self.is_edited() || self.list || self.out.is_some() || self.toml.is_some();
        if is_edited {
            let file = printable_path(&subject.join("build/implicit/body.toml"));
            let reason = format!("only a file of primitives is changed or shown; give {file} instead of the subject");
            return Err(StudioError::Usage(reason));
        }
        let Sculpted { files, fitted, bytes, remarks } =
            sculpt(subject, self.settings.as_deref(), session.progress.as_ref())?;
        let paths = files.iter().map(|path| printable_path(path).clone());
        let text = format!(
            "{}\n{} primitives in {:.1} kB; their surface is {:.2} mm from the body on average, 95 % of it within {:.2} mm\n",
            paths.clone().collect::<Vec<_>>().join("\n"),
            fitted.primitives,
            bytes as f64 / 1e3,
            1e3 * fitted.mean,
            1e3 * fitted.p95,
        );
        let results = json!({
            "files": paths.collect::<Vec<_>>(),
            "primitives": fitted.primitives,
            "bytes": bytes,
            "mean_m": fitted.mean,
            "p95_m": fitted.p95,
        });
        let Remarks { warnings, lost, failures } = remarks;
        Ok(Answer { text, results, warnings, lost, failures })
    }

    fn is_edited(&self) -> bool {
        !(self.add.is_empty() && self.delete.is_empty() && self.moves.is_empty() && self.scale.is_empty())
    }

    fn of_file(&self) -> Result<Answer, StudioError> {
        let toml = self.toml.clone().or_else(|| self.what.clone()).unwrap_or_else(|| PathBuf::from("body.toml"));
        let is_own = self.what.as_ref().is_some_and(|file| is_same_place(file, &toml));
        if !is_own {
            check_new(&toml)?;
        }
        if let Some(out) = &self.out {
            check_surface(out)?;
        }
        let mut file = match &self.what {
            Some(path) => SculptFile::read(path)?,
            None => SculptFile::default_person(self.sex.map(|sex| sex == Sex::Woman))?,
        };
        file.edit(&self.edits())?;
        if !self.scale.is_empty() {
            file.scale(&self.scaling())?;
        }
        let mut files = Vec::new();
        if self.is_edited() || !is_own {
            file.write(&toml)?;
            files.push(toml);
        }
        if let Some(out) = &self.out {
            let (motion, level) = (self.pose.clone(), usize::from(self.level));
            file.write_surface(out, &PoseChoice { motion, frame: self.frame, level })?;
            files.push(out.clone());
        }
        let paths: Vec<String> = files.iter().map(|path| printable_path(path)).collect();
        let mut text: String = paths.iter().map(|path| format!("{path}\n")).collect();
        text += &if self.list { list(&file) } else { format!("{} primitives\n", file.body().primitives.len()) };
        let results = json!({ "files": paths, "primitives": file.body().primitives.len() });
        Ok(Answer { text, results, ..Answer::default() })
    }

    /// The changes in an order in which numbers keep their meaning: moves, deletions from the last one on, additions.
    fn edits(&self) -> Vec<Edit> {
        let moves = self.moves.chunks_exact(2).map(|pair| Edit::Move(pair[0].clone(), pair[1].clone()));
        let number = |which: &String| which.trim_start_matches('#').parse::<usize>().unwrap_or(usize::MAX);
        let mut deleted = self.delete.clone();
        deleted.sort_by_key(|which| std::cmp::Reverse(number(which)));
        deleted.dedup();
        let deletions = deleted.into_iter().map(Edit::Delete);
        moves.chain(deletions).chain(self.add.iter().cloned().map(Edit::Add)).collect()
    }

    fn scaling(&self) -> Scaling {
        let given = |name: &str| self.scale.iter().rev().find(|(n, _)| n == name).map_or(1.0, |(_, factor)| *factor);
        let [total_height, frontal, high_lateral, low_lateral, spine_origin] = FACTORS.map(given);
        Scaling { total_height, frontal, high_lateral, low_lateral, spine_origin }
    }
}

/// The primitives, a line each: number, name or joint, half axes.
fn list(file: &SculptFile) -> String {
    let line = |(k, p): (usize, &toile_implicit::Primitive)| {
        let [a, b, c] = [p.state.axes.x, p.state.axes.y, p.state.axes.z].map(|axis| 1e3 * axis);
        format!("{:4}  {:16} {a:6.1} {b:6.1} {c:6.1} mm  {}\n", k + 1, p.joint.name(), p.name)
    };
    file.body().primitives.iter().enumerate().map(line).collect()
}

/// A surface replaces only a file of its own kind.
fn check_surface(path: &Path) -> Result<(), StudioError> {
    let kinds: [(&str, &[u8]); 2] = [("ply", b"ply"), ("glb", b"glTF")];
    let kind = kinds.into_iter().find(|(name, _)| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(name)));
    let Some((name, magic)) = kind else {
        return Err(StudioError::Usage(format!("{} must end in .ply or .glb", printable_path(path))));
    };
    if !is_there(path) {
        return check_new(path);
    }
    let mut head = vec![0; magic.len()];
    let is_one = open_regular(path).is_ok_and(|mut file| file.read_exact(&mut head).is_ok() && head == magic);
    if is_one {
        return Ok(());
    }
    let reason = format!("{} exists already and is no .{name} file; choose another name", printable_path(path));
    Err(StudioError::Usage(reason))
}
