//! The virtual device keeps the promises of sources.

use toile_capture::Source;
use toile_driver_synthetic::SyntheticDevice;
use toile_synthetic::SyntheticSettings;

fn settings() -> SyntheticSettings {
    SyntheticSettings { garments: Vec::new(), frames: 8, ..SyntheticSettings::default() }
}

#[test]
fn dropped_frames_are_counted_and_numbers_go_on() {
    let mut device = SyntheticDevice::open(&settings(), 0).unwrap().dropping([0, 3, 4]);
    assert!(device.serial().starts_with("SYN-"));
    assert_eq!(device.frame_count(), Some(5));
    let mut seen = Vec::new();
    while let Some(frame) = device.next_frame().unwrap() {
        seen.push((frame.index, frame.device_frame, frame.lost_before));
    }
    assert_eq!(seen, [(0, 1, 1), (1, 2, 0), (2, 5, 2), (3, 6, 0), (4, 7, 0)]);
}

#[test]
fn unplugging_is_an_error_once_and_then_the_end() {
    let mut device = SyntheticDevice::open(&settings(), 0).unwrap().unplugged_at(1);
    assert!(device.next_frame().unwrap().is_some());
    let error = device.next_frame().unwrap_err().to_string();
    assert!(error.contains("SYN-") && error.contains("plug"), "{error}");
    assert!(device.next_frame().unwrap().is_none());
}

#[test]
fn times_rise_and_wrong_takes_are_refused() {
    let mut device = SyntheticDevice::open(&settings(), 0).unwrap();
    let mut last = 0;
    while let Some(frame) = device.next_frame().unwrap() {
        assert!(frame.device_time_ns > last && frame.host_time_ns > frame.device_time_ns);
        last = frame.device_time_ns;
    }
    let error = SyntheticDevice::open(&settings(), 3).unwrap_err().to_string();
    assert!(error.contains("take 3"), "{error}");
}
