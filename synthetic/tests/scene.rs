//! The scene, its truth and its files.

use std::sync::LazyLock;

use nalgebra::Point3;
use toile_capture::import;
use toile_geometry::{bvh::Bvh, transform_point};
use toile_synthetic::{
    GarmentKind, GarmentSettings, Sex, Subject, SyntheticError, SyntheticSettings, dressing::Collider, folder, record,
    truth,
};

fn settings() -> SyntheticSettings {
    let kinds = [GarmentKind::Trousers, GarmentKind::Tshirt, GarmentKind::Jacket];
    SyntheticSettings {
        seed: 23,
        sex: Sex::Male,
        garments: kinds.map(GarmentSettings::of).to_vec(),
        cell_m: 0.014,
        frames: 5,
        degrees: 150.0,
        sway_degrees: 0.0,
        ..SyntheticSettings::default()
    }
}

static SUBJECT: LazyLock<Subject> = LazyLock::new(|| Subject::new(&settings()).expect("the settings are in range"));

#[test]
fn every_layer_is_outside_the_ones_below_in_every_take() {
    for n in 0..SUBJECT.take_count() {
        let take = SUBJECT.take(n).unwrap();
        let surface = &take.surface;
        let layer = |k: usize| surface.mesh.filter_triangles(|t| usize::from(surface.layer[t]) == k).0;
        for upper in 1..=n {
            let cloth = layer(upper);
            assert!(cloth.triangles.len() > 1000, "layer {upper} of take {n}");
            for lower in 0..upper {
                let below = Collider::of(&layer(lower));
                let depths: Vec<f32> = cloth.positions.iter().filter_map(|p| below.distance(p)).map(|h| h.0).collect();
                assert!(!depths.is_empty(), "layers {lower} and {upper} of take {n} never meet");
                let inside = depths.iter().filter(|d| **d < 0.0).count();
                let deepest = depths.iter().copied().fold(f32::INFINITY, f32::min);
                assert!(
                    inside * 500 <= cloth.positions.len(),
                    "{inside} vertices of layer {upper} in {lower}, take {n}"
                );
                assert!(deepest > -0.003, "{deepest} m of layer {upper} in {lower}, take {n}");
            }
        }
    }
}

#[test]
fn garments_cover_what_they_should() {
    let take = SUBJECT.take(3).unwrap();
    let joint = |j: toile_character::Joint| take.joint_positions()[j.index()].cast::<f32>();
    let bounds = |k: u8| {
        let mesh = take.surface.mesh.filter_triangles(|t| take.surface.layer[t] == k).0;
        mesh.bounds().unwrap()
    };
    let (trousers, shirt, jacket) = (bounds(1), bounds(2), bounds(3));
    let (hips, ankle) = (joint(toile_character::Joint::Hips), joint(toile_character::Joint::LeftFoot));
    assert!(trousers.0.y < ankle.y + 0.12 && trousers.1.y > hips.y && trousers.1.y < hips.y + 0.2);
    let (elbow, hand) = (joint(toile_character::Joint::LeftLowerArm), joint(toile_character::Joint::LeftHand));
    // A sleeve's end is square to the arm, so its upper rim reaches farther out by its thickness.
    assert!(shirt.1.x < elbow.x + 0.06 && jacket.1.x > elbow.x + 0.08 && jacket.1.x < hand.x + 0.08);
    assert!(shirt.1.y < joint(toile_character::Joint::Head).y);
}

#[test]
fn true_poses_bring_the_frames_together() {
    let settings = SyntheticSettings { noise: false, sway_degrees: 0.0, room: false, ..settings() };
    let subject = Subject { settings, ..SUBJECT.clone() };
    let take = subject.take(2).unwrap();
    let mut truth = take.surface.mesh.clone();
    let first = truth.positions.len() as u32;
    let disk = toile_synthetic::room::disk();
    truth.positions.extend(&disk.positions);
    truth.triangles.extend(disk.triangles.iter().map(|t| t.map(|v| v + first)));
    let bvh = Bvh::new(&truth.positions, &truth.triangles);
    let rays = take.camera().rays();
    for index in 0..take.moments.len() {
        let depth = take.frame(index).unwrap().depth.unwrap();
        let pose = take.subject_from_camera(index);
        let mut worst = 0.0f32;
        let mut seen = 0;
        for (ray, &d) in rays.iter().zip(&depth.values).filter(|(_, d)| **d > 0) {
            let z = f32::from(d) * 0.001;
            let p = transform_point(&pose, &Point3::new(ray[0] * z, ray[1] * z, z));
            worst = worst.max(bvh.closest(&p, f32::INFINITY).unwrap().distance);
            seen += 1;
        }
        assert!(seen > 5000, "frame {index} shows {seen} pixels");
        // Half a depth unit along a ray that is at most 1.25 times as long as its depth.
        assert!(worst < 0.0007, "frame {index}: {worst} m");
    }
}

#[test]
fn the_same_bytes_for_any_number_of_threads_and_every_run() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let garments = vec![GarmentSettings::of(GarmentKind::Skirt)];
            let settings = SyntheticSettings { garments, cell_m: 0.025, sway_degrees: 0.5, ..settings() };
            let take = Subject::new(&settings).unwrap().take(1).unwrap();
            let frames = [take.frame(0).unwrap(), take.frame(3).unwrap()];
            (frames, take.surface.mesh, truth_bytes(&settings))
        })
    };
    let (one, three) = (run(1), run(3));
    assert!(one.0 == three.0 && one.1 == three.1 && one.2 == three.2);
    let other = Subject::new(&SyntheticSettings { seed: 24, garments: Vec::new(), ..settings() }).unwrap();
    assert!(other.person.skin.mesh != SUBJECT.person.skin.mesh);
}

fn truth_bytes(settings: &SyntheticSettings) -> String {
    truth::subject_json(&Subject::new(settings).expect("the settings are in range")).to_string()
}

#[test]
fn sway_bends_the_torso_and_leaves_the_feet() {
    let settings = SyntheticSettings { sway_degrees: 1.0, breathing_m: 0.002, frames: 40, ..settings() };
    let subject = Subject { settings, garments: Vec::new(), ..SUBJECT.clone() };
    let take = subject.take(0).unwrap();
    let points = &take.surface.mesh.positions;
    let mut largest = [0.0f32; 2];
    for moment in &take.moments {
        for (p, q) in points.iter().zip(take.bend.apply(points, moment)) {
            let k = usize::from(p.y > take.bend.hips.y as f32);
            if k == 1 || p.y < 0.5 {
                largest[k] = largest[k].max((p - q).norm());
            }
        }
    }
    assert!(largest[0] == 0.0 && largest[1] > 0.004 && largest[1] < 0.04, "{largest:?}");
}

#[test]
fn soles_stand_on_the_disk_and_takes_differ_a_little() {
    let lowest = |n: usize| {
        let take = SUBJECT.take(n).unwrap();
        (take.body.bounds().unwrap().0.y, take.joint_positions())
    };
    let ((y0, joints_0), (y1, joints_1)) = (lowest(0), lowest(1));
    assert!(y0.abs() < 1e-4 && y1.abs() < 1e-4, "{y0} {y1}");
    let moved: Vec<f64> = joints_0.iter().zip(&joints_1).map(|(a, b)| (a - b).norm()).collect();
    let largest = moved.iter().copied().fold(0.0, f64::max);
    assert!(largest > 0.005 && largest < 0.15, "{largest}");
    let feet = [Point3::from(joints_0[12]), Point3::from(joints_0[20])];
    assert!((feet[0].y - feet[1].y).abs() < 0.01);
}

#[test]
fn the_person_can_be_measured() {
    let person = &SUBJECT.person;
    assert!((1.4..2.1).contains(&person.stature_m), "{}", person.stature_m);
    let girths = person.girths;
    assert!((0.7..1.4).contains(&girths.chest.girth_m) && (0.55..1.4).contains(&girths.waist.girth_m));
    assert!(girths.hip.girth_m > 0.75 && girths.waist.girth_m < girths.hip.girth_m);
}

#[test]
fn folders_are_read_by_import() {
    let dir = tempfile::tempdir().unwrap();
    let garments = vec![GarmentSettings::of(GarmentKind::Shorts)];
    let settings = SyntheticSettings { garments, cell_m: 0.025, frames: 3, ..settings() };
    let subject = Subject::new(&settings).unwrap();
    folder::write_subject_folder(&subject, dir.path(), &|_| ()).unwrap();
    let take = subject.take(1).unwrap();
    let mut source = import::open(&dir.path().join("01-shorts"), None).unwrap();
    assert_eq!(source.frame_count(), Some(3));
    for index in 0..3 {
        let (read, made) = (source.next_frame().unwrap().unwrap(), take.frame(index).unwrap());
        assert_eq!(read.device_time_ns, made.device_time_ns);
        assert_eq!(read.depth, made.depth);
        assert_eq!(read.color, made.color);
    }
    assert_eq!(source.rig().sensors[0].depth, take.camera());
    for file in ["surface.ply", "garment_1.ply", "poses.txt", "pose.json"] {
        assert!(dir.path().join("01-shorts/truth").join(file).is_file(), "{file}");
    }
    assert!(dir.path().join("subject.json").is_file() && dir.path().join("00-body/truth/body.ply").is_file());
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    let error = |settings: SyntheticSettings| Subject::new(&settings).unwrap_err();
    let message = error(SyntheticSettings { frames: 1, ..settings() }).to_string();
    assert!(message.contains("frames"), "{message}");
    let message = error(SyntheticSettings { cell_m: f32::NAN, ..settings() }).to_string();
    assert!(message.contains("cell_m"), "{message}");
    assert!(matches!(SUBJECT.take(9), Err(SyntheticError::NoTake { take: 9, last: 3 })));
}

#[test]
fn only_surfaces_in_front_are_visible() {
    let take = SUBJECT.take(1).unwrap();
    let seen = truth::visible(&take);
    let share = seen.iter().filter(|s| **s).count() as f32 / seen.len() as f32;
    assert!((0.3..0.95).contains(&share), "{share}");
    // Legs under the trousers are hidden.
    let surface = &take.surface;
    let knee = take.joint_positions()[11].cast::<f32>();
    let near_knee = |t: &usize| surface.layer[*t] == 0 && (surface.mesh.corners(*t)[0] - knee).norm() < 0.09;
    assert!((0..seen.len()).filter(near_knee).all(|t| !seen[t]));
}

/// Numbers and names of a PLY header's elements, and how many bytes the header has.
fn ply_header(bytes: &[u8]) -> (String, usize) {
    let end = b"end_header\n";
    let at = bytes.windows(end.len()).position(|w| w == end).expect("a PLY file") + end.len();
    (String::from_utf8_lossy(&bytes[..at]).into_owned(), at)
}

#[test]
fn the_truth_beside_a_recorded_subject_is_whole() {
    let dir = tempfile::tempdir().unwrap();
    let garments = vec![GarmentSettings::of(GarmentKind::Shorts)];
    let settings = SyntheticSettings { garments, cell_m: 0.025, frames: 4, sway_degrees: 0.5, ..settings() };
    let subject = Subject::new(&settings).unwrap();
    let (folder, truth) = (dir.path().join("subject"), dir.path().join("subject/truth"));
    record::record_subject(&subject, &folder, Some(&truth), &|_| ()).unwrap();
    let take = subject.take(1).unwrap();
    let read = |name: &str| std::fs::read(truth.join("01-shorts/truth").join(name)).unwrap();
    // the surface: labels of every face, and the same vertices in take 0's pose
    let bytes = read("surface.ply");
    let (header, at) = ply_header(&bytes);
    let (vertices, faces) = (take.surface.mesh.positions.len(), take.surface.mesh.triangles.len());
    for line in [&format!("element vertex {vertices}")[..], "property float x0", "property uchar layer"] {
        assert!(header.lines().any(|l| l == line), "{line}: {header}");
    }
    assert_eq!(bytes.len() - at, vertices * 27 + faces * 16);
    let layers: Vec<u8> = (0..faces).map(|t| bytes[at + vertices * 27 + t * 16 + 13]).collect();
    assert_eq!(layers, take.surface.layer);
    // the garment alone has the same faces
    let garment = read("garment_1.ply");
    let shorts = layers.iter().filter(|l| **l == 1).count();
    assert!(ply_header(&garment).0.contains(&format!("element face {shorts}\n")));
    // poses of every frame at its device time, in the order of the frames
    let poses = toile_capture::trajectory::parse(&String::from_utf8(read("poses.txt")).unwrap()).unwrap();
    assert_eq!(poses.len(), 4);
    for (index, pose) in poses.iter().enumerate() {
        assert_eq!(pose.time_ns, take.moments[index].time_ns);
        assert!((pose.pose.translation.vector - take.subject_from_camera(index).translation.vector).norm() < 1e-6);
    }
    let pose: serde_json::Value = serde_json::from_slice(&read("pose.json")).unwrap();
    assert_eq!(pose["joints"].as_object().unwrap().len(), 52);
    assert_eq!(pose["theta"]["rotations"].as_object().unwrap().len(), 52);
    assert_eq!(String::from_utf8(read("sway.txt")).unwrap().lines().count(), 5);
    let body = toile_geometry::ply::read(&truth.join("01-shorts/truth/body.ply")).unwrap();
    assert_eq!(body.positions, take.body.positions);
    let person: serde_json::Value =
        serde_json::from_slice(&std::fs::read(truth.join("subject.json")).unwrap()).unwrap();
    assert_eq!(person["takes"], serde_json::json!(["00-body", "01-shorts"]));
    assert!(person["girths"]["hip"]["girth_m"].as_f64().is_some() && person["beta"].as_array().unwrap().len() == 50);
}
