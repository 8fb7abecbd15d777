//! BVH motion files: the hierarchy with its channels, the frames, and where they put the joints.
//!
//! Source: the format as Biovision's files and its many writers use it. A joint's rotation is the product of its
//! rotation channels in file order. The root's position channels are its place. Files disagree about position
//! channels of other joints, which most lack: some repeat the offset there, some add to it; which one is found from
//! the values ([`Bvh::positions_add`]). They disagree about units and the up axis too: values stay as written.

use std::path::Path;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use crate::AnimationError;

pub use crate::bvh_read::parse;

/// One channel of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channel {
    /// Place along an axis (0 = x, 1 = y, 2 = z), file units.
    Position(usize),
    /// Turn about an axis (0 = x, 1 = y, 2 = z), degrees.
    Rotation(usize),
}

/// One joint of the hierarchy.
#[derive(Debug, Clone, PartialEq)]
pub struct BvhJoint {
    /// Name as in the file.
    pub name: String,
    /// Index of the parent, always lower than the joint's own; `None` for the root.
    pub parent: Option<usize>,
    /// Place in the parent's frame at zero rotations, file units.
    pub offset: Vector3<f64>,
    /// Channels in file order.
    pub channels: Vec<Channel>,
    /// Offset of its End Site, where it has one.
    pub end_site: Option<Vector3<f64>>,
}

/// A motion as a BVH file holds it.
#[derive(Debug, Clone, PartialEq)]
pub struct Bvh {
    /// Joints, parents before children.
    pub joints: Vec<BvhJoint>,
    /// Seconds a frame; positive.
    pub frame_time: f64,
    /// Channel values of every frame, all joints' channels one after the other.
    pub frames: Vec<Vec<f64>>,
    /// True where position channels of joints other than the root add to their offset; false where they replace it.
    pub positions_add: bool,
}

impl Bvh {
    /// How many values a frame has.
    pub fn channel_count(&self) -> usize {
        self.joints.iter().map(|j| j.channels.len()).sum()
    }

    /// `file_from_joint` of every joint in frame `frame`.
    ///
    /// # Panics
    /// Where `frame` is not below `frames.len()`.
    pub fn joint_frames(&self, frame: usize) -> Vec<Isometry3<f64>> {
        self.place_joints(&self.frames[frame])
    }

    /// `file_from_joint` of every joint at zero rotations, the root at its offset.
    pub fn rest_frames(&self) -> Vec<Isometry3<f64>> {
        let mut world: Vec<Isometry3<f64>> = Vec::with_capacity(self.joints.len());
        for joint in &self.joints {
            let local = Isometry3::from(Translation3::from(joint.offset));
            world.push(joint.parent.map_or(local, |p| world[p] * local));
        }
        world
    }

    fn place_joints(&self, values: &[f64]) -> Vec<Isometry3<f64>> {
        let mut world: Vec<Isometry3<f64>> = Vec::with_capacity(self.joints.len());
        let mut first = 0;
        for joint in &self.joints {
            let next = first + joint.channels.len();
            let adds = self.positions_add && joint.parent.is_some();
            let local = joint.local(&values[first..next], adds);
            first = next;
            world.push(joint.parent.map_or(local, |p| world[p] * local));
        }
        world
    }
}

impl BvhJoint {
    /// `parent_from_joint` for this joint's channel `values`.
    fn local(&self, values: &[f64], positions_add: bool) -> Isometry3<f64> {
        let mut rotation = UnitQuaternion::identity();
        let mut position = self.offset;
        for (channel, &value) in self.channels.iter().zip(values) {
            match *channel {
                Channel::Position(axis) if positions_add => position[axis] += value,
                Channel::Position(axis) => position[axis] = value,
                Channel::Rotation(axis) => {
                    let axis = Vector3::ith_axis(axis);
                    rotation *= UnitQuaternion::from_axis_angle(&axis, value.to_radians());
                }
            }
        }
        Isometry3::from_parts(Translation3::from(position), rotation)
    }

    /// Position of its End Site when the joint stands at `file_from_joint`.
    pub fn end_position(&self, file_from_joint: &Isometry3<f64>) -> Option<Point3<f64>> {
        self.end_site.map(|offset| file_from_joint * Point3::from(offset))
    }
}

/// Reads a BVH file.
///
/// # Errors
/// [`AnimationError::Io`] where it cannot be read, [`AnimationError::Bvh`] with the line where it is wrong.
pub fn read(path: &Path) -> Result<Bvh, AnimationError> {
    let bytes = std::fs::read(path).map_err(|source| AnimationError::Io { path: path.to_path_buf(), source })?;
    parse(&String::from_utf8_lossy(&bytes), &path.display().to_string())
}

/// The text of a BVH file; offsets and channels with six decimals.
pub fn write(bvh: &Bvh) -> String {
    let mut out = String::from("HIERARCHY\n");
    write_joint(bvh, 0, 0, &mut out);
    out.push_str(&format!("MOTION\nFrames: {}\nFrame Time: {}\n", bvh.frames.len(), bvh.frame_time));
    for frame in &bvh.frames {
        let row: Vec<String> = frame.iter().map(|v| number(*v)).collect();
        out.push_str(&row.join(" "));
        out.push('\n');
    }
    out
}

fn write_joint(bvh: &Bvh, index: usize, depth: usize, out: &mut String) {
    let Some(joint) = bvh.joints.get(index) else { return };
    let (outer, inner) = ("  ".repeat(depth), "  ".repeat(depth + 1));
    let kind = if joint.parent.is_none() { "ROOT" } else { "JOINT" };
    out.push_str(&format!("{outer}{kind} {}\n{outer}{{\n{inner}OFFSET {}\n", joint.name, triple(&joint.offset)));
    let channels: Vec<&str> = joint.channels.iter().map(|c| channel_name(*c)).collect();
    out.push_str(&format!("{inner}CHANNELS {} {}\n", channels.len(), channels.join(" ")));
    for (child, _) in bvh.joints.iter().enumerate().filter(|(_, j)| j.parent == Some(index)) {
        write_joint(bvh, child, depth + 1, out);
    }
    if let Some(end) = &joint.end_site {
        out.push_str(&format!("{inner}End Site\n{inner}{{\n{inner}  OFFSET {}\n{inner}}}\n", triple(end)));
    }
    out.push_str(&format!("{outer}}}\n"));
}

fn channel_name(channel: Channel) -> &'static str {
    match channel {
        Channel::Position(0) => "Xposition",
        Channel::Position(1) => "Yposition",
        Channel::Position(_) => "Zposition",
        Channel::Rotation(0) => "Xrotation",
        Channel::Rotation(1) => "Yrotation",
        Channel::Rotation(_) => "Zrotation",
    }
}

fn triple(v: &Vector3<f64>) -> String {
    format!("{} {} {}", number(v.x), number(v.y), number(v.z))
}

/// Six decimals without trailing zeros and without a negative zero.
fn number(value: f64) -> String {
    let text = format!("{value:.6}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SMALL: &str = "HIERARCHY\nROOT Hips\n{\n OFFSET 0 90 0\n CHANNELS 6 Xposition Yposition Zposition Zrotation \
        Xrotation Yrotation\n JOINT Upper Leg {\n  OFFSET 10 -5 0\n  CHANNELS 3 Yrotation Zrotation Xrotation\n  End \
        Site\n  {\n   OFFSET 0 -40 0\n  }\n }\n}\nMOTION\nFrames:\t2\nFrame Time: .0333\n0 90 0 0 0 0 0 0 0\r\n1 2 3 90 \
        0 0 0 90 0\n";

    #[test]
    fn joints_stand_where_the_channels_put_them() {
        let bvh = parse(SMALL, "small").unwrap();
        assert_eq!(bvh.joints[1].name, "Upper Leg");
        assert_eq!(bvh.channel_count(), 9);
        let rest = bvh.joint_frames(0);
        assert_eq!(rest[1].translation.vector, Vector3::new(10.0, 85.0, 0.0));
        let turned = bvh.joint_frames(1);
        // a quarter turn about z takes (10, -5) to (5, 10)
        assert!((turned[1].translation.vector - Vector3::new(6.0, 12.0, 3.0)).norm() < 1e-12);
        let end = bvh.joints[1].end_position(&turned[1]).unwrap();
        assert!((end - Point3::new(6.0, 52.0, 3.0)).norm() < 1e-12, "{end}");
    }

    #[test]
    fn channels_multiply_in_file_order() {
        let bvh = parse(SMALL.replace("90 \r\n", "").as_str(), "small").unwrap();
        let mut values = bvh.frames[0].clone();
        values[3..6].copy_from_slice(&[30.0, 40.0, 50.0]);
        let turned = bvh.place_joints(&values)[0].rotation;
        let axis = |i, a: f64| UnitQuaternion::from_axis_angle(&Vector3::ith_axis(i), a.to_radians());
        let expected = axis(2, 30.0) * axis(0, 40.0) * axis(1, 50.0);
        assert!(turned.angle_to(&expected) < 1e-12);
    }

    #[test]
    fn positions_of_inner_joints_replace_or_add_as_the_values_tell() {
        let file = |position: &str| {
            let text = format!(
                "HIERARCHY\nROOT a\n{{\nOFFSET 0 0 0\nCHANNELS 3 Xposition Yposition Zposition\nJOINT b\n{{\nOFFSET 0 5 \
                 0\nCHANNELS 3 Xposition Yposition Zposition\n}}\n}}\nMOTION\nFrames: 1\nFrame Time: 1\n1 2 3 {position}\n"
            );
            parse(&text, "x").unwrap().joint_frames(0)[1].translation.vector
        };
        assert_eq!(file("0 5.1 0"), Vector3::new(1.0, 7.1, 3.0));
        assert_eq!(file("0 0.1 0"), Vector3::new(1.0, 7.1, 3.0));
    }

    #[test]
    fn what_is_written_is_read_back() {
        let bvh = parse(SMALL, "small").unwrap();
        assert_eq!(parse(&write(&bvh), "again").unwrap(), bvh);
    }
}
