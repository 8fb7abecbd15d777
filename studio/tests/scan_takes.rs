//! Finished scans as takes: a person without and with painted shorts, as files of other programs have them.

#![allow(clippy::unwrap_used)] // all of it is test code

mod common;

use std::{fs, path::Path};

use common::{exits, toile};
use nalgebra::{Point3, Rotation3, Vector3};
use toile_character::BodyModel;
use toile_geometry::{Mesh, ply};

/// The mean person; in shorts, 15 mm of blue cloth from the waist to above the knees.
fn person(in_shorts: bool) -> Mesh {
    let model = BodyModel::load_default().unwrap();
    let mut mesh = Mesh::new(model.mean.clone(), model.triangles);
    mesh.recompute_normals();
    mesh.colors = vec![[200, 160, 140]; mesh.positions.len()];
    let (low, high) = mesh.bounds().unwrap();
    let height = |p: &Point3<f32>| (p.y - low.y) / (high.y - low.y);
    let is_shorts = |p: &Point3<f32>| in_shorts && (0.33..0.6).contains(&height(p)) && p.x.abs() < 0.22;
    for v in 0..mesh.positions.len() {
        if is_shorts(&mesh.positions[v]) {
            mesh.positions[v] += mesh.normals[v] * 0.015;
            mesh.colors[v] = [30, 60, 160];
        }
    }
    mesh
}

/// Writes a mesh in centimetres, +Z up, turned about the vertical and moved.
fn write_ply(path: &Path, mesh: &Mesh, degrees: f32) {
    let turn = Rotation3::from_axis_angle(&Vector3::y_axis(), degrees.to_radians());
    let place = |p: &Point3<f32>| {
        let q = turn * p + Vector3::new(0.7, 0.2, -1.0);
        Point3::new(q.x, -q.z, q.y) * 100.0
    };
    let moved = Mesh { positions: mesh.positions.iter().map(place).collect(), normals: Vec::new(), ..mesh.clone() };
    fs::write(path, ply::encode(&moved)).unwrap();
}

#[test]
fn two_scans_become_a_dressed_person_wherever_they_stand() {
    let dir = tempfile::tempdir().unwrap();
    let (body, shorts, subject) = (dir.path().join("body.ply"), dir.path().join("shorts.ply"), dir.path().join("ann"));
    write_ply(&body, &person(false), 20.0);
    write_ply(&shorts, &person(true), 170.0);
    for (file, layer) in [(&body, "body"), (&shorts, "shorts")] {
        let told = exits(0, toile().arg("import").arg(file).arg("--subject").arg(&subject).args(["--layer", layer]));
        assert_eq!(
            (&told["results"]["scan"]["unit"], &told["results"]["scan"]["up"]),
            (&"cm".into(), &"z".into()),
            "{told}"
        );
    }
    assert_eq!(fs::read(subject.join("takes/00-body.scan/body.ply")).unwrap(), fs::read(&body).unwrap());
    let told = exits(0, toile().arg("inspect").arg(&subject));
    assert_eq!(told["results"]["takes"][1]["scan"]["unit"], "cm", "{told}");
    let told = exits(0, toile().arg("extract").arg(&subject));
    let stages = &told["results"]["stages"];
    assert!(stages["00-body/read"]["cleaned"]["watertight"].as_bool().unwrap(), "{stages}");
    let warnings = told["warnings"].to_string();
    assert!(warnings.contains("centimetres") && warnings.contains("along z"), "{warnings}");
    let area = stages["01-shorts/cut"]["area_m2"].as_f64().unwrap();
    let painted = person(true);
    let blue =
        painted.filter_triangles(|t| painted.triangles[t].iter().all(|&v| painted.colors[v as usize][2] == 160)).0;
    assert!((area / blue.area() - 1.0).abs() < 0.15, "{area} of {}", blue.area());
    assert!(subject.join("build/01-shorts/garment.ply").is_file());
    assert!(!subject.join("build/00-body/trajectory.tum").exists());
}

#[test]
fn a_person_who_was_scanned_in_clothes_only_gets_body_and_clothes() {
    let dir = tempfile::tempdir().unwrap();
    let (file, subject) = (dir.path().join("only.ply"), dir.path().join("ben"));
    write_ply(&file, &person(true), 30.0);
    let mut import = toile();
    import.arg("import").arg(&file).arg("--subject").arg(&subject).args(["--layer", "shorts", "--dressed"]);
    exits(0, &mut import);
    let told = exits(0, toile().arg("extract").arg(&subject));
    let warnings = told["warnings"].to_string();
    assert!(warnings.contains("the person is dressed: shape and measures are estimated"), "{warnings}");
    let cut = &told["results"]["stages"]["00-shorts/cut"];
    let painted = person(true);
    let is_blue = |t: usize| painted.triangles[t].iter().all(|&v| painted.colors[v as usize][2] == 160);
    let blue = painted.filter_triangles(is_blue).0;
    let area = cut["area_m2"].as_f64().unwrap();
    assert!((area / blue.area() - 1.0).abs() < 0.15, "{area} of {}", blue.area());
    // under the shorts the body has skin, not their paint
    let body = ply::read(&subject.join("build/body/body.ply")).unwrap();
    let painted_blue = body.colors.iter().filter(|c| c[2] > 120 && c[0] < 100).count();
    assert!(50 * painted_blue < body.colors.len(), "{painted_blue} vertices of the body are blue");
}

#[test]
fn a_retake_keeps_the_old_scan_and_wrong_words_change_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let (file, subject) = (dir.path().join("body.ply"), dir.path().join("ann"));
    write_ply(&file, &person(false), 0.0);
    let import = || {
        let mut command = toile();
        command.arg("import").arg(&file).arg("--subject").arg(&subject).args(["--layer", "body"]);
        command
    };
    exits(0, import().args(["--unit", "cm", "--up", "z"]));
    let told = exits(0, import().arg("--retake"));
    assert!(told["results"]["kept"].as_str().unwrap().ends_with("rejected/00-body.1.scan"), "{told}");
    assert!(subject.join("takes/rejected/00-body.1.scan/body.ply").is_file());
    let fbx = dir.path().join("body.fbx");
    fs::write(&fbx, "Kaydara FBX Binary").unwrap();
    let told = exits(1, toile().arg("import").arg(&fbx).arg("--subject").arg(&subject).args(["--layer", "coat"]));
    assert!(told["error"]["message"].as_str().unwrap().contains("GLB or OBJ"), "{told}");
    let small = dir.path().join("small.stl");
    fs::write(
        &small,
        "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 9 0 0\nvertex 0 9 0\nendloop\nendfacet\n",
    )
    .unwrap();
    let told = exits(1, toile().arg("import").arg(&small).arg("--subject").arg(&subject).args(["--layer", "coat"]));
    assert!(told["error"]["message"].as_str().unwrap().contains("--unit"), "{told}");
    assert!(!fs::read_to_string(subject.join("subject.toml")).unwrap().contains("coat"));
}
