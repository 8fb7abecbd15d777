//! Payloads to pictures, pure.

/// A picture as it was sent.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Sent {
    /// Its bytes.
    pub picture: Vec<u8>,
    /// Headers of its payloads where they differ, each behind eight bytes of host time and two of the bus' frame number
    /// (`struct uvc_meta_buf` of `linux/uvcvideo.h`).
    pub metadata: Vec<u8>,
    /// The driver's number.
    pub sequence: u32,
    /// Bytes are missing or were damaged.
    pub is_damaged: bool,
    /// When its first payload came.
    pub time_ns: i64,
}

/// Payloads to pictures.
#[derive(Debug, Clone)]
pub struct Assembler {
    /// Bytes of every picture; 0 for those that differ (JPEG).
    size: usize,
    /// Room of a buffer.
    room: usize,
    whole_headers: bool,
    last_id: Option<bool>,
    sequence: u32,
    last_clock: Vec<u8>,
    begun: Option<Sent>,
}

/// Bits of a payload's header (UVC 1.1, table 2-5).
const FRAME_ID: u8 = 0x01;
const END: u8 = 0x02;
const HAS_TIME: u8 = 0x04;
const HAS_CLOCK: u8 = 0x08;
const ERROR: u8 = 0x40;
/// Room of a metadata buffer (`UVC_METADATA_BUF_SIZE` of `uvcvideo.h`).
const METADATA_ROOM: usize = 10_240;

impl Assembler {
    /// For pictures of `size` bytes (0: of any size), in buffers of `room`; `whole_headers`: metadata has all of them.
    pub fn new(size: usize, room: usize, whole_headers: bool) -> Self {
        Self { size, room, whole_headers, last_id: None, sequence: 0, last_clock: Vec::new(), begun: None }
    }

    /// Takes a payload that came at `time_ns`; gives the pictures that it ends.
    pub fn push(&mut self, payload: &[u8], time_ns: i64) -> Vec<Sent> {
        let mut done = Vec::new();
        let [length, flags, ..] = *payload else { return done };
        let Some((header, data)) = payload.split_at_checked(usize::from(length)).filter(|_| length >= 2) else {
            return done;
        };
        let id = flags & FRAME_ID != 0;
        if self.last_id != Some(id) {
            done.extend(self.end());
            self.sequence = self.sequence.wrapping_add(u32::from(self.last_id.is_some()));
            self.last_id = Some(id);
            self.begun = Some(Sent { sequence: self.sequence, time_ns, ..Sent::default() });
        }
        // What comes after a picture's end with its number belongs to none.
        let Some(sent) = &mut self.begun else { return done };
        sent.is_damaged |= flags & ERROR != 0;
        let fits = data.len().min(self.room.saturating_sub(sent.picture.len()));
        sent.picture.extend(&data[..fits]);
        sent.is_damaged |= fits < data.len();
        self.keep(header, flags, time_ns);
        if flags & END != 0 && self.begun.as_ref().is_some_and(|s| !s.picture.is_empty()) {
            done.extend(self.end());
        }
        done
    }

    /// A packet was damaged on the bus.
    pub fn damage(&mut self) {
        self.begun.iter_mut().for_each(|sent| sent.is_damaged = true);
    }

    fn end(&mut self) -> Option<Sent> {
        let mut sent = self.begun.take()?;
        sent.is_damaged |= self.size != 0 && sent.picture.len() != self.size;
        Some(sent)
    }

    /// `uvc_video_decode_meta`.
    fn keep(&mut self, header: &[u8], flags: u8, time_ns: i64) {
        let Some(sent) = &mut self.begun else { return };
        let clock = if flags & HAS_TIME != 0 { 6 } else { 2 };
        let standard = clock + if flags & HAS_CLOCK != 0 { 6 } else { 0 };
        let header = if self.whole_headers { header } else { &header[..header.len().min(standard)] };
        let is_known = flags & HAS_CLOCK == 0 || header.get(clock..standard) == Some(&self.last_clock);
        if header.len() <= 2 || header.len() == standard && is_known {
            return;
        }
        self.last_clock = header.get(clock..standard).unwrap_or_default().to_vec();
        if sent.metadata.len() + header.len() + 10 <= METADATA_ROOM {
            sent.metadata.extend(time_ns.to_ne_bytes());
            sent.metadata.extend([0, 0]);
            sent.metadata.extend(header);
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn payload(flags: u8, data: &[u8]) -> Vec<u8> {
        [&[2, flags][..], data].concat()
    }

    #[test]
    fn pictures_end_by_their_last_payload_or_by_the_next_picture() {
        let mut assembler = Assembler::new(4, 4, false);
        assert!(assembler.push(&payload(0, &[1, 2]), 5).is_empty());
        let whole = assembler.push(&payload(2, &[3, 4]), 6);
        assert_eq!((whole[0].picture.as_slice(), whole[0].sequence, whole[0].time_ns), (&[1, 2, 3, 4][..], 0, 5));
        assert!(!whole[0].is_damaged);
        // Stragglers of the picture that has ended, then one that breaks off.
        assert!(assembler.push(&payload(2, &[9]), 7).is_empty());
        assert!(assembler.push(&payload(1, &[5]), 8).is_empty());
        let torn = assembler.push(&payload(0, &[6]), 9);
        assert!(torn[0].is_damaged && torn[0].sequence == 1 && torn[0].picture == [5]);
        // Too much for the buffer.
        let long = assembler.push(&payload(2, &[6; 9]), 9);
        assert!(long[0].is_damaged && long[0].picture.len() == 4);
    }

    proptest! {
        #[test]
        fn no_bytes_upset_the_parsers(
            payloads in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..90), 0..40),
            lengths in prop::collection::vec((2..14u8, 0..=255u8), 0..40),
            whole in any::<bool>(),
        ) {
            crate::simulated::uvc::functions(&payloads.concat());
            let mut assembler = Assembler::new(64, 64, whole);
            for (i, payload) in payloads.iter().enumerate() {
                // Half of them have a header that may be one.
                let likely = lengths.get(i).filter(|_| i % 2 == 0);
                let header = likely.map(|(length, flags)| vec![*length, *flags]).unwrap_or_default();
                for sent in assembler.push(&[header, payload.clone()].concat(), 0) {
                    prop_assert!(sent.picture.len() <= 64 && sent.metadata.len() <= METADATA_ROOM);
                    prop_assert!(sent.is_damaged || sent.picture.len() == 64);
                }
            }
        }
    }

    #[test]
    fn headers_that_say_nonsense_are_left_out() {
        let mut assembler = Assembler::new(2, 2, false);
        for bytes in [&[][..], &[2], &[0, 0, 1], &[1, 0, 1], &[9, 0, 1, 1]] {
            assert!(assembler.push(bytes, 0).is_empty(), "{bytes:?}");
        }
        assert!(assembler.push(&payload(ERROR | END, &[1, 2]), 0)[0].is_damaged);
    }

    #[test]
    fn a_header_that_repeats_the_clock_is_kept_once_and_a_longer_one_always() {
        let header = [12, HAS_TIME | HAS_CLOCK, 1, 0, 0, 0, 2, 0, 0, 0, 3, 0];
        let long = [&[14][..], &header[1..], &[7, 7]].concat();
        let metadata = |whole| {
            let mut assembler = Assembler::new(0, 9, whole);
            [&header[..], &header, &long].into_iter().for_each(|h| drop(assembler.push(&[h, &[1]].concat(), 0)));
            assembler.end().unwrap().metadata.len()
        };
        assert_eq!((metadata(false), metadata(true)), (22, 22 + 24));
    }
}
