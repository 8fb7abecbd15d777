//! Who may import whom, and what each crate never does. The tables are those of ARCHITECTURE.md.

use crate::workspace::{Member, members, sources, top};

/// A crate, the crates of this project that it may be built with, and those that its tests may use besides.
struct Row {
    name: &'static str,
    imports: &'static [&'static str],
    tests_with: &'static [&'static str],
}

const fn row(name: &'static str, imports: &'static [&'static str], tests_with: &'static [&'static str]) -> Row {
    Row { name, imports, tests_with }
}

const DRIVER: &[&str] = &["geometry", "capture", "driver-transport"];
const SIMULATED: &[&str] = &["driver-simulated", "synthetic"];

const TABLE: &[Row] = &[
    row("geometry", &[], &[]),
    row("scans", &["geometry"], &[]),
    row("capture", &["geometry", "scans"], &["outside"]),
    row("fusion", &["geometry", "capture"], &[]),
    row("stereo", &["geometry", "capture"], &["outside"]),
    row("texture", &["geometry", "capture"], &[]),
    row("calibration", &["geometry"], &["outside"]),
    row("character", &["geometry"], &["outside"]),
    row("implicit", &["geometry", "character"], &["animation", "outside"]),
    row("fitting", &["geometry", "character"], &["animation", "outside", "synthetic"]),
    row("garments", &["geometry", "character"], &["animation", "outside", "synthetic"]),
    row("cloth", &["geometry"], &[]),
    row("animation", &["geometry", "character", "cloth"], &["outside"]),
    row("avatar", &["geometry", "character"], &["animation", "cloth", "garments", "outside", "synthetic"]),
    row("render", &["geometry"], &[]),
    row("synthetic", &["geometry", "capture", "character", "render"], &[]),
    row("driver-transport", &[], &["outside"]),
    row("driver-kinect1", DRIVER, SIMULATED),
    row("driver-kinect2", DRIVER, SIMULATED),
    row("driver-realsense", DRIVER, SIMULATED),
    row("driver-uvc-depth", DRIVER, SIMULATED),
    row("driver-stereo", &["geometry", "capture", "stereo", "driver-transport"], SIMULATED),
    row("driver-webcam", &["geometry", "capture"], SIMULATED),
    row("driver-synthetic", &["geometry", "capture", "synthetic"], &[]),
    row("driver-simulated", &["geometry", "capture", "synthetic", "driver-transport"], &[]),
    row(
        "live",
        &[
            "geometry",
            "capture",
            "fusion",
            "render",
            "synthetic",
            "driver-transport",
            "driver-kinect1",
            "driver-kinect2",
            "driver-realsense",
            "driver-stereo",
            "driver-synthetic",
            "driver-uvc-depth",
            "driver-webcam",
        ],
        SIMULATED,
    ),
    row(
        "pipeline",
        &[
            "geometry",
            "scans",
            "capture",
            "fusion",
            "texture",
            "character",
            "implicit",
            "fitting",
            "garments",
            "cloth",
            "animation",
            "avatar",
            "render",
        ],
        &["synthetic", "driver-synthetic"],
    ),
    row("archive", &["geometry", "capture", "render", "pipeline"], &["outside"]),
    row(
        "service",
        &["geometry", "capture", "character", "garments", "render", "live", "pipeline"],
        &["synthetic", "driver-synthetic"],
    ),
    // The program and the end-to-end tests bring everything together.
    row("studio", ALL, ALL),
    row("outside", &[], &[]),
    row("tests", ALL, ALL),
];

const ALL: &[&str] = &["*"];

/// Packages of the registry that only these crates may be built with: terminals, HTTP and devices stay at the border.
const ONLY: &[(&str, &[&str])] = &[
    ("clap", &["studio"]),
    ("clap_complete", &["studio"]),
    ("indicatif", &["studio"]),
    ("axum", &["service"]),
    ("hyper", &["service"]),
    ("anyhow", &["studio"]),
    ("tracing-subscriber", &["studio"]),
    ("rusb", &["driver-transport"]),
    ("v4l", &["driver-transport"]),
    ("nokhwa", &["driver-webcam"]),
    ("mcap", &["capture"]),
    ("gltf-json", &["avatar"]),
    ("rusqlite", &["archive", "capture", "service"]),
    ("object_store", &["archive"]),
    ("parquet", &["archive"]),
];

/// Words that must not stand in a crate's source: crate, words, and which promise of ARCHITECTURE.md that keeps.
const NEVER: &[(&str, &[&str], &str)] = &[
    ("geometry", &["Skeleton", "Garment", "std::net", "/dev/"], "knows no body, no garment, no device"),
    ("capture", &["kinect", "Kinect", "realsense::", "RealSense"], "knows no vendor"),
    ("scans", &["Skeleton", "BodyModel", "toile_fitting"], "does not know what a body is"),
    ("fusion", &["Skeleton", "BodyModel", "stature"], "does not know what a body is"),
    ("stereo", &["/dev/video", "v4l"], "opens no camera"),
    ("texture", &["positions_mut", "positions.iter_mut", "Skeleton"], "moves no geometry, knows no body"),
    ("character", &["gltf", "HIERARCHY"], "reads no formats of other people"),
    ("implicit", &["toile_fusion", "toile_capture"], "needs no scan"),
    ("fitting", &["GarmentType", "toile_garments"], "does not know which garment it poses"),
    ("garments", &["toile_render", "gltf"], "renders and animates nothing"),
    ("animation", &["gltf"], "writes no avatar files"),
    ("avatar", &["positions_mut", "positions.iter_mut", "remesh::", "decimate::"], "does not change geometry"),
    ("render", &["toile_capture", "Skeleton", "println!"], "knows neither captures nor bodies"),
    ("driver-transport", &["toile_capture", "DepthImage", "RgbImage"], "does not decode frames"),
    ("driver-kinect1", &["bilateral", "remesh", "toile_fusion"], "does not process images beyond decoding"),
    ("driver-kinect2", &["remesh", "toile_fusion"], "does not process images beyond decoding"),
    ("driver-realsense", &["bilateral", "toile_fusion", "match_pair"], "does not process images beyond decoding"),
    ("driver-uvc-depth", &["bilateral", "toile_fusion", "match_pair"], "does not process images beyond decoding"),
    ("driver-stereo", &["aggregate", "census"], "does not match images itself"),
    ("driver-webcam", &["DepthImage {", "DepthImage::"], "does not pretend to have depth"),
    ("driver-synthetic", &["rasterize", "Raster"], "does not hold the scene itself"),
    (
        "driver-simulated",
        &["toile_driver_kinect1", "toile_driver_kinect2", "toile_driver_realsense"],
        "does not share code with the drivers that it tests",
    ),
    ("studio", &["rasterize", "Bvh::new", "nalgebra::DMatrix", "faer::"], "does not hold algorithms"),
    ("service", &["println!", "eprintln!", "std::process::exit", "clap"], "talks to no terminal"),
    ("pipeline", &["println!", "eprintln!", "std::io::stdout", "std::process::exit"], "talks to no terminal"),
    ("archive", &["println!", "eprintln!", "std::io::stdout", "std::process::exit"], "talks to no terminal"),
    ("live", &["println!", "eprintln!", "std::io::stdout", "std::process::exit"], "talks to no terminal"),
];

fn own(name: &str) -> Option<&str> {
    name.strip_prefix("toile-")
}

fn check(member: &Member, row: &Row) -> Vec<String> {
    let may = |list: &[&str], name: &str| list == ALL || list.contains(&name);
    let imports = member.imports.iter().filter_map(|n| own(n)).filter(|n| !may(row.imports, n));
    let tests = member.tests_with.iter().filter_map(|n| own(n));
    let tests = tests.filter(|n| !may(row.imports, n) && !may(row.tests_with, n));
    let imports = imports.map(|n| format!("{} must not import {n}", row.name));
    imports.chain(tests.map(|n| format!("the tests of {} must not use {n}", row.name))).collect()
}

#[test]
fn no_crate_imports_against_the_arrows() {
    let mut wrong = Vec::new();
    for (name, member) in members() {
        let Some(name) = own(&name) else { continue };
        match TABLE.iter().find(|row| row.name == name) {
            None => wrong.push(format!("{}: {name} is in no row of the table of imports", member.folder)),
            Some(row) => wrong.extend(check(&member, row)),
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_row_of_the_table_is_a_crate() {
    let members = members();
    let gone: Vec<_> = TABLE.iter().map(|r| r.name).filter(|n| !members.contains_key(&format!("toile-{n}"))).collect();
    assert!(gone.is_empty(), "these rows have no crate: {gone:?}");
}

#[test]
fn terminals_devices_and_formats_stay_at_the_border() {
    let mut wrong = Vec::new();
    for (name, member) in members() {
        let Some(crate_name) = own(&name) else { continue };
        for (package, only) in ONLY.iter().filter(|(p, _)| member.imports.iter().any(|i| i == p)) {
            if !only.contains(&crate_name) {
                wrong.push(format!("{crate_name} must not import {package}: only {only:?} may"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn no_crate_does_what_it_never_does() {
    let (members, mut wrong) = (members(), Vec::new());
    for (name, words, promise) in NEVER {
        let folder = top().join(&members[&format!("toile-{name}")].folder).join("src");
        for (path, text) in sources(&folder) {
            let code = text.lines().filter(|l| !l.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n");
            let code = code.split("#[cfg(test)]\nmod tests").next().unwrap();
            let found = words.iter().filter(|w| code.contains(*w));
            wrong.extend(found.map(|w| format!("{}: `{w}` ({name} {promise})", path.display())));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
