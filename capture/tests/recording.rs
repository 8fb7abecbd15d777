//! Recordings: round trip, determinism, torn and foreign files.
#![allow(clippy::unwrap_used)]

mod common;

use std::{fs, path::Path};

use common::{all_frames, frame, record_frames, rig};
use toile_capture::{
    CaptureError, DepthEncoding, Frame, Recorder, RecorderOptions, Replay, Rig, Source, depth_codec, export_standard,
};

fn plain() -> RecorderOptions {
    RecorderOptions::default()
}

#[test]
fn replay_gives_back_every_frame_in_any_order() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("take.mcap");
    let written = record_frames(&path, 12, 2, 3000);
    let mut replay = Replay::open(&path).unwrap();
    assert_eq!(replay.rig(), &rig(2), "the rig must come back to the last bit");
    assert_eq!(replay.lost(), None);
    assert_eq!(replay.frame_count(), Some(12));
    assert_eq!(all_frames(&mut replay).unwrap(), written);
    for index in [11, 0, 5, 5, 7] {
        assert_eq!(replay.frame(index).unwrap(), written[index as usize]);
        let info = replay.info(index).unwrap();
        assert_eq!(info.has_depth, index != 5);
        assert_eq!(info.device_frame, 100 + 2 * index);
    }
    assert!(replay.frame(12).is_err());
    replay.seek(10);
    assert_eq!(all_frames(&mut replay).unwrap(), written[10..]);
}

#[test]
fn the_same_frames_give_the_same_bytes_also_through_replay() {
    let folder = tempfile::tempdir().unwrap();
    let [a, b, c] = ["a.mcap", "b.mcap", "c.mcap"].map(|name| folder.path().join(name));
    record_frames(&a, 9, 2, 2500);
    record_frames(&b, 9, 2, 2500);
    let mut replay = Replay::open(&a).unwrap();
    let rig = replay.rig().clone();
    let mut recorder = Recorder::create(&c, &rig, RecorderOptions { chunk_bytes: 2500, ..plain() }).unwrap();
    all_frames(&mut replay).unwrap().iter().for_each(|frame| recorder.write(frame).unwrap());
    recorder.finish().unwrap();
    let bytes = [a, b, c].map(|path| fs::read(path).unwrap());
    assert!(bytes[0] == bytes[1], "recording twice differs");
    assert!(bytes[0] == bytes[2], "recording a replay differs");
}

#[test]
fn every_torn_length_is_read_to_its_last_whole_chunk_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("take.mcap");
    let written = record_frames(&path, 5, 1, 1200);
    let file = fs::OpenOptions::new().write(true).open(&path).unwrap();
    let mut most = written.len();
    for length in (0..file.metadata().unwrap().len()).rev() {
        file.set_len(length).unwrap();
        match Replay::open(&path) {
            Ok(mut replay) => {
                let frames = all_frames(&mut replay).unwrap();
                assert!(frames == written[..frames.len()], "{length} bytes: other frames");
                assert!(frames.len() <= most, "{length} bytes give more frames than a longer file");
                most = frames.len();
                let complete = most == written.len();
                assert!(complete || replay.lost().is_some_and(|loss| loss.torn), "{length} bytes: silent loss");
                let unread = replay.lost().map_or(0, |loss| loss.bytes);
                assert!(unread < 4000, "{length} bytes: more than one chunk is unread: {unread}");
            }
            Err(error) => {
                most = 0;
                assert!(length < 6000, "{length} bytes are refused: {error}");
                assert!(!error.to_string().contains('\n'));
            }
        }
    }
    assert_eq!(most, 0);
}

#[test]
fn damaged_chunks_are_left_out_and_reported() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("take.mcap");
    let written = record_frames(&path, 8, 1, 1200);
    let mut bytes = fs::read(&path).unwrap();
    // Frame 2 is the first raw colour image: its chunk declares that channel, which frame 6 needs too.
    let raw = bytes.windows(6).position(|w| w == [0, 2, 7, 1, 2, 7]).expect("the pixels of frame 2");
    bytes[raw] ^= 0x55;
    fs::write(&path, bytes).unwrap();
    let mut replay = Replay::open(&path).unwrap();
    let loss = replay.lost().expect("the damage is noticed").clone();
    let frames = all_frames(&mut replay).unwrap();
    assert!(frames.len() < written.len() && !frames.is_empty());
    assert_eq!((loss.damaged_chunks, loss.torn), (1, false));
    assert_eq!(loss.missing_frames, (written.len() - frames.len()) as u64);
    let original =
        |frame: &toile_capture::Frame| written.iter().find(|w| w.device_frame == frame.device_frame).cloned();
    for frame in &frames {
        let mut expected = original(frame).expect("a frame that was written");
        expected.index = frame.index;
        assert!(*frame == expected, "frame {} differs", frame.index);
    }
}

/// Replays a file of these bytes: rig and frames, and whether a loss is reported; an error where it is not readable.
fn replayed(path: &Path, bytes: &[u8]) -> Result<(Rig, Vec<Frame>, bool), CaptureError> {
    fs::write(path, bytes).unwrap();
    let mut replay = Replay::open(path)?;
    let frames = all_frames(&mut replay)?;
    Ok((replay.rig().clone(), frames, replay.lost().is_some()))
}

#[test]
fn flipped_bytes_never_panic_or_lie() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("take.mcap");
    let written = record_frames(&path, 3, 1, 1200);
    let bytes = fs::read(&path).unwrap();
    let (mut silent, mut noticed) = (0, 0);
    for at in 0..bytes.len() {
        let mut damaged = bytes.clone();
        damaged[at] ^= if at % 2 == 0 { 0xff } else { 1 << (at % 8) };
        match replayed(&path, &damaged) {
            Ok((same_rig, frames, false)) => {
                silent += 1;
                assert!(same_rig == rig(1) && frames == written, "byte {at} of {}: silent damage", bytes.len());
            }
            Ok((_, _, true)) | Err(_) => noticed += 1,
        }
    }
    // Everything is read up to the end of the data; the summary behind it only helps other programs.
    assert!(noticed > silent && silent > 0, "{noticed} were noticed, {silent} had no effect");
}

#[test]
fn swapped_and_repeated_pieces_never_panic_or_lie() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("take.mcap");
    let written = record_frames(&path, 4, 1, 1200);
    let bytes = fs::read(&path).unwrap();
    for (from, to, length) in (0..bytes.len()).step_by(97).map(|at| (at, (at * 7919) % bytes.len(), 1 + at % 300)) {
        let mut damaged = bytes.clone();
        let piece = bytes[from..(from + length).min(bytes.len())].to_vec();
        let end = (to + piece.len()).min(damaged.len());
        damaged.splice(to..end, piece);
        if let Ok((same_rig, frames, false)) = replayed(&path, &damaged) {
            assert!(same_rig == rig(1) && frames == written, "{length} bytes from {from} to {to}: silent damage");
        }
    }
}

/// A chunk record around zstd-packed records, its head claiming `claimed` unpacked bytes.
fn zstd_chunk(records: &[u8], claimed: u64) -> Vec<u8> {
    let packed = zstd::bulk::compress(records, 1).unwrap();
    let mut body = vec![0; 16];
    body.extend(claimed.to_le_bytes());
    body.extend(0_u32.to_le_bytes());
    body.extend([4, 0, 0, 0]);
    body.extend(b"zstd");
    body.extend((packed.len() as u64).to_le_bytes());
    body.extend(packed);
    let mut record = vec![6];
    record.extend((body.len() as u64).to_le_bytes());
    record.extend(body);
    record
}

#[test]
fn a_small_chunk_that_unpacks_to_a_huge_one_is_refused_and_a_lie_about_its_size_is_damage() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("take.mcap");
    record_frames(&path, 3, 1, 1200);
    let bytes = fs::read(&path).unwrap();
    let with_chunk = |chunk: &[u8]| {
        // Behind the magic bytes and the header record.
        let head = 8 + 9 + u64::from_le_bytes(bytes[9..17].try_into().unwrap()) as usize;
        [&bytes[..head], chunk, &bytes[head..]].concat()
    };
    let huge = zstd_chunk(&vec![0; 129 << 20], 129 << 20);
    let error = replayed(&path, &with_chunk(&huge)).unwrap_err().to_string();
    assert!(error.contains("129 MiB") && error.contains("at most 128 MiB") && error.contains("take.mcap"), "{error}");
    for claimed in [u64::MAX, 1 << 40, 129 << 20, 0] {
        let (_, frames, is_lost) = replayed(&path, &with_chunk(&zstd_chunk(&[1; 100], claimed))).unwrap();
        assert!(is_lost && frames.len() == 3, "claimed {claimed}");
    }
    // Lengths whose sum overflows 64 bits.
    let mut chunk = zstd_chunk(&[1; 100], 100);
    chunk[9 + 36..9 + 44].copy_from_slice(&u64::MAX.to_le_bytes());
    let (_, frames, is_lost) = replayed(&path, &with_chunk(&chunk)).unwrap();
    assert!(is_lost && frames.len() == 3);
}

#[test]
fn a_pipe_is_not_waited_for_and_a_link_under_the_temporary_name_is_not_followed() {
    let folder = tempfile::tempdir().unwrap();
    let [pipe, outside, take] = ["pipe.mcap", "outside", "take.mcap"].map(|name| folder.path().join(name));
    let mode = rustix::fs::Mode::RUSR | rustix::fs::Mode::WUSR;
    rustix::fs::mknodat(rustix::fs::CWD, &pipe, rustix::fs::FileType::Fifo, mode, 0).unwrap();
    assert!(message(Replay::open(&pipe).map(|_| ())).contains("not a regular file"));
    fs::write(&outside, b"precious").unwrap();
    for replace_part in [true, false] {
        std::os::unix::fs::symlink(&outside, folder.path().join("take.mcap.part")).unwrap();
        let options = RecorderOptions { replace_part, ..plain() };
        let mut recorder = Recorder::create(&take, &rig(1), options.clone()).unwrap();
        recorder.write(&frame(0, 1)).unwrap();
        assert!(matches!(Recorder::create(&take, &rig(1), options), Err(CaptureError::Busy { .. })));
        recorder.finish().unwrap();
        fs::remove_file(&take).unwrap();
    }
    assert_eq!(fs::read(&outside).unwrap(), b"precious");
}

#[test]
fn an_unfinished_recording_stays_as_part_and_is_readable() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("take.mcap");
    let part = folder.path().join("take.mcap.part");
    let write = |count: u64| {
        let mut recorder = Recorder::create(&path, &rig(1), RecorderOptions { chunk_bytes: 1, ..plain() }).unwrap();
        (0..count).for_each(|i| recorder.write(&frame(i, 1)).unwrap());
    };
    write(3);
    assert!(!path.exists() && part.exists());
    assert_eq!(Replay::open(&part).unwrap().len(), 3);
    write(2);
    assert_eq!(Replay::open(&folder.path().join("take.mcap.part.1")).unwrap().len(), 3, "the older one is kept");
    assert_eq!(Replay::open(&part).unwrap().len(), 2);
}

#[test]
fn a_recording_that_can_be_made_again_leaves_nothing_where_it_is_not_finished() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("take.mcap");
    let rig = rig(1);
    for (replace_part, left) in [(false, 1), (true, 0)] {
        let options = RecorderOptions { replace_part, ..plain() };
        drop(Recorder::create(&path, &rig, options).unwrap());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), left);
    }
}

#[test]
fn a_power_cut_while_recording_leaves_whole_chunks() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("take.mcap");
    let options = RecorderOptions { chunk_bytes: 1, ..plain() };
    let mut recorder = Recorder::create(&path, &rig(1), options).unwrap();
    (0..4).for_each(|i| recorder.write(&frame(i, 1)).unwrap());
    let copy = folder.path().join("copy.mcap.part");
    fs::copy(folder.path().join("take.mcap.part"), &copy).unwrap();
    let replay = Replay::open(&copy).unwrap();
    assert_eq!(replay.len(), 4);
    let loss = replay.lost().expect("an unclosed file may have lost frames");
    assert!(loss.torn && loss.to_string().contains("not closed"), "{loss}");
}

#[test]
fn finished_recordings_are_never_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("take.mcap");
    record_frames(&path, 1, 1, 1000);
    let before = fs::read(&path).unwrap();
    assert!(message(Recorder::create(&path, &rig(1), plain()).map(|_| ())).contains("exists already"));
    assert_eq!(fs::read(&path).unwrap(), before);
}

#[test]
fn frames_that_do_not_fit_the_rig_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("take.mcap");
    let mut recorder = Recorder::create(&path, &rig(1), plain()).unwrap();
    let good = frame(0, 1);
    let mut other = good.clone();
    other.sensor = 3;
    assert!(message(recorder.write(&other)).contains("sensor 3"));
    let mut none = good.clone();
    (none.depth, none.color) = (None, None);
    assert!(message(recorder.write(&none)).contains("neither depth nor colour"));
    let mut small = good.clone();
    small.depth = Some(toile_capture::DepthImage { width: 2, height: 1, values: vec![1, 2] }.into());
    assert!(message(recorder.write(&small)).contains("2 x 1"));
    recorder.write(&good).unwrap();
    assert_eq!(recorder.finish().unwrap().frames, 1);
}

#[test]
fn rigs_that_cannot_be_recorded_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("take.mcap");
    let mut twins = rig(2);
    twins.sensors[1].name = twins.sensors[0].name.clone();
    let mut blind = rig(1);
    blind.sensors[0].depth.fx = 0.0;
    let mut flat = rig(1);
    flat.sensors[0].depth_scale = f64::NAN;
    for (rig, expected) in [(rig(0), "at least one"), (twins, "two sensors"), (blind, "calibration"), (flat, "scale")] {
        assert!(message(Recorder::create(&path, &rig, plain()).map(|_| ())).contains(expected));
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "a refused rig leaves nothing behind");
}

#[test]
fn empty_and_foreign_files_get_one_clear_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.mcap");
    let open = |bytes: &[u8]| {
        fs::write(&path, bytes).unwrap();
        message(Replay::open(&path).map(|_| ()))
    };
    assert!(open(b"").contains("empty"));
    assert!(open(b"\x89PNG\r\n\x1a\nhello").contains("not an MCAP"));
    assert!(open(b"\x89MCAP0\r\n").contains("cut off"));
    let mut foreign = mcap::Writer::new(std::io::Cursor::new(Vec::new())).unwrap();
    foreign.add_channel(0, "/chatter", "json", &Default::default()).unwrap();
    foreign.finish().unwrap();
    assert!(open(&foreign.into_inner().into_inner()).contains("neither a recording of Toile's"));
    Recorder::create(&folder.path().join("none.mcap"), &rig(1), plain()).unwrap().finish().unwrap();
    assert!(message(Replay::open(&folder.path().join("none.mcap")).map(|_| ())).contains("no frames"));
    assert!(message(Replay::open(folder.path()).map(|_| ())).contains("folder"));
    assert!(message(Replay::open(Path::new("/nowhere/x.mcap")).map(|_| ())).contains("/nowhere/x.mcap"));
}

#[test]
fn standard_export_holds_the_same_frames_as_16uc1() {
    let folder = tempfile::tempdir().unwrap();
    let [packed, standard] = ["packed.mcap", "standard.mcap"].map(|name| folder.path().join(name));
    let written = record_frames(&packed, 6, 1, 2000);
    assert_eq!(export_standard(&packed, &standard).unwrap().frames, 6);
    assert_eq!(all_frames(&mut Replay::open(&standard).unwrap()).unwrap(), written);
    // With the `mcap` crate's own reader, as an outside program would.
    let bytes = fs::read(&standard).unwrap();
    let mut images = 0;
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        let schema = message.channel.schema.as_ref().unwrap();
        assert_eq!((schema.encoding.as_str(), message.channel.message_encoding.as_str()), ("protobuf", "protobuf"));
        images += u64::from(message.channel.topic == "/camera0/depth/image");
        assert_ne!(schema.name, "toile.CompressedDepth");
        if message.channel.topic == "/camera0/depth/image" {
            assert_eq!(schema.name, "foxglove.RawImage");
            assert_eq!(
                message.publish_time,
                written[usize::from(message.sequence as u16 - 100) / 2].device_time_ns as u64
            );
        }
    }
    assert_eq!(images, 5);
}

#[test]
fn both_depth_encodings_and_the_codec_agree() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("raw.mcap");
    let options = RecorderOptions { depth: DepthEncoding::Raw, ..plain() };
    let mut recorder = Recorder::create(&path, &rig(1), options).unwrap();
    recorder.write(&frame(2, 1)).unwrap();
    recorder.finish().unwrap();
    let depth = Replay::open(&path).unwrap().frame(0).unwrap().depth.unwrap();
    assert_eq!(depth_codec::decode(&depth_codec::encode(&depth).unwrap()).unwrap(), *depth);
    assert_eq!(depth, frame(2, 1).depth.unwrap());
}

fn message(result: Result<(), CaptureError>) -> String {
    result.expect_err("an error was expected").to_string()
}
