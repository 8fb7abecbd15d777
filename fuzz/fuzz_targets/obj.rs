//! OBJ meshes.
#![no_main]

use libfuzzer_sys::fuzz_target;
use toile_geometry::obj;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(mesh) = obj::decode(bytes) {
        mesh.validate().expect("a mesh that was read keeps the rules of meshes");
    }
});
