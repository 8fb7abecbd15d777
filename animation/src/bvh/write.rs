//! BVH text.

use nalgebra::Vector3;

use super::model::{Bvh, Channel};

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
