//! Where an unfinished motion stands: a file beside the caches that says how many frames are in them, and from what the next one
//! follows. A killed run goes on from there, and ends with the bytes of a run that was not killed.
//!
//! The file: a line with the SHA-256 of what follows, a line of JSON ([`Head`]), and the numbers of the state, 64 bits each,
//! little-endian. It is written whole or not at all, after the caches were synced.

use std::{
    fs,
    io::Write,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use serde::{Deserialize, Serialize};
use toile_avatar::Avatar;
use toile_capture::files::{atomic_write, is_there, read_bytes};
use toile_character::{FREE_PART, Motion};
use toile_cloth::Fabric;

use super::{caches::Caches, mover::Mover, options::AnimateOptions, report::FrameReport};
use crate::{PipelineError, hash, resume::PROGRAM};

/// Version of the way from a pose to a frame: raised where frames change, so that no run goes on with those of an older program.
const VERSION: u32 = 1;
/// Name of the file.
const NAME: &str = "unfinished";
/// A state is written again after this many times of what writing it took, so that it costs less than a twentieth.
const SHARE: u32 = 20;

/// Everything that decides the frames.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Key {
    program: String,
    version: u32,
    subject: String,
    motion: String,
    settings: String,
}

impl Key {
    /// Of the `avatar` in these `fabrics` (one a layer), moved as `options` say.
    pub fn new(
        avatar: &Avatar,
        fabrics: &[Fabric],
        motion: &Motion,
        options: &AnimateOptions,
    ) -> Result<Self, PipelineError> {
        let how = serde_json::json!([options.profile, options.blend, options.skinning.name(), fabrics]);
        Ok(Self {
            program: PROGRAM.into(),
            version: VERSION,
            subject: of_avatar(avatar)?,
            motion: hash::bytes(&serde_json::to_vec(&(motion.frame_time, &motion.poses))?),
            settings: hash::bytes(how.to_string().as_bytes()),
        })
    }

    /// What is not the same as in `other`.
    fn difference(&self, other: &Self) -> Option<&'static str> {
        let parts = [
            (self.program != other.program || self.version != other.version, "program"),
            (self.subject != other.subject, "state of the subject"),
            (self.motion != other.motion, "motion"),
            (self.settings != other.settings, "profile, blend, skinning or fabric"),
        ];
        parts.into_iter().find(|(differs, _)| *differs).map(|(_, what)| what)
    }
}

fn of_avatar(avatar: &Avatar) -> Result<String, PipelineError> {
    let rest: Vec<[f64; 3]> = avatar.skeleton.rest.iter().map(|p| [p.x, p.y, p.z]).collect();
    let mut bytes = serde_json::to_vec(&(rest, &avatar.pose0))?;
    for layer in &avatar.layers {
        bytes.extend(layer.name.as_bytes());
        let places = layer.mesh.positions.iter().flat_map(|p| [p.x, p.y, p.z]);
        let free = layer.mesh.attributes.get(FREE_PART).into_iter().flatten().copied();
        let weights = layer.weights.weights.iter().flatten().copied();
        places.chain(free).chain(weights).for_each(|x| bytes.extend(x.to_le_bytes()));
        layer.mesh.triangles.iter().flatten().for_each(|v| bytes.extend(v.to_le_bytes()));
        bytes.extend(layer.weights.joints.iter().flatten());
    }
    Ok(hash::bytes(&bytes))
}

/// The first line after the hash.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Head {
    key: Key,
    /// The frames that are in the caches.
    frames: Vec<FrameReport>,
    /// Lengths of the lists of the state.
    lists: Vec<usize>,
}

/// What an earlier run left.
pub(super) enum Left {
    /// Nothing.
    Nothing,
    /// Something that cannot be gone on with; the reason ends a sentence.
    Useless(String),
    /// The frames that are in the caches, and the state after the last of them.
    Unfinished(Vec<FrameReport>, Vec<Vec<f64>>),
}

/// Looks for what an earlier run with this `key` left in `folder`.
pub(super) fn left(folder: &Path, key: &Key) -> Result<Left, PipelineError> {
    let path = folder.join(NAME);
    if !is_there(&path) {
        return Ok(Left::Nothing);
    }
    let Some((head, state)) = parsed(&read_bytes(&path)?) else {
        return Ok(Left::Useless("its file `unfinished` is damaged".into()));
    };
    Ok(match key.difference(&head.key) {
        Some(what) => Left::Useless(format!("it was of another {what}")),
        None => Left::Unfinished(head.frames, state),
    })
}

fn parsed(bytes: &[u8]) -> Option<(Head, Vec<Vec<f64>>)> {
    let line = |bytes: &[u8]| bytes.iter().position(|b| *b == b'\n');
    let (sum, rest) = bytes.split_at_checked(line(bytes)? + 1)?;
    if hash::bytes(rest).as_bytes() != &sum[..sum.len() - 1] {
        return None;
    }
    let (head, mut numbers) = rest.split_at_checked(line(rest)? + 1)?;
    let head: Head = serde_json::from_slice(head).ok()?;
    let mut state = Vec::with_capacity(head.lists.len());
    for &length in &head.lists {
        let (list, after) = numbers.split_at_checked(length.checked_mul(8)?)?;
        let number = |b: &[u8]| f64::from_le_bytes([b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]]);
        state.push(list.chunks_exact(8).map(number).collect());
        numbers = after;
    }
    numbers.is_empty().then_some((head, state))
}

/// Writes where a run stands, from time to time.
pub(super) struct Checkpoints {
    path: PathBuf,
    key: Key,
    every: Duration,
    last: Instant,
    cost: Duration,
}

impl Checkpoints {
    /// For a run in `folder`, at least `every` so long apart.
    pub fn new(folder: &Path, key: Key, every: Duration) -> Self {
        Self { path: folder.join(NAME), key, every, last: Instant::now(), cost: Duration::ZERO }
    }

    /// Writes where the run stands if that is worth its time, or where it is at its last frame.
    pub fn at(
        &mut self,
        caches: &mut Caches,
        mover: &Mover,
        frames: &[FrameReport],
        is_last: bool,
    ) -> Result<(), PipelineError> {
        if !is_last && self.last.elapsed() < self.every.max(self.cost * SHARE) {
            return Ok(());
        }
        let begun = Instant::now();
        caches.sync()?;
        let state = mover.state();
        let lists = state.iter().map(Vec::len).collect();
        let head = Head { key: self.key.clone(), frames: frames.to_vec(), lists };
        let mut body = serde_json::to_vec(&head)?;
        body.push(b'\n');
        state.iter().flatten().for_each(|x| body.extend(x.to_le_bytes()));
        let mut bytes = Vec::with_capacity(body.len() + 65);
        writeln!(bytes, "{}", hash::bytes(&body)).map_err(|e| PipelineError::io(&self.path, e))?;
        bytes.extend(body);
        atomic_write(&self.path, &bytes)?;
        (self.last, self.cost) = (Instant::now(), begun.elapsed());
        Ok(())
    }

    /// Removes the file: the motion is whole, or begins anew.
    pub fn clear(&self) -> Result<(), PipelineError> {
        match fs::remove_file(&self.path) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(PipelineError::io(&self.path, e)),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_damaged_or_of_something_else_is_not_gone_on_with() {
        let folder = tempfile::tempdir().unwrap();
        let key = |motion: &str| Key {
            program: PROGRAM.into(),
            version: VERSION,
            subject: "s".into(),
            motion: motion.into(),
            settings: "a".into(),
        };
        let why = |folder: &Path, key: &Key| match left(folder, key).unwrap() {
            Left::Nothing => "nothing".into(),
            Left::Useless(why) => why,
            Left::Unfinished(frames, state) => format!("{} frames, {state:?}", frames.len()),
        };
        assert_eq!(why(folder.path(), &key("m")), "nothing");
        let head = Head { key: key("m"), frames: Vec::new(), lists: vec![1, 2] };
        let numbers: Vec<u8> = [0.1f64, f64::MIN_POSITIVE, -3.0].iter().flat_map(|x| x.to_le_bytes()).collect();
        let body = [serde_json::to_vec(&head).unwrap(), b"\n".to_vec(), numbers].concat();
        let whole = [hash::bytes(&body).into_bytes(), b"\n".to_vec(), body].concat();
        let write = |bytes: &[u8]| fs::write(folder.path().join(NAME), bytes).unwrap();
        write(&whole);
        assert_eq!(
            why(folder.path(), &key("m")),
            format!("0 frames, {:?}", [vec![0.1], vec![f64::MIN_POSITIVE, -3.0]])
        );
        assert_eq!(why(folder.path(), &key("n")), "it was of another motion");
        for cut in [0, 10, 70, whole.len() - 1] {
            write(&whole[..cut]);
            assert!(why(folder.path(), &key("m")).contains("damaged"), "{cut}");
        }
        let mut flipped = whole.clone();
        flipped[80] ^= 1;
        write(&flipped);
        assert!(why(folder.path(), &key("m")).contains("damaged"));
    }
}
