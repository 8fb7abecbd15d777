//! PLY meshes.
#![no_main]

use libfuzzer_sys::fuzz_target;
use toile_geometry::ply;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(mesh) = ply::decode(bytes) {
        let written = ply::encode(&mesh);
        ply::decode(&written).expect("a mesh that was read is written so that it can be read again");
    }
});
