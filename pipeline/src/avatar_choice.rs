//! The choices that a subject's avatar was made with: kept in `SUBJECT/edits/avatar.json`, with its motion beside, so that the next
//! run makes the same one.

use std::{
    ffi::OsStr,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};
use toile_capture::files::{atomic_write, is_there, read_limited};
use toile_character::JointNaming;
use toile_garments::{CullSettings, Part};

use crate::{
    PipelineError,
    folders::Folders,
    formats::FileFormat,
    json, levels, motion,
    options::{HiddenChoice, MotionChoice, Options, Springs},
};

/// The choices for an avatar. The default is the shipped walk, VRM's joint names, and whole layers.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AvatarChoice {
    /// File name of the motion in `SUBJECT/edits/motion/`; without, the shipped walk.
    pub motion: Option<String>,
    /// The names of the joints in `avatar.glb`.
    pub joint_names: JointNaming,
    /// How what clothes hide is left out; without, nothing is.
    pub hidden: Option<CullSettings>,
    /// Whether loose parts swing in `avatar.vrm`; without, as the settings say.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub springs: Option<Springs>,
    /// Generic garments stand for those that were cut out of the takes.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub generic: bool,
    /// What gives way where a garment is too tight for the body.
    #[serde(skip_serializing_if = "Part::is_cloth")]
    pub part: Part,
    /// The formats that it is written in beside GLB and VRM.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub formats: Vec<FileFormat>,
    /// The levels of detail that it is also written in, triangles a layer, falling.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub levels: Vec<usize>,
}

impl AvatarChoice {
    /// The choices that the avatar at `folders` was made with last.
    ///
    /// # Errors
    /// [`PipelineError`] where the file cannot be read.
    pub fn read(folders: &Folders) -> Result<Self, PipelineError> {
        let path = folders.avatar_choice();
        if is_there(&path) { json::read(&path) } else { Ok(Self::default()) }
    }

    /// Its choices now: as before where `options` say nothing. A motion is copied into the subject's folder.
    ///
    /// # Errors
    /// [`PipelineError`] where a file cannot be read or written.
    pub fn choose(folders: &Folders, options: &Options) -> Result<Self, PipelineError> {
        let before = Self::read(folders)?;
        let mut choice = before.clone();
        match &options.motion {
            MotionChoice::AsBefore => {}
            MotionChoice::Walk => choice.motion = None,
            MotionChoice::File(path) => choice.motion = Some(keep(folders, path)?),
        }
        match &options.hidden {
            HiddenChoice::AsBefore => {}
            HiddenChoice::Whole => choice.hidden = None,
            HiddenChoice::LeftOut(settings) => choice.hidden = Some(settings.clone()),
        }
        if let Some(asked) = &options.formats {
            choice.formats = FileFormat::beside_usual(asked);
        }
        if let Some(asked) = &options.levels {
            choice.levels.clone_from(asked);
            choice.levels.sort_unstable_by(|a, b| b.cmp(a));
            choice.levels.dedup();
        }
        choice.springs = options.springs.or(choice.springs);
        choice.joint_names = options.joint_names.unwrap_or(choice.joint_names);
        if choice != before {
            atomic_write(&folders.avatar_choice(), &json::pretty(&choice)?)?;
        }
        Ok(choice)
    }

    /// The choices now as far as garments are concerned; the others stay as before until [`AvatarChoice::choose`].
    ///
    /// # Errors
    /// [`PipelineError`] where the file cannot be read or written.
    pub fn choose_cloth(folders: &Folders, options: &Options) -> Result<Self, PipelineError> {
        let mut choice = Self::read(folders)?;
        let (generic, part) = (options.generic.unwrap_or(choice.generic), options.part.unwrap_or(choice.part));
        if (generic, part) != (choice.generic, choice.part) {
            (choice.generic, choice.part) = (generic, part);
            atomic_write(&folders.avatar_choice(), &json::pretty(&choice)?)?;
        }
        Ok(choice)
    }

    /// The file of the body that the garments are worn on.
    pub fn body_mesh(&self, folders: &Folders) -> PathBuf {
        if self.part == Part::Body { folders.pressed_body() } else { folders.body_mesh() }
    }

    /// The file of the motion; `None` for the shipped walk.
    pub fn motion_path(&self, folders: &Folders) -> Option<PathBuf> {
        self.motion.as_ref().map(|name| folders.motions().join(name))
    }

    /// Differences from an avatar that nobody chose anything for, in words.
    pub fn in_words(&self) -> Vec<String> {
        let motion = self
            .motion
            .as_ref()
            .map(|name| format!("the motion {name} (--motion {} for the shipped one)", motion::WALK));
        let hidden =
            self.hidden.as_ref().map(|_| "nothing that clothes hide (`toile export` alone makes it whole)".to_string());
        let is_vrm = self.joint_names == JointNaming::Vrm;
        let names =
            (!is_vrm).then(|| "joint names of another system (--joint-names vrm for the usual ones)".to_string());
        let springs = (self.springs == Some(Springs::Off))
            .then(|| "nothing that swings in avatar.vrm (--springs on for springs)".to_string());
        let formats = (!self.formats.is_empty()).then(|| {
            let names: Vec<&str> = self.formats.iter().map(|f| f.name()).collect();
            format!("files as {} (`toile export --to glb,vrm` for the usual ones alone)", names.join(", "))
        });
        let generic = self.generic.then(|| "generic garments (--generic=off for those that were cut)".to_string());
        let part = (self.part == Part::Body)
            .then(|| "a body that gives way to tight garments (--part cloth for cloth that does)".to_string());
        let levels = (!self.levels.is_empty()).then(|| {
            let names: Vec<String> = self.levels.iter().map(|&n| levels::file_name(n)).collect();
            format!("levels of detail as {} (`toile export --lod off` for none)", names.join(", "))
        });
        [motion, hidden, names, springs, generic, part, formats, levels].into_iter().flatten().collect()
    }
}

/// Copies a motion into the subject's folder and gives its name there. Where another motion has that name already, the
/// copy gets a number: `dance-2.bvh`.
fn keep(folders: &Folders, path: &Path) -> Result<String, PipelineError> {
    let bytes = read_limited(path, json::MAX_BYTES)?;
    let text = |part: Option<&OsStr>| part.unwrap_or_default().to_string_lossy().into_owned();
    let (stem, extension) = (text(path.file_stem()), text(path.extension()));
    let end = if extension.is_empty() { String::new() } else { format!(".{extension}") };
    let names = (1_u32..).map(|n| if n == 1 { format!("{stem}{end}") } else { format!("{stem}-{n}{end}") });
    for name in names {
        let kept = folders.motions().join(&name);
        if !is_there(&kept) {
            atomic_write(&kept, &bytes)?;
            return Ok(name);
        }
        if read_limited(&kept, json::MAX_BYTES).is_ok_and(|old| old == bytes) {
            return Ok(name);
        }
    }
    Err(PipelineError::refused(path, "there is no free name left for it in the subject's edits/motion"))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn a_motion_never_replaces_another_one_of_its_name() {
        let dir = tempfile::tempdir().unwrap();
        let (folders, bvh) = (Folders::new(&dir.path().join("anna")), dir.path().join("dance.bvh"));
        let choose = |content: &str| {
            fs::write(&bvh, content).unwrap();
            let options = Options { motion: MotionChoice::File(bvh.clone()), ..Options::default() };
            AvatarChoice::choose(&folders, &options).unwrap().motion.unwrap()
        };
        assert_eq!(
            [choose("a"), choose("b"), choose("a"), choose("b")],
            ["dance.bvh", "dance-2.bvh", "dance.bvh", "dance-2.bvh"]
        );
        let at = |name: &str| folders.motions().join(name);
        assert_eq!(fs::read_to_string(at("dance.bvh")).unwrap(), "a");
        // What could block for ever is no motion, and is not waited for.
        fs::remove_file(at("dance.bvh")).unwrap();
        std::os::unix::fs::symlink("/dev/zero", at("dance.bvh")).unwrap();
        assert_eq!(choose("c"), "dance-3.bvh");
        fs::remove_file(folders.avatar_choice()).unwrap();
        std::os::unix::fs::symlink("gone", folders.avatar_choice()).unwrap();
        assert!(AvatarChoice::read(&folders).unwrap_err().to_string().contains("avatar.json"));
    }

    #[test]
    fn a_choice_is_kept_until_another_one_is_made() {
        use FileFormat::{Glb, Obj, Usda};
        let dir = tempfile::tempdir().unwrap();
        let (folders, bvh) = (Folders::new(&dir.path().join("anna")), dir.path().join("dance.bvh"));
        fs::write(&bvh, "HIERARCHY").unwrap();
        let with = |options: Options| AvatarChoice::choose(&folders, &options).unwrap();
        assert_eq!(with(Options::default()), AvatarChoice::default());
        assert!(!folders.avatar_choice().exists(), "nothing was chosen");
        let hidden = HiddenChoice::LeftOut(CullSettings::default());
        let chosen = with(Options { motion: MotionChoice::File(bvh), hidden, ..Options::default() });
        assert_eq!(fs::read_to_string(chosen.motion_path(&folders).unwrap()).unwrap(), "HIERARCHY");
        assert_eq!(with(Options::default()), chosen);
        assert!(!fs::read_to_string(folders.avatar_choice()).unwrap().contains("formats"), "as files were before");
        assert_eq!(chosen.in_words().len(), 2);
        let walks = with(Options { motion: MotionChoice::Walk, ..Options::default() });
        assert_eq!((walks.motion, walks.hidden), (None, chosen.hidden));
        let files = with(Options { formats: Some(vec![Usda, Glb, Obj, Usda]), ..Options::default() });
        assert_eq!((&files.formats, with(Options::default()).formats), (&vec![Obj, Usda], vec![Obj, Usda]));
        assert!(with(Options { formats: Some(vec![Glb]), ..Options::default() }).formats.is_empty());
        with(Options { hidden: HiddenChoice::Whole, ..Options::default() });
        assert_eq!(AvatarChoice::read(&folders).unwrap(), AvatarChoice::default());
    }
}
