//! Finished scans: GLB, STL, OBJ and PLY as surfaces, each as if it were the file's format.
#![no_main]

use libfuzzer_sys::fuzz_target;
use toile_scans::{decode_glb, decode_obj, decode_ply, decode_stl};

fuzz_target!(|bytes: &[u8]| {
    for surface in [decode_glb(bytes), decode_stl(bytes), decode_obj(bytes), decode_ply(bytes)].into_iter().flatten() {
        if surface.validate().is_ok() {
            let _ = (0..surface.triangles.len().min(100)).filter_map(|t| surface.color_at(t, [0.2, 0.3, 0.5])).count();
        }
    }
});
