//! Files written here record by record from the format's public source.

use std::fs;

use super::*;
use crate::Source;

fn record(kind: u32, node: u32, fields: &[u8], payload: &[u8]) -> Vec<u8> {
    let head = [0x0052_494e, kind, node, 28 + fields.len() as u32, payload.len() as u32];
    let head: Vec<u8> = head.iter().flat_map(|word| word.to_le_bytes()).collect();
    [head, vec![0; 8], fields.to_vec(), payload.to_vec()].concat()
}

fn text(text: &str) -> Vec<u8> {
    [(text.len() as u32 + 1).to_le_bytes().to_vec(), text.as_bytes().to_vec(), vec![0]].concat()
}

fn added(node: u32, kind: u32, codec: &str) -> Vec<u8> {
    let fields = [text("Stream"), kind.to_le_bytes().to_vec(), codec.as_bytes().to_vec(), vec![0xff; 28]].concat();
    record(0x0d, node, &fields, &[])
}

fn integer(node: u32, name: &str, value: u64) -> Vec<u8> {
    record(3, node, &[text(name), 8_u32.to_le_bytes().to_vec(), value.to_le_bytes().to_vec()].concat(), &[])
}

fn general(node: u32, name: &str, value: &[u8]) -> Vec<u8> {
    record(6, node, &[text(name), (value.len() as u32).to_le_bytes().to_vec(), value.to_vec()].concat(), &[])
}

fn picture(node: u32, time_us: u64, frame: u32, payload: &[u8]) -> Vec<u8> {
    record(0x0a, node, &[time_us.to_le_bytes().to_vec(), frame.to_le_bytes().to_vec()].concat(), payload)
}

fn mode(node: u32, words: [u32; 3]) -> Vec<u8> {
    general(node, "xnMapOutputMode", &words.iter().flat_map(|word| word.to_le_bytes()).collect::<Vec<u8>>())
}

/// 4 × 2 pixels at 30 a second: depth in two packings, mirrored or not, and raw colour; the third frame of four is missing.
fn recording(codec: &str, mirror: u64, registration: u64) -> Vec<u8> {
    let view: Vec<u8> = [1.0_f64, 0.5].iter().flat_map(|angle| angle.to_le_bytes()).collect();
    let depth = |first: u16| -> Vec<u8> {
        match codec {
            // The first value and seven steps of one up: two halves of 5 in a byte, and one alone.
            "16zP" => [&first.to_le_bytes()[..], &[0x55, 0x55, 0x55, 0x5d]].concat(),
            _ => (0..8).flat_map(|k| (first + k).to_le_bytes()).collect(),
        }
    };
    let color: Vec<u8> = (0..24).collect();
    let mut bytes = [&b"NI10"[..], &[1, 0, 1, 0, 0, 0, 0, 0], &[0; 12]].concat();
    for part in [
        added(0, 1, "NONE"),
        added(1, DEPTH, codec),
        mode(1, [4, 2, 30]),
        general(1, "xnFOV", &view),
        integer(1, "xnMirror", mirror),
        integer(1, "Registration", registration),
        added(2, COLOR, "NONE"),
        mode(2, [4, 2, 30]),
        integer(2, "xnPixelFormat", 1),
        integer(2, "xnMirror", mirror),
        record(0x08, 1, &[0; 12], &[]),
        picture(1, 1_000_000, 1, &depth(1000)),
        picture(2, 1_001_000, 1, &color),
        picture(1, 1_033_333, 2, &depth(2000)),
        record(0x0e, 1, &[], &[7; 40]),
        picture(1, 1_100_000, 4, &depth(3000)),
        record(0x0b, 0, &[], &[]),
    ] {
        bytes.extend(part);
    }
    bytes
}

fn opened(bytes: &[u8]) -> Result<StoredSource, String> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("take.oni");
    fs::write(&path, bytes).unwrap();
    assert_eq!(crate::import::guess(&path).unwrap(), crate::import::Format::Oni);
    open(&path).map_err(|error| error.to_string())
}

#[test]
fn raw_and_packed_depth_are_the_same_and_mirrored_pictures_are_turned_back() {
    for (codec, mirror) in [("NONE", 0), ("16zP", 0), ("NONE", 1), ("16zP", 1)] {
        let mut source = opened(&recording(codec, mirror, 1)).unwrap();
        let sensor = source.rig().sensors[0].clone();
        assert!(
            (sensor.depth.fx - 2.0 / 0.5_f64.tan()).abs() < 1e-9
                && (sensor.depth.fy - 1.0 / 0.25_f64.tan()).abs() < 1e-9
        );
        assert_eq!((sensor.depth.cx, sensor.depth.cy, sensor.depth_scale), (1.5, 0.5, 0.001));
        assert!(source.remarks().is_empty() && sensor.assumption().is_none());
        let frame = source.next_frame().unwrap().unwrap();
        let values = frame.depth.unwrap().values.clone();
        let color = frame.color.unwrap().decode(0).unwrap();
        if mirror == 1 {
            assert_eq!((&values[..5], color.pixels[0]), (&[1003, 1002, 1001, 1000, 1007][..], [9, 10, 11]), "{codec}");
        } else {
            assert_eq!((&values[..5], color.pixels[0]), (&[1000, 1001, 1002, 1003, 1004][..], [0, 1, 2]), "{codec}");
        }
        let rest: Vec<_> = std::iter::from_fn(|| source.next_frame().unwrap()).collect();
        let seen: Vec<_> = rest.iter().map(|f| (f.device_time_ns, f.lost_before, f.color.is_some())).collect();
        assert_eq!(seen, [(1_033_333_000, 0, false), (1_100_000_000, 1, false)]);
    }
}

#[test]
fn what_is_missing_or_torn_is_said() {
    let whole = recording("NONE", 0, 0);
    let source = opened(&whole).unwrap();
    assert!(source.remarks()[0].contains("does not say that depth is registered"), "{:?}", source.remarks());
    assert!(source.rig().sensors[0].color.is_none());
    let torn = opened(&whole[..whole.len() - 40]).unwrap();
    assert!(torn.remarks()[0].contains("ends in the middle") && torn.frame_count() == Some(2), "{:?}", torn.remarks());
    assert!(opened(&whole[..60]).unwrap_err().contains("no depth pictures"));
    let told = opened(&recording("xyzw", 0, 0)).unwrap_err();
    assert!(told.contains("`xyzw`"), "{told}");
}
