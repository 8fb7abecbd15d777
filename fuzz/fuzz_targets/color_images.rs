//! Colour images: JPEG and PNG, as replay decodes them and as `inspect` checks them.
#![no_main]

use libfuzzer_sys::fuzz_target;
use toile_capture::{ColorImage, fuzzing};

fuzz_target!(|bytes: &[u8]| {
    fuzzing::color_image(bytes);
    let _ = ColorImage::Jpeg(bytes.into()).decode(0);
    let _ = ColorImage::Png(bytes.into()).decode(0);
});
