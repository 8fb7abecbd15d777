//! Edits by hand of a garment.
#![no_main]

use libfuzzer_sys::fuzz_target;
use toile_garments::Edits;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(edits) = serde_json::from_slice::<Edits>(bytes) {
        let _ = edits.check();
    }
});
