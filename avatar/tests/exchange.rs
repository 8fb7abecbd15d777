//! OBJ and USD files read back: by our own reader, and by OpenUSD's library.
#![allow(clippy::unwrap_used)] // helpers of tests are not seen as tests

mod common;

use std::{path::Path, process::Command};

use common::{dressed, textured};
use serde_json::Value;
use toile_avatar::{Avatar, picture_name, write_mtl, write_obj, write_usda};
use toile_character::{JOINT_COUNT, JointNaming};
use toile_geometry::obj;

#[test]
fn an_obj_file_has_every_layer_as_it_is() {
    let avatar = dressed();
    let text = write_obj(&avatar, "tester.mtl").unwrap();
    let read = obj::decode(text.as_bytes()).unwrap();
    let mut first = 0;
    for layer in &avatar.layers {
        let mesh = &layer.mesh;
        let end = first + mesh.positions.len();
        assert_eq!(read.positions[first..end], mesh.positions, "not one digit is lost");
        assert_eq!(read.colors[first..end], mesh.colors);
        first = end;
    }
    let mut triangles = read.triangles.iter();
    let mut first = 0;
    for mesh in avatar.layers.iter().map(|l| &l.mesh) {
        assert!(mesh.triangles.iter().all(|t| triangles.next() == Some(&t.map(|v| v + first))));
        first += mesh.positions.len() as u32;
    }
    assert_eq!(triangles.next(), None);
    let words = |key: &str| text.lines().filter_map(|l| l.strip_prefix(key)).map(String::from).collect::<Vec<_>>();
    assert_eq!(words("o "), ["body", "01-trousers", "02-top"]);
    assert_eq!(words("usemtl "), words("o "));
    assert_eq!(words("mtllib "), ["tester.mtl"]);
    let normals = words("vn ");
    assert_eq!(normals.len(), read.positions.len());
    let length = |n: &String| n.split(' ').map(|x| x.parse::<f64>().unwrap().powi(2)).sum::<f64>().sqrt();
    assert!(normals.iter().all(|n| (length(n) - 1.0).abs() < 1e-5));
    let materials = write_mtl(&avatar);
    assert!(words("o ").iter().all(|name| materials.contains(&format!("newmtl {name}\n"))));
}

#[test]
fn a_texture_in_an_obj_file_needs_no_vertex_twice() {
    let avatar = textured();
    let text = write_obj(&avatar, "a.mtl").unwrap();
    let read = obj::decode(text.as_bytes()).unwrap();
    assert_eq!((read.positions.len(), read.colors.len()), (vertices(&avatar), 0));
    let places: usize = avatar.layers.iter().map(|l| l.texture.as_ref().unwrap().uv.len()).sum();
    let lines = |key: &str| text.lines().filter_map(|l| l.strip_prefix(key)).map(String::from).collect::<Vec<_>>();
    assert_eq!(lines("vt ").len(), places);
    assert!(places > vertices(&avatar), "there are seams");
    // The last face of all names the last layer's places, upwards.
    let (layer, face) = (&avatar.layers[2], lines("f ").pop().unwrap());
    let texture = layer.texture.as_ref().unwrap();
    let corner = face.split(' ').next_back().unwrap();
    let number: usize = corner.split('/').nth(1).unwrap().parse().unwrap();
    let [u, v] = texture.uv[texture.triangles[texture.triangles.len() - 1][2] as usize];
    assert_eq!(lines("vt ")[number - 1], format!("{u} {}", 1.0 - v));
    let materials = write_mtl(&avatar);
    assert!(
        materials.contains("map_Kd avatar-02-top-color.png\n") && materials.contains("norm avatar-02-top-normal.png\n")
    );
}

#[test]
fn names_with_spaces_stay_one_word() {
    let mut avatar = dressed();
    avatar.layers[1].name = "my trousers\nv 1 2 3".into();
    let text = write_obj(&avatar, "a.mtl").unwrap();
    assert!(text.contains("\no my_trousers_v_1_2_3\n") && write_mtl(&avatar).contains("newmtl my_trousers_v_1_2_3\n"));
    assert_eq!(obj::decode(text.as_bytes()).unwrap().positions.len(), vertices(&avatar));
}

fn vertices(avatar: &Avatar) -> usize {
    avatar.layers.iter().map(|l| l.mesh.positions.len()).sum()
}

#[test]
fn a_usd_file_is_the_same_each_time_and_an_avatar_without_motion_has_none() {
    let mut avatar = dressed();
    let text = write_usda(&avatar).unwrap();
    assert_eq!(text, write_usda(&avatar).unwrap());
    assert!(text.starts_with("#usda 1.0\n"));
    let count = |text: &str, what: &str| text.matches(what).count();
    assert_eq!([count(&text, "def Mesh"), count(&text, "def SkelAnimation"), count(&text, "def Skeleton")], [3, 1, 1]);
    let longest = avatar.motions[0].poses.len() - 1;
    assert!(text.contains(&format!("endTimeCode = {longest}\n    timeCodesPerSecond = 10\n")), "0.1 s a frame");
    avatar.motions.clear();
    let still = write_usda(&avatar).unwrap();
    assert!(!still.contains("timeSamples") && !still.contains("animationSource") && !still.contains("TimeCode"));
    avatar.layers.clear();
    assert!(write_usda(&avatar).is_err());
}

/// The file as OpenUSD understands it at pose `frame`, every 7th point; `None` where its library is not installed.
fn understood(avatar: &Avatar, frame: usize) -> Option<Value> {
    let top = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let library = toile_outside::file(&top.join("target/outside/usd/pxr"))?;
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("avatar.usda");
    std::fs::write(&file, write_usda(avatar).unwrap()).unwrap();
    for (layer, texture) in avatar.layers.iter().filter_map(|l| Some((&l.name, l.texture.as_ref()?))) {
        let pictures = [("color", Some(&texture.base_color)), ("normal", texture.normal.as_ref())];
        for (kind, picture) in pictures.iter().filter_map(|(kind, picture)| Some((kind, (*picture)?))) {
            std::fs::write(dir.path().join(picture_name(layer, kind, picture)), picture.bytes()).unwrap();
        }
    }
    let done = Command::new("python3")
        .arg(top.join("tests/usd/check.py"))
        .arg(&file)
        .args([&frame.to_string(), "7"])
        .env("PYTHONPATH", library.parent().unwrap())
        .output()
        .unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    Some(serde_json::from_slice(&done.stdout).unwrap())
}

#[test]
fn usd_itself_finds_the_textures() {
    let avatar = textured();
    let text = write_usda(&avatar).unwrap();
    assert_eq!((text.matches("UsdPreviewSurface").count(), text.matches("primvars:displayColor").count()), (3, 0));
    let Some(found) = understood(&avatar, 5) else { return };
    assert_eq!(found["issues"], Value::Array(Vec::new()), "USD's validators");
}

#[test]
fn usd_itself_skins_every_layer_as_we_do() {
    let mut avatar = dressed();
    avatar.joint_names = JointNaming::Mixamo; // with colons, which names in USD cannot have
    let Some(found) = understood(&avatar, 5) else { return };
    assert_eq!(found["issues"], Value::Array(Vec::new()), "USD's validators");
    assert_eq!((&found["metres_per_unit"], &found["up"]), (&1.0.into(), &"Y".into()));
    assert_eq!((&found["rate"], &found["end"]), (&10.0.into(), &8.0.into()));
    let joints = found["joints"].as_array().unwrap();
    assert_eq!(joints.len(), JOINT_COUNT);
    assert_eq!(joints[1], "mixamorig_Hips/mixamorig_Spine");
    let posed = avatar.in_pose(&avatar.motions[0].poses[5]).unwrap();
    for (layer, rest) in posed.layers.iter().zip(&avatar.layers) {
        let mesh = &found["meshes"][&layer.name];
        assert_eq!(mesh["skinned"], true);
        let counts = ["vertices", "normals", "triangles"].map(|key| mesh[key].as_u64().unwrap() as usize);
        assert_eq!(counts, [rest.mesh.positions.len(), rest.mesh.positions.len(), rest.mesh.triangles.len()]);
        let number = |v: &Value, i: usize| v[i].as_f64().unwrap() as f32;
        for (point, wanted) in mesh["points"].as_array().unwrap().iter().zip(layer.mesh.positions.iter().step_by(7)) {
            let point = nalgebra::Point3::new(number(point, 0), number(point, 1), number(point, 2));
            // weights are whole 65536ths in the file, arms some 0.6 m from the joints
            assert!((point - wanted).norm() < 5e-5, "{}: {point} instead of {wanted}", layer.name);
        }
        let blue = f64::from(rest.mesh.colors[0][2]) / 255.0;
        let linear = ((blue + 0.055) / 1.055).powf(2.4);
        assert!((f64::from(number(&mesh["color"], 2)) - linear).abs() < 1e-4, "display colours are linear");
    }
}
