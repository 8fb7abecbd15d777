//! PLY: what is written is read back, and no input is trusted.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use super::*;

fn sample() -> Mesh {
    Mesh {
        positions: vec![Point3::new(0.0, 0.5, -1.0), Point3::new(1.0, 0.0, 0.0), Point3::new(0.0, 1.0, 2.0)],
        triangles: vec![[0, 1, 2], [2, 1, 0]],
        normals: vec![Vector3::z(); 3],
        colors: vec![[1, 2, 3], [4, 5, 6], [250, 251, 252]],
        attributes: BTreeMap::from([("filled".to_string(), vec![0.0, 1.0, 0.5])]),
    }
}

#[test]
fn what_is_written_is_read_back() {
    assert_eq!(decode(&encode(&sample())).unwrap(), sample());
}

#[test]
fn ascii_quads_become_two_triangles() {
    let text = "ply\nformat ascii 1.0\ncomment by hand\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\n\
        element face 1\nproperty list uchar int vertex_index\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";
    assert_eq!(decode(text.as_bytes()).unwrap().triangles, vec![[0, 1, 2], [0, 2, 3]]);
}

#[test]
fn every_torn_file_is_an_error_and_none_panics() {
    let bytes = encode(&sample());
    for end in 0..bytes.len() {
        assert!(decode(&bytes[..end]).is_err(), "{end} of {} bytes were taken for a whole file", bytes.len());
    }
}

#[test]
fn an_index_beyond_the_vertices_is_refused() {
    let mut mesh = sample();
    mesh.triangles[1][2] = 3;
    assert!(decode(&encode(&mesh)).unwrap_err().contains("triangle 1"));
}

fn ascii(elements: &str, body: &str) -> Result<Mesh, String> {
    decode(format!("ply\nformat ascii 1.0\n{elements}\nend_header\n{body}").as_bytes())
}

const POINT: &str = "property float x\nproperty float y\nproperty float z";

#[test]
fn colours_may_be_bytes_words_or_floats() {
    let read = |kind: &str, body: &str| {
        let color = ["red", "green", "blue"].map(|c| format!("property {kind} {c}")).join("\n");
        ascii(&format!("element vertex 1\n{POINT}\n{color}"), body).unwrap().colors[0]
    };
    assert_eq!(read("uchar", "0 0 0 255 51 0"), [255, 51, 0]);
    assert_eq!(read("uchar", "0 0 0 1 1 0"), [1, 1, 0]);
    assert_eq!(read("ushort", "0 0 0 65535 13107 0"), [255, 51, 0]);
    assert_eq!(read("float", "0 0 0 1.0 0.2 0"), [255, 51, 0]);
    assert_eq!(read("double", "0 0 0 255 51 0"), [255, 51, 0]);
}

#[test]
fn words_with_a_sign_are_not_those_without() {
    let read = |kind: &str, bytes: [u8; 2]| {
        let properties = ["x", "y", "z"].map(|n| format!("property {kind} {n}")).join("\n");
        let header = format!("ply\nformat binary_little_endian 1.0\nelement vertex 1\n{properties}\nend_header\n");
        decode(&[header.as_bytes(), &bytes.repeat(3)].concat()).unwrap().positions[0].x
    };
    assert_eq!((read("short", [0xfe, 0xff]), read("int16", [0xfe, 0xff])), (-2.0, -2.0));
    assert_eq!((read("ushort", [0xfe, 0xff]), read("uint16", [0xfe, 0xff])), (65534.0, 65534.0));
}

#[test]
fn numbers_that_cannot_be_counts_or_indices_are_refused() {
    let elements = format!("element vertex 3\n{POINT}\nelement face 1\nproperty list int double vertex_indices");
    let face = |face: &str| ascii(&elements, &format!("0 0 0 1 0 0 0 1 0 {face}"));
    assert_eq!(face("3 0 1 2").unwrap().triangles, [[0, 1, 2]]);
    for wrong in
        ["3 0 1 nan", "3 0 1 -1", "3 0 1 1.5", "3 0 1 1e300", "-3 0 1 2", "nan 0 1 2", "inf 0 1 2", "1e18 0 1 2"]
    {
        assert!(face(wrong).is_err(), "{wrong}");
    }
    assert!(ascii(&format!("element vertex 1\n{POINT}"), "0 0 inf").unwrap_err().contains("vertex 0"));
}

#[test]
fn a_header_can_neither_keep_the_reader_busy_nor_fill_memory() {
    let busy = "element vertex 0\n".to_string() + POINT + &"\nelement nothing 200000000".repeat(1000);
    assert!(ascii(&busy, "").unwrap_err().contains("nothing"));
    let wide = "element vertex 0".to_string() + &"\nproperty float x".repeat(5000);
    assert!(ascii(&wide, "").unwrap_err().contains("1000"));
    assert!(ascii("element vertex 99999999999999999999", "").is_err());
}
