//! GLB files read back with another reader (the `gltf` crate).
#![allow(clippy::unwrap_used)] // helpers of tests are not seen as tests

mod common;

use common::dressed;
use nalgebra::{Isometry3, Matrix4, Point3, Quaternion, UnitQuaternion, Vector3};
use toile_avatar::{Avatar, VrmMeta, write_glb, write_vrm};
use toile_character::{JOINT_COUNT, Joint, JointNaming, Pose, joint::JOINTS, skinning};

type Imported = (gltf::Document, Vec<gltf::buffer::Data>);

fn import(bytes: &[u8]) -> Imported {
    let (document, buffers, _) = gltf::import_slice(bytes).unwrap();
    (document, buffers)
}

fn mesh_node<'a>(file: &'a Imported, name: &str) -> gltf::Node<'a> {
    file.0.nodes().find(|n| n.mesh().is_some() && n.name() == Some(name)).unwrap()
}

/// Global transforms of the joint nodes, with clip values in place of the rest at key `key` of `clip`.
fn globals(file: &Imported, clip: Option<(&str, usize)>) -> Vec<Matrix4<f64>> {
    let mut locals: Vec<(Vector3<f64>, UnitQuaternion<f64>)> = file
        .0
        .nodes()
        .take(JOINT_COUNT)
        .map(|n| {
            let (t, r, s) = n.transform().decomposed();
            assert_eq!(s, [1.0; 3]);
            (Vector3::from(t.map(f64::from)), unit(r))
        })
        .collect();
    if let Some((name, key)) = clip {
        let clip = file.0.animations().find(|a| a.name() == Some(name)).unwrap();
        for channel in clip.channels() {
            let node = channel.target().node().index();
            let reader = channel.reader(|b| Some(&file.1[b.index()]));
            let count = reader.read_inputs().unwrap().count();
            let key = key.min(count - 1);
            match reader.read_outputs().unwrap() {
                gltf::animation::util::ReadOutputs::Translations(mut t) => {
                    locals[node].0 = Vector3::from(t.nth(key).unwrap().map(f64::from));
                }
                gltf::animation::util::ReadOutputs::Rotations(r) => {
                    locals[node].1 = unit(r.into_f32().nth(key).unwrap());
                }
                _ => panic!("unexpected track"),
            }
        }
    }
    let mut out: Vec<Matrix4<f64>> = vec![Matrix4::identity(); JOINT_COUNT];
    for joint in JOINTS {
        let (t, r) = locals[joint.index()];
        let local = Isometry3::from_parts(t.into(), r).to_homogeneous();
        out[joint.index()] = joint.parent().map_or(local, |p| out[p.index()] * local);
    }
    out
}

fn unit(r: [f32; 4]) -> UnitQuaternion<f64> {
    let q = Quaternion::new(f64::from(r[3]), f64::from(r[0]), f64::from(r[1]), f64::from(r[2]));
    assert!((q.norm() - 1.0).abs() < 1e-6);
    UnitQuaternion::from_quaternion(q)
}

fn inverse_binds(file: &Imported) -> Vec<Matrix4<f64>> {
    let skin = file.0.skins().next().unwrap();
    let reader = skin.reader(|b| Some(&file.1[b.index()]));
    reader.read_inverse_bind_matrices().unwrap().map(|m| Matrix4::from_fn(|r, c| f64::from(m[c][r]))).collect()
}

/// Positions of a layer skinned as an importer does it.
fn skinned(file: &Imported, name: &str, globals: &[Matrix4<f64>]) -> Vec<Point3<f32>> {
    let binds = inverse_binds(file);
    let primitive = mesh_node(file, name).mesh().unwrap().primitives().next().unwrap();
    let reader = primitive.reader(|b| Some(&file.1[b.index()]));
    let joints = reader.read_joints(0).unwrap().into_u16();
    let weights = reader.read_weights(0).unwrap().into_f32();
    reader
        .read_positions()
        .unwrap()
        .zip(joints.zip(weights))
        .map(|(p, (j, w))| {
            let p = Point3::from(p.map(f64::from)).to_homogeneous();
            let sum: nalgebra::Vector4<f64> =
                (0..4).map(|k| globals[j[k] as usize] * binds[j[k] as usize] * p * f64::from(w[k])).sum();
            Point3::from(sum.xyz().cast::<f32>())
        })
        .collect()
}

fn worst(a: &[Point3<f32>], b: &[Point3<f32>]) -> f32 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f32::max)
}

#[test]
fn joints_are_called_as_asked_for_and_vrm_keeps_its_own() {
    let joints = |bytes: &[u8]| -> Vec<String> {
        let file = import(bytes);
        file.0.skins().next().unwrap().joints().map(|node| node.name().unwrap().to_string()).collect()
    };
    for naming in JointNaming::ALL {
        let avatar = Avatar { joint_names: naming, ..dressed() };
        let expected: Vec<String> = JOINTS.iter().map(|&joint| naming.name(joint)).collect();
        assert_eq!(joints(&write_glb(&avatar).unwrap()), expected);
        assert_eq!(
            joints(&write_vrm(&avatar, &VrmMeta::default(), None).unwrap())[Joint::LeftUpperArm.index()],
            "leftUpperArm"
        );
    }
}

#[test]
fn every_layer_is_a_mesh_node_of_its_name_on_one_skin() {
    let avatar = dressed();
    let file = import(&write_glb(&avatar).unwrap());
    let names: Vec<_> = file.0.nodes().filter(|n| n.mesh().is_some()).map(|n| n.name().unwrap().to_string()).collect();
    assert_eq!(names, ["body", "01-trousers", "02-top"]);
    let scene = file.0.default_scene().unwrap();
    assert_eq!(scene.nodes().count(), 4, "mesh nodes and the hips at the top");
    assert_eq!(file.0.skins().count(), 1);
    let skin = file.0.skins().next().unwrap();
    assert!(skin.joints().zip(JOINTS).all(|(node, joint)| node.name() == Some(joint.name())));
    assert_eq!(skin.joints().count(), JOINT_COUNT);
    assert_eq!(file.0.extensions_used().count(), 0);
    let extras = mesh_node(&file, "01-trousers").extras().as_ref().unwrap().get().to_string();
    assert_eq!(extras, r#"{"garment":"trousers","layer":1,"thickness_m":0.0015}"#);
    assert_eq!(file.0.animations().map(|a| a.name().unwrap().to_string()).collect::<Vec<_>>(), ["wave"]);
}

#[test]
fn free_parts_are_written_by_vertex_and_as_a_share() {
    let mut avatar = dressed();
    let mesh = &mut avatar.layers[1].mesh;
    let free: Vec<f32> = (0..mesh.positions.len()).map(|v| f32::from(u8::from(v % 4 == 0))).collect();
    mesh.attributes.insert("free".into(), free.clone());
    let glb = write_glb(&avatar).unwrap();
    let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    let json: serde_json::Value = serde_json::from_slice(&glb[20..20 + length]).unwrap();
    let accessor = |mesh: usize| json["meshes"][mesh]["primitives"][0]["attributes"]["_FREE"].as_u64();
    assert_eq!((accessor(0), accessor(2)), (None, None));
    let view = &json["bufferViews"][accessor(1).unwrap() as usize];
    let start = 20 + length + 8 + view["byteOffset"].as_u64().unwrap() as usize;
    let bytes = &glb[start..start + view["byteLength"].as_u64().unwrap() as usize];
    let read: Vec<f32> = bytes.chunks(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
    assert_eq!(read, free);
    let file = import(&glb);
    let extras = mesh_node(&file, "01-trousers").extras().as_ref().unwrap().get().to_string();
    assert!(extras.contains(r#""free_percent":25"#), "{extras}");
}

#[test]
fn what_was_written_is_read_back() {
    let avatar = dressed();
    let file = import(&write_glb(&avatar).unwrap());
    for layer in &avatar.layers {
        let primitive = mesh_node(&file, &layer.name).mesh().unwrap().primitives().next().unwrap();
        let reader = primitive.reader(|b| Some(&file.1[b.index()]));
        let positions: Vec<Point3<f32>> = reader.read_positions().unwrap().map(Point3::from).collect();
        assert_eq!(positions, layer.mesh.positions);
        let indices: Vec<u32> = reader.read_indices().unwrap().into_u32().collect();
        assert_eq!(indices, layer.mesh.triangles.as_flattened());
        for (linear, srgb) in reader.read_colors(0).unwrap().into_rgba_f32().zip(&layer.mesh.colors) {
            assert!(linear[..3].iter().zip(srgb).all(|(l, s)| srgb_of_linear(*l) == *s), "{linear:?} for {srgb:?}");
        }
        for (weights, normal) in reader.read_weights(0).unwrap().into_f32().zip(reader.read_normals().unwrap()) {
            assert_eq!(weights.iter().sum::<f32>(), 1.0);
            assert!((Vector3::from(normal).norm() - 1.0).abs() < 1e-5);
        }
    }
}

fn srgb_of_linear(linear: f32) -> u8 {
    let c = if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (c * 255.0).round() as u8
}

#[test]
fn the_bind_pose_is_the_pose_of_the_positions() {
    let avatar = dressed();
    let file = import(&write_glb(&avatar).unwrap());
    let globals = globals(&file, None);
    for (global, bind) in globals.iter().zip(inverse_binds(&file)) {
        assert!((global * bind - Matrix4::identity()).norm() < 1e-5);
    }
    for layer in &avatar.layers {
        assert!(worst(&skinned(&file, &layer.name, &globals), &layer.mesh.positions) < 1e-5);
    }
}

#[test]
fn clips_pose_the_layers_as_skinning_does() {
    let avatar = dressed();
    let file = import(&write_glb(&avatar).unwrap());
    let from = avatar.pose0.joint_frames(&avatar.skeleton);
    for key in [0, 3, 8] {
        let to = avatar.motions[0].poses[key].joint_frames(&avatar.skeleton);
        let moved: Vec<_> = to.iter().zip(&from).map(|(to, from)| to * from.inverse()).collect();
        for layer in &avatar.layers {
            let expected = skinning::skin(&layer.mesh.positions, &layer.weights, &moved);
            let found = skinned(&file, &layer.name, &globals(&file, Some(("wave", key))));
            assert!(worst(&found, &expected) < 5e-5, "{} at key {key}: {}", layer.name, worst(&found, &expected));
        }
    }
}

#[test]
fn still_joints_have_no_track_and_quaternions_go_the_short_way() {
    let file = import(&write_glb(&dressed()).unwrap());
    let clip = file.0.animations().next().unwrap();
    // hips up and their turn (the rest is turned), arm, knee, and the two joints that the rest turns
    assert_eq!(clip.channels().count(), 6);
    let mut before: Option<[f32; 4]> = None;
    for channel in clip.channels().filter(|c| c.target().node().name() == Some("rightUpperArm")) {
        let reader = channel.reader(|b| Some(&file.1[b.index()]));
        assert_eq!(reader.read_inputs().unwrap().last(), Some(0.8));
        let Some(gltf::animation::util::ReadOutputs::Rotations(rotations)) = reader.read_outputs() else { panic!() };
        for q in rotations.into_f32() {
            if let Some(p) = before {
                assert!(p.iter().zip(q).map(|(a, b)| a * b).sum::<f32>() > 0.0);
            }
            before = Some(q);
        }
    }
    assert!(before.is_some());
}

#[test]
fn the_same_avatar_gives_the_same_bytes() {
    let avatar = dressed();
    assert_eq!(write_glb(&avatar).unwrap(), write_glb(&avatar).unwrap());
}

#[test]
fn a_single_layer_makes_a_rigged_scan() {
    let mut avatar = dressed();
    avatar.layers.truncate(1);
    avatar.layers[0].name = "scan".into();
    avatar.layers[0].mesh.colors.clear();
    avatar.motions.clear();
    let file = import(&write_glb(&avatar).unwrap());
    assert_eq!(file.0.meshes().count(), 1);
    assert_eq!(file.0.animations().count(), 0);
    assert!(mesh_node(&file, "scan").skin().is_some());
}

#[test]
fn a_large_layer_gets_long_indices() {
    let mut avatar = dressed();
    let layer = &mut avatar.layers[0];
    while layer.mesh.positions.len() < 70_000 {
        layer.mesh.positions.extend_from_within(..);
        layer.weights.joints.extend_from_within(..);
        layer.weights.weights.extend_from_within(..);
    }
    (layer.mesh.normals, layer.mesh.colors) = (Vec::new(), Vec::new());
    let last = layer.mesh.positions.len() as u32 - 1;
    layer.mesh.triangles.push([0, 1, last]);
    let file = import(&write_glb(&avatar).unwrap());
    let primitive = mesh_node(&file, "body").mesh().unwrap().primitives().next().unwrap();
    let reader = primitive.reader(|b| Some(&file.1[b.index()]));
    assert_eq!(reader.read_indices().unwrap().into_u32().last(), Some(last));
}

fn refused(change: impl Fn(&mut Avatar)) -> String {
    let mut avatar = dressed();
    change(&mut avatar);
    write_glb(&avatar).unwrap_err().to_string()
}

#[test]
fn what_no_file_can_be_made_of_is_refused() {
    assert!(refused(|a| a.layers.clear()).contains("no layer"));
    assert!(refused(|a| a.name.clear()).contains("no name"));
    assert!(refused(|a| a.layers[1].name = "body".into()).contains("second layer"));
    assert!(refused(|a| a.layers[1].mesh.triangles.clear()).contains("`01-trousers`: it has no triangle"));
    assert!(refused(|a| a.layers[0].mesh.positions[7].x = f32::NAN).contains("vertex 7"));
    assert!(refused(|a| a.layers[2].mesh.triangles[0] = [0, 1, 1_000_000]).contains("`02-top`"));
    assert!(refused(|a| a.layers[0].weights.joints.truncate(9)).contains("weights"));
    assert!(refused(|a| a.layers[0].weights.weights[3] = [0.0; 4]).contains("vertex 3"));
    assert!(refused(|a| a.layers[0].weights.weights[3][0] = f32::NAN).contains("vertex 3"));
    assert!(refused(|a| a.layers[0].weights.joints[4][0] = 52).contains("vertex 4"));
    assert!(refused(|a| a.layers[1].thickness = Some(f32::NAN)).contains("thickness"));
    assert!(refused(|a| a.skeleton.rest[3].x = f64::NAN).contains("skeleton"));
    assert!(refused(|a| a.pose0.translation.x = f64::INFINITY).contains("finite"));
    assert!(refused(|a| a.pose0.rotations.truncate(51)).contains("51"));
    assert!(refused(|a| a.motions[0].poses.clear()).contains("`wave`: it has no pose"));
    assert!(refused(|a| a.motions[0].frame_time = 0.0).contains("frame time"));
    assert!(refused(|a| a.motions.push(a.motions[0].clone())).contains("second motion"));
    assert!(refused(|a| a.motions[0].poses[2] = Pose { rotations: vec![], ..Pose::identity() }).contains("pose 2"));
}

#[test]
fn a_texture_takes_the_place_of_colours_and_repeats_vertices_behind_the_others() {
    let avatar = common::textured();
    let bytes = write_glb(&avatar).unwrap();
    let file = import(&bytes);
    for layer in &avatar.layers {
        let texture = layer.texture.as_ref().unwrap();
        let node = mesh_node(&file, &layer.name);
        let primitive = node.mesh().unwrap().primitives().next().unwrap();
        let reader = primitive.reader(|b| file.1.get(b.index()).map(|d| d.0.as_slice()));
        let positions: Vec<Point3<f32>> = reader.read_positions().unwrap().map(Point3::from).collect();
        let count = layer.mesh.positions.len();
        assert_eq!(positions[..count], layer.mesh.positions, "the mesh's own come first");
        assert!(positions.len() > count && positions.len() == texture.source.len());
        assert!((count..positions.len()).all(|v| positions[v] == layer.mesh.positions[texture.source[v] as usize]));
        assert_eq!(reader.read_tex_coords(0).unwrap().into_f32().collect::<Vec<_>>(), texture.uv);
        assert!(reader.read_colors(0).is_none(), "colours would tint the texture");
        let normals: Vec<_> = reader.read_normals().unwrap().collect();
        assert!((count..positions.len()).all(|v| normals[v] == normals[texture.source[v] as usize]), "no seam is seen");
        let square = |t: &[f32; 4], n: &[f32; 3]| (0..3).map(|k| t[k] * n[k]).sum::<f32>().abs() < 1e-3;
        assert!(reader.read_tangents().unwrap().zip(&normals).all(|(t, n)| square(&t, n) && t[3].abs() == 1.0));
        let material = primitive.material();
        assert!(material.normal_texture().is_some());
        assert!(material.pbr_metallic_roughness().base_color_texture().is_some());
    }
    let mut plain = avatar;
    plain.layers[0].texture.as_mut().unwrap().triangles.pop();
    assert!(write_glb(&plain).unwrap_err().to_string().contains("triangles of its texture"));
}

#[test]
fn vertices_that_a_texture_repeats_are_read_as_one() {
    let avatar = common::textured();
    let read = toile_avatar::read_avatar(&write_glb(&avatar).unwrap()).unwrap();
    for layer in &avatar.layers {
        let found = &read.layers[&layer.name];
        assert_eq!(found.mesh.positions, layer.mesh.positions, "{}", layer.name);
        assert_eq!(found.mesh.triangles, layer.mesh.triangles, "{}", layer.name);
        assert_eq!(found.weights.len(), layer.weights.len());
    }
}
