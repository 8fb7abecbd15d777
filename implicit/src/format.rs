//! Bodies of primitives as text: TOML that people read and edit.
//!
//! ```toml
//! format = 1
//! name = "anna"
//! field = "wyvill"             # or "nishimura"
//! beta = [0.84, -0.93]         # of the body model: head, hands and feet
//! scale = 1.0                  # of their size; 1 where it is left out
//!
//! [joints]                     # at rest in the A-pose, metres; fingers follow their hand
//! hips = [0.0, 0.951, 0.008]
//!
//! [[primitive]]
//! name = "left biceps"         # may be left out
//! joint = "leftUpperArm"
//! center = [60.0, -70.0, 20.0] # from the joint, millimetres, along the axes of the rest pose
//! axes = [22.0, 60.0, 24.0]    # half axes, millimetres
//! turn = [0.0, 0.0, 45.0]      # about x, then y, then z, degrees
//! weight = 1.0                 # 1 where it is left out
//! kind = "metaball"            # or "ellipsoid", which does not blend
//! groups = ["left_upper_arm"]  # that of its joint where they are left out; ["root"] blends with all
//!
//! [primitive.muscle]           # center and turn of min and max are those at rest where they are left out
//! reference = "leftLowerArm"
//! axis = [0.0, 1.0, 0.0]
//! limits = [-10.0, 0.0, 145.0] # lowest angle, relaxed, highest; degrees
//! min = { center = [60.0, -70.0, 20.0], axes = [20.0, 64.0, 22.0], turn = [0.0, 0.0, 45.0] }
//! max = { center = [60.0, -66.0, 26.0], axes = [28.0, 48.0, 32.0], turn = [0.0, 0.0, 45.0] }
//! blending = "linear"          # or "parabolic", "hyperbolic"
//! ```

mod read;
mod write;

pub use self::{
    read::{read, read_primitive},
    write::write,
};

/// The version of the format.
const FORMAT: u32 = 1;

#[cfg(test)]
mod tests {
    use toile_character::BodyModel;

    use super::{read, write};

    const TEXT: &str = r#"format = 1
name = "an \"na\""
field = "nishimura"
beta = [0.5, -1.0]

[joints]
hips = [0.0, 0.95, 0.01]

[[primitive]]
joint = "hips"
center = [1.0, 2.0, 3.0]
axes = [100.0, 90.0, 80.5]
turn = [0.0, 10.0, 0.0]
groups = ["root"]

[[primitive]]
name = "left biceps"
joint = "leftUpperArm"
center = [60.0, -70.0, 20.0]
axes = [22.0, 60.0, 24.0]
turn = [0.0, 0.0, 45.0]
weight = 0.5
groups = ["left_upper_arm", "left_shoulder"]
[primitive.muscle]
reference = "leftLowerArm"
axis = [0.0, 1.0, 0.0]
limits = [-10.0, 0.0, 145.0]
min = { center = [60.0, -70.0, 20.0], axes = [20.0, 64.0, 22.0], turn = [0.0, 0.0, 45.0] }
max = { center = [60.0, -66.0, 26.0], axes = [28.0, 48.0, 32.0], turn = [0.0, 0.0, 45.0] }
blending = "parabolic"
"#;

    #[test]
    fn a_body_is_written_and_read_back_to_a_tenth_of_a_millimetre() {
        let model = BodyModel::load_default().unwrap();
        let body = read(TEXT, &model).unwrap();
        assert_eq!((body.name.as_str(), body.primitives.len()), ("an \"na\"", 2));
        assert!((body.primitives[0].state.axes.z - 0.0805).abs() < 1e-12);
        let again = read(&write(&body), &model).unwrap();
        assert_eq!(write(&again), write(&body));
        for (a, b) in body.primitives.iter().zip(&again.primitives) {
            assert_eq!((a.joint, a.kind, a.groups, &a.name), (b.joint, b.kind, b.groups, &b.name));
            assert!((a.state.center - b.state.center).norm() < 1e-4 && (a.state.turn - b.state.turn).norm() < 2e-3);
            assert_eq!(a.deform.map(|d| d.blending), b.deform.map(|d| d.blending));
        }
        // fingers keep their place beside the hand, wherever the hips are
        let moved = read(&TEXT.replace("0.0, 0.95, 0.01", "0.1, 0.95, 0.01"), &model).unwrap();
        let finger = toile_character::Joint::LeftIndexDistal;
        assert!((moved.skeleton.position(finger).x - body.skeleton.position(finger).x - 0.1).abs() < 1e-9);
    }

    #[test]
    fn every_mistake_is_named_with_its_line() {
        let model = BodyModel::load_default().unwrap();
        for (from, to, line, says) in [
            ("axes = [100.0, 90.0, 80.5]", "axes = [100.0, 0.0, 80.5]", 12, "above 0"),
            ("axes = [20.0, 64.0, 22.0]", "axes = [20.0, -1.0, 22.0]", 27, "above 0"),
            ("joint = \"leftUpperArm\"", "joint = \"leftWing\"", 18, "`leftWing` is no joint"),
            ("\"left_shoulder\"", "\"left_wing\"", 23, "`left_wing` is no group"),
            ("limits = [-10.0, 0.0, 145.0]", "limits = [145.0, 0.0, -10.0]", 27, "must ascend"),
            ("axis = [0.0, 1.0, 0.0]", "axis = [0.0, 0.0, 0.0]", 26, "direction"),
            ("beta = [0.5, -1.0]", "beta = [0.5, -1.0]\nscale = 0.0", 5, "between 0.1"),
            ("weight = 0.5", "weight = 0.0", 22, "other than 0"),
            ("weight = 0.5", "wait = 0.5", 22, "unknown field"),
            ("format = 1", "format = 7", 1, "format 7"),
            ("field = \"nishimura\"", "field = \"blinn\"", 3, "wyvill or nishimura"),
            ("\"parabolic\"", "\"cubic\"", 30, "hyperbolic"),
            ("hips = [0.0, 0.95, 0.01]", "hip = [0.0, 0.95, 0.01]", 7, "`hip` is no joint"),
            ("groups = [\"root\"]", "groups = []", 14, "empty"),
        ] {
            let text = TEXT.replace(from, to);
            assert_ne!(text, TEXT, "{from}");
            let error = read(&text, &model).unwrap_err().to_string();
            let number: usize = error.trim_start_matches("line ").split(':').next().unwrap().parse().unwrap();
            assert!(error.contains(says) && number.abs_diff(line) <= 1, "{error} (expected line {line})");
        }
        let bare = read(&TEXT.replace("groups = [\"root\"]", ""), &model).unwrap_err().to_string();
        assert!(bare.contains("no primitive in the group"), "{bare}");
    }
}
