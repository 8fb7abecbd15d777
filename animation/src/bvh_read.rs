//! The BVH parser: text to hierarchy and frames, every complaint with its line.

use nalgebra::Vector3;

use crate::{
    AnimationError,
    bvh::{Bvh, BvhJoint, Channel},
};

/// More joints than any character has: a guard against foreign files.
const MOST_JOINTS: usize = 4096;

/// Parses the text of a BVH file; `name` stands for the file in errors.
///
/// Any channel order, any white space, names with blanks, Windows line ends and braces on the joint's own line
/// are taken. Exactly the announced number of frames must follow.
///
/// # Errors
/// [`AnimationError::Bvh`] with the line of the first thing that is wrong.
pub fn parse(text: &str, name: &str) -> Result<Bvh, AnimationError> {
    let lines: Vec<&str> = text.trim_start_matches('\u{feff}').lines().collect();
    let mut reader = Reader { lines: &lines, line: 0, name };
    reader.expect_keyword("HIERARCHY", "a BVH file starts with HIERARCHY")?;
    let joints = reader.hierarchy()?;
    let (frame_time, frames) = reader.motion(joints.iter().map(|j| j.channels.len()).sum())?;
    let positions_add = positions_add(&joints, &frames);
    Ok(Bvh { joints, frame_time, frames, positions_add })
}

/// True where the position channels below the root are nearer to zero than to their joints' offsets.
fn positions_add(joints: &[BvhJoint], frames: &[Vec<f64>]) -> bool {
    let (mut from_zero, mut from_offset) = (0.0, 0.0);
    for frame in frames {
        let mut values = frame.iter();
        for joint in joints {
            for (channel, value) in joint.channels.iter().zip(&mut values) {
                if let (Channel::Position(axis), Some(_)) = (*channel, joint.parent) {
                    from_zero += value.abs();
                    from_offset += (value - joint.offset[axis]).abs();
                }
            }
        }
    }
    from_zero < from_offset
}

/// Goes through the lines; `line` is the index of the next one.
struct Reader<'a> {
    lines: &'a [&'a str],
    line: usize,
    name: &'a str,
}

/// What an open brace belongs to.
enum Block {
    Joint(usize),
    EndSite(usize),
}

impl<'a> Reader<'a> {
    fn error(&self, reason: impl Into<String>) -> AnimationError {
        AnimationError::Bvh { name: self.name.into(), line: self.line.max(1), reason: reason.into() }
    }

    /// The next line with something on it.
    fn next(&mut self) -> Option<&'a str> {
        while let Some(line) = self.lines.get(self.line) {
            self.line += 1;
            let line = line.trim();
            if !line.is_empty() {
                return Some(line);
            }
        }
        None
    }

    fn expect_keyword(&mut self, keyword: &str, reason: &str) -> Result<(), AnimationError> {
        match self.next() {
            Some(line) if line.eq_ignore_ascii_case(keyword) => Ok(()),
            _ => Err(self.error(reason)),
        }
    }

    /// Everything from ROOT to its closing brace and the line MOTION.
    fn hierarchy(&mut self) -> Result<Vec<BvhJoint>, AnimationError> {
        let mut joints: Vec<BvhJoint> = Vec::new();
        let mut open: Vec<Block> = Vec::new();
        let mut announced: Option<Block> = None;
        loop {
            let Some(line) = self.next() else { return Err(self.error("the hierarchy ends without MOTION")) };
            // Braces may stand on the line of what they open.
            let spaced = line.replace('{', " { ").replace('}', " } ");
            let mut words = spaced.split_whitespace().peekable();
            while let Some(word) = words.next() {
                match word.to_ascii_uppercase().as_str() {
                    "ROOT" | "JOINT" => {
                        let parent = self.parent_of_new_joint(word, &open, &joints)?;
                        let (name, offset) = (take_name(&mut words), Vector3::zeros());
                        joints.push(BvhJoint { name, parent, offset, channels: Vec::new(), end_site: None });
                        announced = Some(Block::Joint(joints.len() - 1));
                    }
                    "END" => {
                        take_name(&mut words);
                        let Some(Block::Joint(joint)) = open.last() else {
                            return Err(self.error("End Site outside a joint"));
                        };
                        announced = Some(Block::EndSite(*joint));
                    }
                    "{" => {
                        open.push(announced.take().ok_or_else(|| self.error("a brace that opens nothing"))?);
                    }
                    "}" => {
                        open.pop().ok_or_else(|| self.error("one closing brace too many"))?;
                    }
                    "OFFSET" => {
                        let offset = self.triple(&mut words)?;
                        match open.last() {
                            Some(Block::Joint(j)) => joints[*j].offset = offset,
                            Some(Block::EndSite(j)) => joints[*j].end_site = Some(offset),
                            None => return Err(self.error("OFFSET outside a joint")),
                        }
                    }
                    "CHANNELS" => {
                        let channels = self.channels(&mut words)?;
                        let Some(Block::Joint(j)) = open.last() else {
                            return Err(self.error("CHANNELS outside a joint"));
                        };
                        joints[*j].channels = channels;
                    }
                    "MOTION" if open.is_empty() && !joints.is_empty() => return Ok(joints),
                    "MOTION" => return Err(self.error("MOTION before the hierarchy is closed")),
                    other => return Err(self.error(format!("unexpected `{other}` in the hierarchy"))),
                }
            }
        }
    }

    fn parent_of_new_joint(
        &self,
        keyword: &str,
        open: &[Block],
        joints: &[BvhJoint],
    ) -> Result<Option<usize>, AnimationError> {
        if joints.len() >= MOST_JOINTS {
            return Err(self.error(format!("more than {MOST_JOINTS} joints")));
        }
        match (keyword.eq_ignore_ascii_case("ROOT"), open.last()) {
            (true, None) if joints.is_empty() => Ok(None),
            (true, None) => Err(self.error("a second ROOT; split the file into one motion a person")),
            (false, Some(Block::Joint(j))) => Ok(Some(*j)),
            _ => Err(self.error(format!("{keyword} does not belong here"))),
        }
    }

    fn number(&self, word: Option<&str>) -> Result<f64, AnimationError> {
        let word = word.ok_or_else(|| self.error("a number is missing"))?;
        match word.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(self.error(format!("`{word}` is not a finite number"))),
        }
    }

    fn triple<'w>(&self, words: &mut impl Iterator<Item = &'w str>) -> Result<Vector3<f64>, AnimationError> {
        Ok(Vector3::new(self.number(words.next())?, self.number(words.next())?, self.number(words.next())?))
    }

    fn channels<'w>(&self, words: &mut impl Iterator<Item = &'w str>) -> Result<Vec<Channel>, AnimationError> {
        let count = self.number(words.next())?;
        if !(0.0..=6.0).contains(&count) || count.fract() != 0.0 {
            return Err(self.error(format!("a joint has 0 to 6 channels, not {count}")));
        }
        let channels: Vec<Channel> = words.by_ref().take(count as usize).filter_map(channel_of_name).collect();
        if channels.len() != count as usize {
            return Err(self.error(format!("{count} channels announced, {} of a known name follow", channels.len())));
        }
        Ok(channels)
    }

    /// `Frames:`, `Frame Time:` and the rows.
    fn motion(&mut self, channels: usize) -> Result<(f64, Vec<Vec<f64>>), AnimationError> {
        let count = self.header("Frames:")?;
        if count < 1.0 || count.fract() != 0.0 {
            return Err(self.error(format!("a motion has at least one frame, this one says {count}")));
        }
        let frame_time = self.header("Frame Time:")?;
        if frame_time <= 0.0 {
            return Err(self.error(format!("the frame time must be above 0 s, it is {frame_time}")));
        }
        if channels == 0 {
            return Err(self.error("no joint has channels: nothing can move"));
        }
        let mut frames = Vec::new();
        while let Some(line) = self.next() {
            let row = line.split_whitespace().map(|w| self.number(Some(w))).collect::<Result<Vec<f64>, _>>()?;
            if row.len() != channels {
                return Err(self.error(format!("{} numbers where the hierarchy has {channels} channels", row.len())));
            }
            frames.push(row);
        }
        if frames.len() as f64 != count {
            return Err(self.error(format!("{count} frames announced, {} are there: the file is torn", frames.len())));
        }
        Ok((frame_time, frames))
    }

    /// The number on the next line, which must start with `key`.
    fn header(&mut self, key: &str) -> Result<f64, AnimationError> {
        let line = self.next().unwrap_or_default();
        match line.get(..key.len()) {
            Some(start) if start.eq_ignore_ascii_case(key) => self.number(Some(line[key.len()..].trim())),
            _ => Err(self.error(format!("`{key}` is missing"))),
        }
    }
}

fn take_name<'w>(words: &mut std::iter::Peekable<impl Iterator<Item = &'w str>>) -> String {
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

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 3 Xrotation Yrotation Zrotation\n}\nMOTION\n\
                        Frames: 2\nFrame Time: 0.1\n1 2 3\n4 5 6\n";

    fn complaint(from: &str, to: &str) -> String {
        assert!(GOOD.contains(from));
        parse(&GOOD.replace(from, to), "x.bvh").unwrap_err().to_string()
    }

    #[test]
    fn complaints_name_the_line() {
        assert!(parse(GOOD, "x").is_ok());
        assert!(complaint("HIERARCHY", "ply").contains("x.bvh, line 1"));
        assert!(complaint("4 5 6", "4 5").contains("line 11: 2 numbers where the hierarchy has 3"));
        assert!(complaint("4 5 6", "4 nan 6").contains("line 11: `nan`"));
        assert!(complaint("4 5 6\n", "").contains("the file is torn"));
        assert!(complaint("0.1", "0").contains("line 9"));
        assert!(complaint("Frames: 2", "Frames: 0").contains("line 8"));
        assert!(complaint("Zrotation", "Wrotation").contains("line 5"));
        assert!(complaint("}\n", "").contains("MOTION before the hierarchy is closed"));
        assert!(complaint("}\n", "}\n}\n").contains("line 7: one closing brace too many"));
        assert!(complaint("}\n", "}\nROOT b\n{\n}\n").contains("second ROOT"));
        assert!(complaint("0 0 0", "0 0").contains("line 4"));
        assert!(parse("", "x").is_err());
    }

    #[test]
    fn no_prefix_of_a_file_panics() {
        for end in 0..GOOD.len() {
            let _ = parse(&GOOD[..end], "x");
        }
    }
}
