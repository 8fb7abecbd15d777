//! Files made here byte by byte, from the specification.

use super::*;

/// A GLB file of this JSON and these bytes.
fn glb(json: &str, binary: &[u8]) -> Vec<u8> {
    let pad = |bytes: &[u8], with: u8| {
        let mut bytes = bytes.to_vec();
        bytes.resize(bytes.len().next_multiple_of(4), with);
        bytes
    };
    let (json, binary) = (pad(json.as_bytes(), b' '), pad(binary, 0));
    let mut file = b"glTF\x02\0\0\0".to_vec();
    file.extend((28 + json.len() as u32 + binary.len() as u32).to_le_bytes());
    for (chunk, kind) in [(&json, b"JSON"), (&binary, b"BIN\0")] {
        file.extend((chunk.len() as u32).to_le_bytes());
        file.extend(kind);
        file.extend(chunk);
    }
    file
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|x| x.to_le_bytes()).collect()
}

const TRIANGLE: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];

const PLAIN: &str = r#"{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
    "nodes": [{"children": [1], "scale": [2, 2, 2]}, {"mesh": 0, "translation": [0, 5, 0]}, {"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "COLOR_0": 1}}]}],
    "buffers": [{"byteLength": 48}],
    "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 12, "byteStride": 4}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
                  {"bufferView": 1, "componentType": 5121, "normalized": true, "count": 3, "type": "VEC4"}]}"#;

fn plain_bytes() -> Vec<u8> {
    let mut bytes = floats(&TRIANGLE);
    bytes.extend([255, 0, 55, 255, 0, 0, 0, 255, 0, 0, 0, 255]);
    bytes
}

#[test]
fn nodes_place_meshes_and_colours_are_linear() {
    let surface = decode_glb(&glb(PLAIN, &plain_bytes())).unwrap();
    let at: Vec<[f32; 3]> = surface.positions.iter().map(|p| [p.x, p.y, p.z]).collect();
    assert_eq!(
        at,
        [[0.0, 10.0, 0.0], [2.0, 10.0, 0.0], [0.0, 12.0, 0.0]],
        "only the scene's nodes, each with those above"
    );
    assert_eq!(surface.colors[0], [255, 0, 128], "55/255 linear is 128 in sRGB");
    assert!(surface.validate().is_ok());
}

#[test]
fn strips_turn_every_second_triangle_and_fans_share_a_corner() {
    assert_eq!(primitives_of(5), [[0, 1, 2], [2, 1, 3]]);
    assert_eq!(primitives_of(6), [[0, 1, 2], [0, 2, 3]]);
}

fn primitives_of(mode: u32) -> Vec<[u32; 3]> {
    let json = format!(
        r#"{{"nodes": [{{"mesh": 0}}], "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "mode": {mode}}}]}}],
        "buffers": [{{"byteLength": 48}}], "bufferViews": [{{"buffer": 0, "byteLength": 48}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}}]}}"#
    );
    decode_glb(&glb(&json, &floats(&[0.0; 12]))).unwrap().triangles
}

#[test]
fn a_skinned_mesh_stands_in_the_pose_of_its_joints() {
    let identity = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
    let mut down = identity;
    down[13] = -1.0;
    let mut bytes = floats(&TRIANGLE);
    bytes.extend(floats(&[1.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0]));
    bytes.extend(floats(&[identity, down].concat()));
    bytes.extend([0, 1, 0, 0].repeat(3));
    let json = r#"{"nodes": [{"mesh": 0, "skin": 0, "translation": [50, 0, 0]}, {"translation": [0, 0, 3]}, {"translation": [0, 4, 0]}],
        "skins": [{"joints": [1, 2], "inverseBindMatrices": 2}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "WEIGHTS_0": 1, "JOINTS_0": 3}}]}],
        "buffers": [{"byteLength": 224}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 48},
                        {"buffer": 0, "byteOffset": 84, "byteLength": 128}, {"buffer": 0, "byteOffset": 212, "byteLength": 12}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
                      {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC4"},
                      {"bufferView": 2, "componentType": 5126, "count": 2, "type": "MAT4"},
                      {"bufferView": 3, "componentType": 5121, "count": 3, "type": "VEC4"}]}"#;
    let at: Vec<[f32; 3]> = decode_glb(&glb(json, &bytes)).unwrap().positions.iter().map(|p| [p.x, p.y, p.z]).collect();
    assert_eq!(at, [[0.0, 0.0, 3.0], [1.0, 1.5, 1.5], [0.0, 4.0, 0.0]], "the node's own place does not count");
}

#[test]
fn files_beside_and_data_in_the_text_are_read() {
    assert_eq!(accessors::data_uri("data:application/octet-stream;base64,TWFu").unwrap().unwrap(), b"Man");
    assert_eq!(accessors::data_uri("data:;base64,TQ==").unwrap().unwrap(), b"M");
    assert_eq!(
        (accessors::data_uri("body.bin"), accessors::unescape("my%20body%zz.bin")),
        (None, "my body%zz.bin".into())
    );
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("body.gltf");
    std::fs::write(dir.path().join("my body.bin"), plain_bytes()).unwrap();
    std::fs::write(&path, PLAIN.replace("{\"byteLength\"", "{\"uri\": \"my%20body.bin\", \"byteLength\"")).unwrap();
    assert_eq!(crate::read(&path).unwrap().triangles.len(), 1);
    assert_eq!(crate::others(&path).unwrap(), ["my body.bin"]);
}

#[test]
fn what_is_wrong_is_said() {
    let told = |json: &str| decode_glb(&glb(json, &plain_bytes())).unwrap_err();
    for (from, to, word) in [
        ("\"count\": 3", "\"count\": 4", "outside of its buffer"),
        ("\"count\": 3", "\"count\": 18446744073709551615", "outside of its buffer"),
        ("\"byteOffset\": 36", "\"byteOffset\": 18446744073709551600", "buffer view 1"),
        ("{\"byteLength\": 48}", "{\"byteLength\": 480}", "cut off"),
        ("\"children\": [1]", "\"children\": [0]", "contains itself"),
        ("\"children\": [1]", "\"children\": [7]", "missing"),
        ("\"VEC3\"", "\"VEC2\"", "accessor 0"),
        ("\"mesh\": 0", "\"mesh\": 3", "mesh 3 is missing"),
        ("{\"asset\"", "{\"extensionsRequired\": [\"KHR_draco_mesh_compression\"], \"asset\"", "without compression"),
        ("{\"asset\"", "[\"asset\"", "JSON"),
    ] {
        let reason = told(&PLAIN.replacen(from, to, 1));
        assert!(reason.contains(word), "{to}: {reason}");
    }
    let whole = glb(PLAIN, &plain_bytes());
    assert!(decode_glb(&whole[..whole.len() - 9]).unwrap_err().contains("cut off"));
    assert!(decode_glb(b"ply\n").unwrap_err().contains("not a GLB"));
}

proptest::proptest! {
    #[test]
    fn changed_bytes_never_make_it_panic(at in 0..1000_usize, to in proptest::prelude::any::<u8>()) {
        let mut bytes = glb(PLAIN, &plain_bytes());
        let at = at % bytes.len();
        bytes[at] = to;
        let _ = decode_glb(&bytes).map(|surface| surface.validate());
    }
}
