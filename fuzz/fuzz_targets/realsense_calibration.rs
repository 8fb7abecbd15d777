//! Calibration tables of a RealSense camera; their checksums are made right, or nothing would get past them.
#![no_main]

use libfuzzer_sys::fuzz_target;
use toile_driver_realsense::Calibration;

fn table(kind: u16, body: &[u8]) -> Vec<u8> {
    let mut bytes = vec![3, 0];
    bytes.extend(kind.to_le_bytes());
    bytes.extend((body.len() as u32).to_le_bytes());
    bytes.extend([0; 4]);
    bytes.extend(crc(body).to_le_bytes());
    bytes.extend(body);
    bytes
}

/// CRC-32, bit by bit.
fn crc(bytes: &[u8]) -> u32 {
    let step = |crc: u32| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 };
    !bytes.iter().fold(u32::MAX, |crc, byte| (0..8).fold(crc ^ u32::from(*byte), |crc, _| step(crc)))
}

fuzz_target!(|input: (Vec<u8>, Vec<u8>, u16, u16)| {
    let (coefficients, color, width, height) = input;
    let _ = Calibration::new(&coefficients, Some(&color));
    if let Ok(found) = Calibration::new(&table(25, &coefficients), Some(&table(32, &color))) {
        let _ = found.depth_camera(width.into(), height.into());
        let _ = found.color_camera(width.into(), height.into());
        let _ = (found.color_from_depth(), found.baseline());
    }
});
