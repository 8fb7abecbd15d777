//! Parsers of bytes from outside that are not public, for the targets in `fuzz/`. Not part of the interface.

use crate::{associate::associate, encoded, import, subject};

/// Decodes a depth PNG.
pub fn depth_png(bytes: &[u8]) {
    let _ = (encoded::size(bytes), encoded::decode_depth_png(bytes));
}

/// Decodes a colour image as `inspect` does, and as a mask.
pub fn color_image(bytes: &[u8]) {
    let _ = (encoded::decode_jpeg(bytes, true), encoded::decode_mask(bytes));
}

/// Reads calibration files.
pub fn camera_file(text: &str) {
    import::parse_calibration(text);
}

/// Reads pictures, messages and lists of other programs' recordings.
pub fn recording(bytes: &[u8]) {
    import::parse_recording(bytes);
}

/// Reads `subject.toml` and `pending.toml`.
pub fn subject(text: &str) {
    subject::parse(text);
}

/// Pairs times that rise.
pub fn pair_by_time(a: &[i64], b: &[i64]) {
    let partner = associate(a, b, 20_000_000);
    let mut used: Vec<usize> = partner.into_iter().flatten().collect();
    let count = used.len();
    used.sort_unstable();
    used.dedup();
    assert_eq!(used.len(), count, "a partner was given twice");
}

/// Reads frame numbers and times from a name.
pub fn image_name(name: &str) {
    import::parse_name(name);
}
