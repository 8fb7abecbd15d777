//! The hierarchy of a BVH file: joints with their offsets, channels and End Sites.

use nalgebra::Vector3;

use super::{
    lines::{Lines, shortened},
    model::{BvhJoint, Channel},
};
use crate::AnimationError;

/// Maximum number of joints: more than any character has, few enough that chains of them can be followed.
const MAX_JOINTS: usize = 1024;
/// Maximum length of a joint's name, bytes.
const MAX_NAME: usize = 256;

/// The words of a line.
type Words<'w> = std::iter::Peekable<std::str::SplitWhitespace<'w>>;

/// Everything from ROOT to its closing brace and the line MOTION.
pub(super) fn read(lines: &mut Lines) -> Result<Vec<BvhJoint>, AnimationError> {
    let mut hierarchy = Hierarchy::default();
    loop {
        let Some(line) = lines.next() else { return Err(lines.error("the hierarchy ends without MOTION")) };
        // Braces may stand on the line of what they open.
        let spaced = line.replace('{', " { ").replace('}', " } ");
        let mut words = spaced.split_whitespace().peekable();
        while let Some(word) = words.next() {
            if word.eq_ignore_ascii_case("MOTION") {
                return hierarchy.finished(lines);
            }
            hierarchy.read_word(word, &mut words, lines)?;
        }
    }
}

/// The item that an open brace belongs to.
#[derive(Clone, Copy)]
enum Block {
    Joint(usize),
    EndSite(usize),
}

/// The joints so far.
#[derive(Default)]
struct Hierarchy {
    joints: Vec<BvhJoint>,
    /// Blocks whose braces are open.
    open: Vec<Block>,
    /// The block that the next brace opens.
    announced: Option<Block>,
}

impl Hierarchy {
    fn finished(self, lines: &Lines) -> Result<Vec<BvhJoint>, AnimationError> {
        if !self.open.is_empty() || self.joints.is_empty() {
            return Err(lines.error("MOTION before the hierarchy is closed"));
        }
        Ok(self.joints)
    }

    fn read_word(&mut self, word: &str, words: &mut Words, lines: &Lines) -> Result<(), AnimationError> {
        match word.to_ascii_uppercase().as_str() {
            "ROOT" | "JOINT" => self.add_joint(word, words, lines)?,
            "END" => {
                take_name(words);
                self.announced = Some(Block::EndSite(self.open_joint("End Site", lines)?));
            }
            "{" => {
                let block = self.announced.take().ok_or_else(|| lines.error("a brace that opens nothing"))?;
                self.open.push(block);
            }
            "}" => {
                self.open.pop().ok_or_else(|| lines.error("one closing brace too many"))?;
            }
            "OFFSET" => self.read_offset(words, lines)?,
            "CHANNELS" => {
                let channels = read_channels(words, lines)?;
                let joint = self.open_joint("CHANNELS", lines)?;
                self.joints[joint].channels = channels;
            }
            other => return Err(lines.error(format!("unexpected `{}` in the hierarchy", shortened(other)))),
        }
        Ok(())
    }

    /// The joint whose brace was opened last.
    fn open_joint(&self, what: &str, lines: &Lines) -> Result<usize, AnimationError> {
        match self.open.last() {
            Some(Block::Joint(joint)) => Ok(*joint),
            _ => Err(lines.error(format!("{what} outside a joint"))),
        }
    }

    fn add_joint(&mut self, keyword: &str, words: &mut Words, lines: &Lines) -> Result<(), AnimationError> {
        let parent = self.parent_of_new_joint(keyword, lines)?;
        let name = take_name(words);
        if name.len() > MAX_NAME {
            return Err(lines.error(format!("the name of a joint has {} bytes, more than {MAX_NAME}", name.len())));
        }
        self.announced = Some(Block::Joint(self.joints.len()));
        self.joints.push(BvhJoint { name, parent, offset: Vector3::zeros(), channels: Vec::new(), end_site: None });
        Ok(())
    }

    fn parent_of_new_joint(&self, keyword: &str, lines: &Lines) -> Result<Option<usize>, AnimationError> {
        if self.joints.len() >= MAX_JOINTS {
            return Err(lines.error(format!("more than {MAX_JOINTS} joints")));
        }
        match (keyword.eq_ignore_ascii_case("ROOT"), self.open.last()) {
            (true, None) if self.joints.is_empty() => Ok(None),
            (true, None) => Err(lines.error("a second ROOT; split the file into one motion for each person")),
            (false, Some(Block::Joint(joint))) => Ok(Some(*joint)),
            _ => Err(lines.error(format!("{keyword} does not belong here"))),
        }
    }

    fn read_offset(&mut self, words: &mut Words, lines: &Lines) -> Result<(), AnimationError> {
        let mut next = || lines.number(words.next());
        let offset = Vector3::new(next()?, next()?, next()?);
        match self.open.last() {
            Some(Block::Joint(joint)) => self.joints[*joint].offset = offset,
            Some(Block::EndSite(joint)) => self.joints[*joint].end_site = Some(offset),
            None => return Err(lines.error("OFFSET outside a joint")),
        }
        Ok(())
    }
}

fn read_channels(words: &mut Words, lines: &Lines) -> Result<Vec<Channel>, AnimationError> {
    let count = lines.number(words.next())?;
    if !(0.0..=6.0).contains(&count) || count.fract() != 0.0 {
        return Err(lines.error(format!("a joint has 0 to 6 channels, not {count}")));
    }
    let channels: Vec<Channel> = words.take(count as usize).filter_map(channel_of_name).collect();
    if channels.len() != count as usize {
        return Err(lines.error(format!("CHANNELS announces {count}, but {} of a known name follow", channels.len())));
    }
    Ok(channels)
}

fn take_name(words: &mut Words) -> String {
    let mut name: Vec<&str> = Vec::new();
    while let Some(word) = words.next_if(|w| *w != "{" && *w != "}") {
        name.push(word);
    }
    name.join(" ")
}

fn channel_of_name(name: &str) -> Option<Channel> {
    let axis = match name.as_bytes().first()?.to_ascii_lowercase() {
        b'x' => 0,
        b'y' => 1,
        b'z' => 2,
        _ => return None,
    };
    match name.get(1..)?.to_ascii_lowercase().as_str() {
        "position" => Some(Channel::Position(axis)),
        "rotation" => Some(Channel::Rotation(axis)),
        _ => None,
    }
}
