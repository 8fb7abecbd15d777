//! BVH: where joints stand, what is written is read back, and no input is trusted.

use nalgebra::{Point3, UnitQuaternion, Vector3};

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
    let mut bvh = parse(SMALL, "small").unwrap();
    let mut values = bvh.frames[0].clone();
    values[3..6].copy_from_slice(&[30.0, 40.0, 50.0]);
    bvh.frames = vec![values];
    let turned = bvh.joint_frames(0)[0].rotation;
    let axis = |i, a: f64| UnitQuaternion::from_axis_angle(&Vector3::ith_axis(i), a.to_radians());
    let expected = axis(2, 30.0) * axis(0, 40.0) * axis(1, 50.0);
    assert!(turned.angle_to(&expected) < 1e-12);
}

#[test]
fn positions_of_inner_joints_replace_or_add_as_the_values_show() {
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
    assert!(complaint("4 5 6", "4 5").contains("line 11: the row has 2 of the 3"));
    assert!(complaint("4 5 6", "4 nan 6").contains("line 11: `nan`"));
    assert!(complaint("4 5 6", "4 5 6 7").contains("line 11: the row has more than the 3"));
    assert!(complaint("Frames: 2", "Frames: 4").contains("it is torn"));
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

#[test]
fn a_row_more_or_less_than_announced_is_read_with_a_warning() {
    for (announced, rows) in [(1, 2), (2, 2), (3, 2)] {
        let bvh = parse(&GOOD.replace("Frames: 2", &format!("Frames: {announced}")), "x").unwrap();
        assert_eq!(bvh.frames.len(), rows);
        assert_eq!(bvh.warnings.is_empty(), announced == rows, "{:?}", bvh.warnings);
    }
    assert!(parse(&GOOD.replace("1 2 3\n4 5 6\n", "").replace("Frames: 2", "Frames: 1"), "x").is_err());
}

#[test]
fn absurd_numbers_are_refused_with_their_line() {
    for time in ["1e308", "1e-308", "-1", "nan", "inf", "1e999", "4000"] {
        let message = complaint("0.1", time);
        assert!(message.contains("x.bvh, line 9"), "{time}: {message}");
    }
    for count in ["1e308", "1.5", "-2", "nan", "99999999999999999999"] {
        assert!(complaint("Frames: 2", &format!("Frames: {count}")).contains("line 8"), "{count}");
    }
    for value in ["1e300", "-1e12", "inf"] {
        assert!(complaint("4 5 6", &format!("4 {value} 6")).contains("line 11"), "{value}");
        assert!(complaint("OFFSET 0 0 0", &format!("OFFSET 0 {value} 0")).contains("line 4"), "{value}");
    }
}

#[test]
fn deep_wide_and_long_files_are_refused_before_they_fill_memory() {
    let deep = "HIERARCHY\nROOT a\n{\n".to_string() + &"JOINT b\n{\n".repeat(5000);
    assert!(parse(&deep, "x").unwrap_err().to_string().contains("joints"));
    assert!(complaint("ROOT a", &format!("ROOT {}", "a".repeat(100_000))).len() < 200);
    assert!(complaint("4 5 6", &"7".repeat(100_000)).len() < 200);
    let long = GOOD.replace("CHANNELS 3 Xrotation Yrotation Zrotation", "CHANNELS 1 Xrotation");
    let long = long.replace("1 2 3\n4 5 6\n", &"0\n".repeat((1 << 20) + 1));
    assert!(parse(&long, "x").unwrap_err().to_string().contains("too long"));
}

#[test]
fn byte_order_marks_and_windows_lines_are_read() {
    let windows = format!("\u{feff}{}", GOOD.replace('\n', "\r\n"));
    assert_eq!(parse(&windows, "x").unwrap(), parse(GOOD, "x").unwrap());
}
