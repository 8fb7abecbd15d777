//! UVC payloads to pictures and metadata.
#![no_main]

use libfuzzer_sys::fuzz_target;
use toile_driver_realsense::metadata;
use toile_driver_transport::simulated::uvc::Assembler;

fuzz_target!(|input: (bool, Vec<Vec<u8>>)| {
    let (is_whole, payloads) = input;
    let mut assembler = Assembler::new(64, 64, is_whole);
    for payload in &payloads {
        for sent in assembler.push(payload, 0) {
            assert!(sent.picture.len() <= 64);
            metadata::parse(&sent.metadata, is_whole);
        }
    }
});
