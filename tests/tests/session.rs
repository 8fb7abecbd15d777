//! The recorded session, end to end: every layer is there, any number of threads and any interruption give the same
//! bytes, and outside programs accept the files.

#![allow(clippy::unwrap_used)] // all of it is test code

use std::{
    collections::BTreeMap,
    fs,
    os::unix::process::ExitStatusExt,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    sync::OnceLock,
    time::{Duration, Instant},
};

use nalgebra::Point3;
use serde_json::{Value, json};
use toile_geometry::ply;

/// Files that may differ between two runs.
const MAY_DIFFER: [&str; 2] = ["timings.json", "report.html"];

fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn toile(words: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_toile-under-test"));
    command.args(words).stderr(Stdio::null());
    command
}

/// The demo of the shipped session, made once with two threads.
fn demo() -> &'static Path {
    static MADE: OnceLock<(tempfile::TempDir, PathBuf)> = OnceLock::new();
    let made = MADE.get_or_init(|| {
        let dir = tempfile::tempdir().unwrap();
        let subject = run_demo(dir.path(), "2");
        (dir, subject)
    });
    &made.1
}

fn run_demo(out: &Path, threads: &str) -> PathBuf {
    let recorded = workspace().join("recorded");
    let (recorded, folder) = (recorded.to_str().unwrap(), out.to_str().unwrap());
    let words = ["demo", "--recorded", recorded, "--out", folder, "--threads", threads, "--json"];
    let done = toile(&words).output().unwrap();
    let answer: Value = serde_json::from_slice(&done.stdout).unwrap();
    assert_eq!(done.status.code(), Some(0), "{answer}");
    fs::read_dir(out).unwrap().flatten().map(|e| e.path()).min().unwrap()
}

/// Every file below a folder by its relative path, but for those that may differ.
fn files(root: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut open = vec![root.to_path_buf()];
    while let Some(folder) = open.pop() {
        for path in fs::read_dir(&folder).unwrap().flatten().map(|e| e.path()) {
            if path.is_dir() {
                open.push(path);
            } else if !MAY_DIFFER.iter().any(|name| path.ends_with(name)) {
                found.insert(path.strip_prefix(root).unwrap().to_path_buf(), fs::read(&path).unwrap());
            }
        }
    }
    found
}

fn assert_same(a: &Path, b: &Path) {
    let (a, b) = (files(a), files(b));
    let names = |files: &BTreeMap<PathBuf, Vec<u8>>| files.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&a), names(&b));
    let differing: Vec<_> = a.iter().filter(|(name, bytes)| b[*name] != **bytes).map(|(name, _)| name).collect();
    assert!(differing.is_empty(), "these differ: {differing:?}");
}

/// The JSON part of a GLB file.
fn glb_json(path: &Path) -> Value {
    let bytes = fs::read(path).unwrap();
    assert_eq!(&bytes[..4], b"glTF");
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    serde_json::from_slice(&bytes[20..20 + length]).unwrap()
}

#[test]
fn every_take_is_a_layer_of_the_avatar() {
    let subject = demo();
    let mut wanted: Vec<String> = fs::read_dir(subject.join("takes"))
        .unwrap()
        .flatten()
        .filter_map(|e| e.file_name().to_str()?.strip_suffix(".mcap").map(str::to_string))
        .collect();
    wanted.sort();
    wanted[0] = "body".into();
    let gltf = glb_json(&subject.join("avatar.glb"));
    let nodes = gltf["nodes"].as_array().unwrap();
    let mut layers: Vec<&str> =
        nodes.iter().filter(|n| n.get("mesh").is_some()).map(|n| n["name"].as_str().unwrap()).collect();
    layers.sort_by_key(|name| (*name != "body", name.to_string()));
    assert_eq!(layers, wanted);
    assert_eq!(gltf["animations"].as_array().unwrap().len(), 1, "the walk is in it");
    for file in ["avatar.vrm", "report.html", "build/body/body.json", "build/body/rigged_scan.glb"] {
        assert!(subject.join(file).is_file(), "{file} is missing");
    }
}

#[test]
fn one_thread_and_three_kills_give_the_same_bytes() {
    let subject = demo();
    let dir = tempfile::tempdir().unwrap();
    let copy = dir.path().join(subject.file_name().unwrap());
    fs::create_dir_all(copy.join("takes")).unwrap();
    fs::copy(subject.join("subject.toml"), copy.join("subject.toml")).unwrap();
    for take in fs::read_dir(subject.join("takes")).unwrap().flatten() {
        fs::copy(take.path(), copy.join("takes").join(take.file_name())).unwrap();
    }
    let words = ["process", copy.to_str().unwrap(), "--threads", "1", "--quiet"];
    // In the first stage, after it, and among the garments.
    for (there, missing) in [
        ("takes/00-body.mcap", "build/00-body/scan.ply"),
        ("build/00-body/scan.ply", "build/body/body.json"),
        ("build/body/body.json", "avatar.glb"),
    ] {
        kill_once(&words, &copy.join(there), Duration::from_millis(700));
        assert!(!copy.join(missing).exists(), "the run was killed too late to say anything");
    }
    assert_eq!(toile(&words).status().unwrap().code(), Some(0));
    assert_same(subject, &copy);
}

/// Starts the program and kills it while it works, some time after a file has appeared.
fn kill_once(words: &[&str], there: &Path, after: Duration) {
    let mut child = toile(words).stdout(Stdio::null()).spawn().unwrap();
    let start = Instant::now();
    while !there.exists() && start.elapsed() < Duration::from_mins(5) {
        assert!(child.try_wait().unwrap().is_none(), "it ended before {} was there", there.display());
        std::thread::sleep(Duration::from_millis(20));
    }
    std::thread::sleep(after);
    child.kill().unwrap();
    assert_eq!(child.wait().unwrap().signal(), Some(9), "it was killed, and had not ended by itself");
}

#[test]
fn a_second_run_does_nothing() {
    let subject = demo();
    let times = || -> BTreeMap<PathBuf, _> {
        let of = |p: &PathBuf| fs::metadata(subject.join(p)).unwrap().modified().unwrap();
        files(subject).into_keys().map(|p| (p.clone(), of(&p))).collect()
    };
    let before = times();
    assert_eq!(toile(&["process", subject.to_str().unwrap(), "--quiet"]).status().unwrap().code(), Some(0));
    assert_eq!(times(), before);
}

/// A copy of a subject, and the folder that holds it.
fn copied(made: &Path) -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let subject = dir.path().join(made.file_name().unwrap());
    for (name, bytes) in files(made) {
        let path = subject.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }
    (dir, subject)
}

#[test]
fn a_stroke_is_kept_heeded_at_each_rebuild_and_forgotten_on_request() {
    let made = demo();
    let (dir, subject) = copied(made);
    let run = |command: &str, more: &[&str]| {
        let output = toile(&[&[command, subject.to_str().unwrap()], more].concat()).output().unwrap();
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stdout).unwrap()
    };
    let avatar = || fs::read(subject.join("avatar.glb")).unwrap();
    let first = avatar();
    let cut = subject.join("build/01-trousers/cut.ply");
    let before = fs::read(&cut).unwrap();
    // In front, half-way up.
    let front = ply::read(&cut).unwrap().positions.into_iter().filter(|p| (0.6..0.7).contains(&p.y));
    let at = front.max_by(|a, b| a.z.total_cmp(&b.z)).unwrap();
    let strokes = dir.path().join("strokes.json");
    let stroke = json!({ "mark": "does-not-belong", "points": [[at.x, at.y, at.z]], "radius": 0.02 });
    fs::write(&strokes, json!({ "version": 1, "strokes": [stroke] }).to_string()).unwrap();
    let answer = run("edit", &["trousers", "--strokes", strokes.to_str().unwrap(), "--json"]);
    assert!(!answer.contains("avatar.glb is older") && avatar() != first, "an edit builds the avatar again: {answer}");
    let edited = fs::read(&cut).unwrap();
    let [old, new] = [&before, &edited].map(|bytes| ply::decode(bytes).unwrap().positions);
    let distance = |p: &Point3<f32>, points: &[Point3<f32>]| points.iter().map(|q| (p - q).norm()).fold(1.0, f32::min);
    let near = distance(&at, &new);
    let elsewhere = new.iter().step_by(97).filter(|p| (*p - at).norm() > 0.1);
    let away = elsewhere.map(|p| distance(p, &old)).fold(0.0, f32::max);
    assert!(near > 0.01 && away < 0.005, "nearest {near} m, elsewhere up to {away} m");
    fs::remove_file(&cut).unwrap();
    run("extract", &[]);
    assert!(fs::read(&cut).unwrap() == edited, "heeded at the rebuild");
    run("edit", &["trousers", "--clear"]);
    assert!(fs::read(&cut).unwrap() == before && !subject.join("edits/01-trousers.json").exists());
    assert!(avatar() == first, "without the stroke it is the same again");
}

#[test]
fn what_is_put_on_is_a_layer_for_any_number_of_threads_and_leaves_no_trace_when_it_is_off() {
    let made = demo();
    let wear = |subject: &Path, words: &[&str]| {
        let output = toile(&["wear"]).args(words).arg(subject).arg("--json").output().unwrap();
        (output.status.code(), serde_json::from_slice::<Value>(&output.stdout).unwrap())
    };
    let ((_a, one), (_b, two)) = (copied(made), copied(made));
    let (code, answer) = wear(&one, &["t-shirt", "--threads", "1"]);
    assert_eq!(code, Some(0), "{answer}");
    let crossing = answer["results"]["crossing_pairs"].as_object().unwrap();
    assert!(crossing.values().all(|pairs| pairs == 0), "{answer}");
    let layer = answer["results"]["layer"].as_str().unwrap();
    assert!(layer.ends_with("-t-shirt") && answer["results"]["layers"].as_array().unwrap().last().unwrap() == layer);
    let nodes = &glb_json(&one.join("avatar.glb"))["nodes"];
    assert!(nodes.as_array().unwrap().iter().any(|n| n["name"] == layer && n["skin"] == 0), "{nodes}");
    let (code, again) = wear(&one, &["t-shirt"]);
    assert!(code == Some(1) && again["error"]["message"].as_str().unwrap().contains("already"), "{again}");
    let (code, own) = wear(&two, &[made.join("01-trousers").to_str().unwrap()]);
    assert!(code == Some(1) && own["error"]["message"].as_str().unwrap().contains("scanned in it"), "{own}");
    assert_eq!(wear(&two, &["t-shirt", "--threads", "2"]).0, Some(0));
    assert_same(&one, &two);
    assert_eq!(wear(&one, &["t-shirt", "--off"]).0, Some(0));
    assert_same(made, &one);
}

#[test]
fn hidden_skin_is_left_out_on_request_and_comes_back() {
    let made = demo();
    let (_dir, subject) = copied(made);
    let export = |more: &[&str]| {
        let output = toile(&[&["export", subject.to_str().unwrap()], more].concat()).output().unwrap();
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stdout).unwrap()
    };
    let read = |name: &str| fs::read(subject.join(name)).unwrap();
    let whole = ["avatar.glb", "avatar.vrm"].map(read);
    let corners = || {
        let gltf = glb_json(&subject.join("avatar.glb"));
        let indices = |mesh: &Value| mesh["primitives"][0]["indices"].as_u64().unwrap() as usize;
        let count = |mesh| gltf["accessors"][indices(mesh)]["count"].as_u64().unwrap();
        gltf["meshes"].as_array().unwrap().iter().map(count).collect::<Vec<u64>>()
    };
    let all = corners();
    let reported = export(&["--cull-hidden"]);
    let culled = corners();
    assert!(reported.contains("body: ") && reported.contains("triangles left out"), "{reported}");
    assert!(0 < culled[0] && culled[0] < all[0], "{culled:?} of {all:?}");
    assert_eq!(culled.last(), all.last(), "the outermost layer is whole");
    assert!(["avatar.glb", "avatar.vrm"].iter().zip(&whole).all(|(name, whole)| read(name).len() < whole.len()));
    export(&[]);
    assert!(["avatar.glb", "avatar.vrm"].map(read) == whole, "whole again");
}

#[test]
fn further_formats_are_written_remembered_and_removed() {
    let (dir, subject) = copied(demo());
    let run = |words: &[&str]| {
        let output = toile(&[words, &[subject.to_str().unwrap(), "--json"]].concat()).output().unwrap();
        assert!(output.status.success(), "{output:?}");
        serde_json::from_slice::<Value>(&output.stdout).unwrap()
    };
    let usual = ["avatar.glb", "avatar.vrm"].map(|name| fs::read(subject.join(name)).unwrap());
    run(&["export", "--to", "obj,ply,bvh,usda"]);
    assert!(["avatar.glb", "avatar.vrm"].map(|name| fs::read(subject.join(name)).unwrap()) == usual);
    let all = toile_geometry::obj::read(&subject.join("avatar.obj")).unwrap();
    let layers: Vec<PathBuf> = fs::read_dir(&subject)
        .unwrap()
        .flatten()
        .map(|e| e.path())
        .filter(|path| path.extension().is_some_and(|e| e == "ply"))
        .collect();
    assert_eq!(layers.len(), fs::read_dir(subject.join("takes")).unwrap().count());
    let layers: Vec<_> = layers.iter().map(|path| ply::read(path).unwrap()).collect();
    assert_eq!(layers.iter().map(|l| l.positions.len()).sum::<usize>(), all.positions.len());
    assert!(layers.iter().all(|l| l.attributes["weight0"].len() == l.positions.len()));
    let (low, high) = all.bounds().unwrap();
    assert!(low.y > -0.1 && high.y > 1.3 && high.y < 2.2, "metres, +Y up, on the floor: {low} {high}");
    let usda = fs::read_to_string(subject.join("avatar.usda")).unwrap();
    assert_eq!(usda.matches("def Mesh").count(), layers.len());
    // Nothing of it stays that a later run does not want, but for what somebody changed.
    fs::write(subject.join("avatar.mtl"), "mine").unwrap();
    let bvh = dir.path().join("again.bvh");
    fs::copy(subject.join("avatar.bvh"), &bvh).unwrap();
    let told = run(&["process"]);
    assert!(told["warnings"].to_string().contains("obj, ply, bvh, usda"), "{told}");
    assert_ne!(fs::read(subject.join("avatar.mtl")).unwrap(), b"mine", "made anew");
    fs::write(subject.join("avatar.mtl"), "mine").unwrap();
    run(&["export", "--to", "glb", "--motion", bvh.to_str().unwrap()]);
    let is_there = |name: &str| subject.join(name).exists();
    assert!(!["avatar.obj", "avatar.bvh", "avatar.usda", "avatar-body.ply"].iter().any(|name| is_there(name)));
    assert!(is_there("avatar.mtl") && is_there("avatar.vrm"));
}

#[test]
fn levels_of_detail_have_textures_and_relief_and_go_again() {
    let (_dir, subject) = copied(demo());
    let run = |lod: &str| {
        let output = toile(&["export", subject.to_str().unwrap(), "--lod", lod, "--json"]).output().unwrap();
        assert!(output.status.success(), "{output:?}");
    };
    run("6k,4k");
    for (name, most) in [("avatar-6k.glb", 6000), ("avatar-4k.glb", 4000)] {
        let gltf = glb_json(&subject.join(name));
        let list = |key: &str| gltf[key].as_array().unwrap().clone();
        for mesh in list("meshes") {
            let primitive = &mesh["primitives"][0];
            let corners = list("accessors")[primitive["indices"].as_u64().unwrap() as usize]["count"].as_u64().unwrap();
            assert!(corners / 3 <= most, "{name} {}: {} triangles", mesh["name"], corners / 3);
            let attributes = &primitive["attributes"];
            assert!(["TEXCOORD_0", "TANGENT", "JOINTS_0"].iter().all(|a| attributes.get(a).is_some()), "{attributes}");
            assert!(attributes.get("COLOR_0").is_none());
        }
        let textured =
            |m: &Value| m["pbrMetallicRoughness"].get("baseColorTexture").is_some() && m.get("normalTexture").is_some();
        assert!(list("materials").iter().all(textured));
    }
    run("off");
    assert!(!subject.join("avatar-6k.glb").exists() && subject.join("avatar.glb").exists());
}

#[test]
fn khronos_validator_finds_nothing() {
    let subject = demo();
    let modules = workspace().join("target/outside/node_modules");
    if toile_outside::file(&modules.join("gltf-validator")).is_none() {
        return;
    }
    let files = ["avatar.glb", "avatar.vrm", "build/body/rigged_scan.glb"].map(|f| subject.join(f));
    let done = Command::new("node")
        .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("validate_gltf.cjs"))
        .args(&files)
        .env("NODE_PATH", &modules)
        .output()
        .unwrap();
    let report: Value = serde_json::from_slice(&done.stdout).unwrap();
    for (file, issues) in report.as_object().unwrap() {
        assert_eq!((&issues["errors"], &issues["warnings"]), (&0.into(), &0.into()), "{file}: {}", issues["messages"]);
    }
}

#[test]
fn assimp_loads_every_layer_and_the_clip() {
    let subject = demo();
    let Some(assimp) = toile_outside::program("assimp") else { return };
    let done = Command::new(assimp).arg("info").arg(subject.join("avatar.glb")).output().unwrap();
    let text = String::from_utf8_lossy(&done.stdout);
    let count = |label: &str| -> Option<usize> {
        text.lines().find_map(|l| l.strip_prefix(label)).and_then(|n| n.trim().parse().ok())
    };
    let takes = fs::read_dir(subject.join("takes")).unwrap().count();
    assert_eq!((count("Meshes:"), count("Animations:")), (Some(takes), Some(1)), "{text}");
    let gltf = glb_json(&subject.join("avatar.glb"));
    let joints = gltf["skins"][0]["joints"].as_array().unwrap();
    assert_eq!(joints.len(), 52);
    for joint in joints {
        let name = gltf["nodes"][joint.as_u64().unwrap() as usize]["name"].as_str().unwrap();
        assert!(text.lines().any(|l| l.ends_with(&format!("\u{2574}{name}"))), "{name} is missing: {text}");
    }
}

#[test]
fn an_avatar_keeps_what_it_was_made_with() {
    let (dir, subject) = copied(demo());
    let run = |words: &[&str]| {
        let output = toile(words).output().unwrap();
        assert!(output.status.success(), "{output:?}");
        serde_json::from_slice::<Value>(&output.stdout).unwrap()
    };
    let path = subject.to_str().unwrap();
    let motion = dir.path().join("dance.bvh");
    fs::copy(workspace().join("animation/assets/walk.bvh"), &motion).unwrap();
    let words = ["--motion", motion.to_str().unwrap(), "--cull-hidden", "--joint-names", "mixamo", "--json"];
    run(&[&["export", path], &words[..]].concat());
    let made = ["avatar.glb", "avatar.vrm"].map(|name| fs::read(subject.join(name)).unwrap());
    fs::remove_file(&motion).unwrap();
    let reported = run(&["process", path, "--json"]);
    assert!(["avatar.glb", "avatar.vrm"].map(|name| fs::read(subject.join(name)).unwrap()) == made);
    assert!(reported["warnings"].to_string().contains("dance.bvh"), "it says what it keeps: {reported}");
    // All of it can be built again.
    fs::remove_dir_all(subject.join("build/avatar")).unwrap();
    run(&["process", path, "--json"]);
    assert!(fs::read(subject.join("avatar.glb")).unwrap() == made[0]);
    let walks = run(&["process", path, "--motion", "walk", "--json"]);
    assert!(!walks["warnings"].to_string().contains("dance.bvh"));
    assert_eq!(glb_json(&subject.join("avatar.glb"))["animations"][0]["name"], "walk");
}

#[test]
fn a_record_changed_by_hand_is_noticed_and_built_again() {
    let (_dir, subject) = copied(demo());
    let path = subject.join("build/layers/report.json");
    let whole = fs::read_to_string(&path).unwrap();
    let at = whole.find("\"gap_m\": ").unwrap() + 9;
    fs::write(&path, format!("{}9{}", &whole[..at], &whole[at..])).unwrap();
    let output = toile(&["process", subject.to_str().unwrap(), "--json"]).output().unwrap();
    let reported: Value = serde_json::from_slice(&output.stdout).unwrap();
    let is_said = |w: &Value| w.as_str().is_some_and(|w| w.contains("build/layers/report.json"));
    assert!(reported["warnings"].as_array().unwrap().iter().any(is_said), "{reported}");
    assert_eq!(fs::read_to_string(&path).unwrap(), whole);
}

/// Layers in motion: hardly a crossing a frame on average, in caches that fit the avatar, whole or not at all, the same for any number of threads.
#[test]
fn layers_move_nearly_without_crossing() {
    let dir = tempfile::tempdir().unwrap();
    let subject = dir.path().join("rowan");
    copy(demo(), &subject);
    let animate = |threads: &str| {
        let words = ["animate", subject.to_str().unwrap(), "--fps", "8", "--threads", threads, "--json"];
        let done = toile(&words).output().unwrap();
        let answer: Value = serde_json::from_slice(&done.stdout).unwrap();
        assert_eq!(done.status.code(), Some(0), "{answer}");
        answer
    };
    animate("2");
    let folder = subject.join("motion").join("walk");
    let report: Value = serde_json::from_slice(&fs::read(folder.join("report.json")).unwrap()).unwrap();
    let frames = report["frames"].as_array().unwrap();
    assert!(frames.len() == 35 && report["fps"].as_f64() == Some(8.0), "{report}");
    let crossing: u64 = frames.iter().map(|f| f["crossing"].as_u64().unwrap()).sum();
    assert!(crossing <= 5 * frames.len() as u64, "{frames:?}");
    let glb = glb_json(&subject.join("avatar.glb"));
    let layers: Vec<String> = glb["nodes"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|n| !n["mesh"].is_null())
        .map(|n| {
            let mesh = &glb["meshes"][n["mesh"].as_u64().unwrap() as usize];
            let positions = mesh["primitives"][0]["attributes"]["POSITION"].as_u64().unwrap() as usize;
            let points = glb["accessors"][positions]["count"].as_u64().unwrap();
            let name = n["name"].as_str().unwrap().to_string();
            let cache = fs::read(folder.join(format!("{name}.pc2"))).unwrap();
            assert_eq!(cache.len() as u64, 32 + 35 * points * 12, "{name}");
            name
        })
        .collect();
    assert!(layers.len() >= 2 && layers[0] == "body", "{layers:?}");
    let caches =
        |folder: &Path| files(folder).into_iter().filter(|f| f.0 != Path::new("report.json")).collect::<Vec<_>>();
    let before = caches(&folder);
    assert_eq!(before.len(), layers.len() + 3, "a cache a layer, motion.glb, film.gif and stills.png");
    animate("1");
    assert!(caches(&folder) == before, "another number of threads gives other bytes");
}

fn copy(from: &Path, to: &Path) {
    for (name, bytes) in files(from) {
        let path = to.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }
}
