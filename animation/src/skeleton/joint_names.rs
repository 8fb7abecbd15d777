//! Names of joints taken apart: side, part of the body, segment of a chain.
//!
//! Reads the names of VRM, Unity, Mixamo, H-Anim, MakeHuman, CMU conversions, Bandai Namco, Biped, Unreal, SMPL, Rigify,
//! Auto-Rig Pro, DAZ, Character Creator, OptiTrack, Xsens, Rokoko, Perception Neuron, DeepMotion, Second Life, MikuMikuDance
//! and their like: sides as word, letter, prefix or suffix; any separators; camel case or not.

/// Side of the body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Side {
    Left,
    Right,
    Middle,
}

/// A name taken apart.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct JointName {
    /// The side that it names.
    pub side: Side,
    /// The words that are left without side, digits and decoration, joined: `upperleg`.
    pub part: String,
    /// The numbers in it, in order.
    pub numbers: Vec<u32>,
}

pub(crate) const UPPER_LEG: &[&str] = &["upperleg", "upleg", "thigh", "thighbend", "femur", "hip", "leg"];
pub(crate) const LOWER_LEG: &[&str] = &["lowerleg", "loleg", "lowleg", "shin", "calf", "knee", "tibia", "leg"];
pub(crate) const FOOT: &[&str] = &["ankle", "talocrural", "foot"];
pub(crate) const TOES: &[&str] = &["toes", "toebase", "toe", "ball", "metatarsal", "metatarsophalangeal", "foot"];
pub(crate) const CLAVICLE: &[&str] = &["clavicle", "collar", "collarbone", "sternoclavicular", "scapula", "shoulder"];
pub(crate) const UPPER_ARM: &[&str] = &["upperarm", "uparm", "humerus", "arm", "shldr", "shldrbend", "shoulder"];
pub(crate) const LOWER_ARM: &[&str] =
    &["lowerarm", "loarm", "lowarm", "forearm", "forearmbend", "elbow", "radius", "ulna"];
pub(crate) const HAND: &[&str] = &["wrist", "radiocarpal", "hand"];
pub(crate) const HEAD: &[&str] = &["head", "skullbase", "skull"];

/// Finger names by finger, thumb first; MakeHuman and DAZ count `finger1` (the thumb) to `finger5`.
const FINGERS: [&[&str]; 5] = [&["thumb"], &["index"], &["middle", "mid"], &["ring"], &["little", "pinky"]];

/// Words that decorate names and carry no meaning.
const NOISE: &[&str] = &[
    "joint",
    "jnt",
    "bone",
    "bip",
    "j",
    "c",
    "m",
    "x",
    "def",
    "org",
    "valve",
    "biped",
    "mixamorig",
    "character",
    "skel",
    "stretch",
];

/// What is written for words that are not taken apart as others are: OptiTrack's short arms, whose `LF` would be a side, and the
/// Japanese of MikuMikuDance's models, longer words before those that they contain.
const WRITTEN_FOR: [(&str, &str); 17] = [
    ("LUArm", "L upperarm"),
    ("RUArm", "R upperarm"),
    ("LFArm", "L forearm"),
    ("RFArm", "R forearm"),
    ("左", "left "),
    ("右", "right "),
    ("足首", "ankle "),
    ("足", "leg "),
    ("ひざ", "knee "),
    ("つま先", "toe "),
    ("肩", "collar "),
    ("腕", "arm "),
    ("ひじ", "elbow "),
    ("手首", "wrist "),
    ("親指", "thumb "),
    ("頭", "head "),
    ("首", "neck "),
];

impl JointName {
    /// Takes `name` apart.
    pub fn parse(name: &str) -> Self {
        let local = name.rsplit([':', '|', '/']).next().unwrap_or(name);
        let plain = WRITTEN_FOR.iter().fold(local.to_string(), |name, (written, word)| name.replace(written, word));
        let mut side = Side::Middle;
        let mut part = String::new();
        let mut numbers = Vec::new();
        for word in words(&plain) {
            if let Ok(number) = word.parse::<u32>() {
                numbers.push(number);
            } else if let (Some(found), Side::Middle) = (side_of_word(&word), side) {
                side = found;
            } else if !NOISE.contains(&word.as_str()) {
                part.push_str(&word);
            }
        }
        if side == Side::Middle && !is_known(&part) {
            for (prefix, found) in [("left", Side::Left), ("right", Side::Right), ("l", Side::Left), ("r", Side::Right)]
            {
                if let Some(rest) = part.strip_prefix(prefix).filter(|rest| is_known(rest)) {
                    (side, part) = (found, rest.to_string());
                    break;
                }
            }
        }
        Self { side, part, numbers }
    }

    /// Which finger it belongs to (0 = thumb) and which segment of it (1, 2, 3 ...).
    pub fn finger(&self) -> Option<(usize, u32)> {
        if self.part == "finger" {
            let (&finger, rest) = self.numbers.split_first()?;
            return (1..=5).contains(&finger).then(|| (finger as usize - 1, rest.first().copied().unwrap_or(1)));
        }
        if self.part.ends_with("phalangeal") || self.part == "carpometacarpal" {
            return self.hanim_finger();
        }
        let finger = FINGERS.iter().position(|names| names.iter().any(|n| self.part.contains(n)))?;
        let thumb = finger == 0;
        let segment = match self.numbers.last() {
            Some(&number) => number,
            None if self.part.ends_with("metacarpal") => u32::from(thumb),
            None if self.part.ends_with("proximal") => 1 + u32::from(thumb),
            None if self.part.ends_with("intermediate") => 2,
            None if self.part.ends_with("distal") => 3,
            None => 1,
        };
        Some((finger, segment))
    }

    /// H-Anim names the joint and numbers the finger, 1 the thumb: `l_carpal_proximal_interphalangeal_2`.
    fn hanim_finger(&self) -> Option<(usize, u32)> {
        let finger = self.numbers.last().filter(|n| (1..=5).contains(*n))?.checked_sub(1)? as usize;
        let thumb = finger == 0;
        let segment = match self.part.as_str() {
            "carpometacarpal" if thumb => 1,
            "metacarpophalangeal" => 1 + u32::from(thumb),
            "carpalproximalinterphalangeal" => 2,
            "carpalinterphalangeal" | "carpaldistalinterphalangeal" => 3,
            _ => return None,
        };
        Some((finger, segment))
    }
}

fn is_known(part: &str) -> bool {
    let lists = [UPPER_LEG, LOWER_LEG, FOOT, TOES, CLAVICLE, UPPER_ARM, LOWER_ARM, HAND];
    lists.iter().any(|l| l.contains(&part)) || FINGERS.iter().flat_map(|f| f.iter()).any(|f| *f == part)
}

fn side_of_word(word: &str) -> Option<Side> {
    match word {
        "l" | "left" | "lt" | "lf" => Some(Side::Left),
        "r" | "right" | "rt" | "rg" => Some(Side::Right),
        _ => None,
    }
}

/// Lower-case words and numbers of a name, split at separators, digits and camel-case humps.
fn words(name: &str) -> Vec<String> {
    let chars: Vec<char> = name.chars().collect();
    let mut words: Vec<String> = vec![String::new()];
    for (i, &c) in chars.iter().enumerate() {
        let before = i.checked_sub(1).map(|b| chars[b]);
        let hump = c.is_ascii_uppercase()
            && (before.is_some_and(|b| b.is_ascii_lowercase())
                || before.is_some_and(|b| b.is_ascii_uppercase())
                    && chars.get(i + 1).is_some_and(char::is_ascii_lowercase));
        let digits = before.is_some_and(|b| b.is_ascii_digit() != c.is_ascii_digit());
        if hump || digits || !c.is_ascii_alphanumeric() {
            words.push(String::new());
        }
        if let (true, Some(word)) = (c.is_ascii_alphanumeric(), words.last_mut()) {
            word.push(c.to_ascii_lowercase());
        }
    }
    words.retain(|w| !w.is_empty());
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_many_schools_are_understood() {
        let cases = [
            ("LeftUpLeg", Side::Left, "upleg"),
            ("mixamorig:RightForeArm", Side::Right, "forearm"),
            ("UpperArm_L", Side::Left, "upperarm"),
            ("LoArm_R", Side::Right, "loarm"),
            ("lhip", Side::Left, "hip"),
            ("rshoulder", Side::Right, "shoulder"),
            ("LHipJoint", Side::Left, "hip"),
            ("upperleg01.R", Side::Right, "upperleg"),
            ("J_Bip_L_LowerArm", Side::Left, "lowerarm"),
            ("Bip01 R Calf", Side::Right, "calf"),
            ("thigh_l", Side::Left, "thigh"),
            ("l_talocrural", Side::Left, "talocrural"),
            ("lShldr", Side::Left, "shldr"),
            ("leftupperarm", Side::Left, "upperarm"),
            ("rightLowerLeg", Side::Right, "lowerleg"),
            ("lowerneck", Side::Middle, "lowerneck"),
            ("leg", Side::Middle, "leg"),
        ];
        for (name, side, part) in cases {
            let parsed = JointName::parse(name);
            assert_eq!((parsed.side, parsed.part.as_str()), (side, part), "{name}");
        }
    }

    #[test]
    fn fingers_and_their_segments_are_found() {
        let cases = [
            ("finger2-1.l", Some((1, 1))),
            ("LeftHandIndex3", Some((1, 3))),
            ("__Pinky1_R", Some((4, 1))),
            ("leftThumbMetacarpal", Some((0, 1))),
            ("leftThumbProximal", Some((0, 2))),
            ("rightMiddleDistal", Some((2, 3))),
            ("rthumb", Some((0, 1))),
            ("l_carpal_proximal_interphalangeal_2", Some((1, 2))),
            ("r_carpal_interphalangeal_1", Some((0, 3))),
            ("l_metatarsophalangeal_2", None),
            ("LFingers", None),
            ("Spine1", None),
        ];
        for (name, expected) in cases {
            assert_eq!(JointName::parse(name).finger(), expected, "{name}");
        }
    }
}
