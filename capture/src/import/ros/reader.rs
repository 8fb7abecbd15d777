//! Numbers, texts and lists of messages: ROS 1 without padding, ROS 2 (CDR) aligned to their own size.

/// How messages are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Coding {
    /// ROS 1: little-endian, packed.
    Ros1,
    /// ROS 2: CDR, little-endian, aligned, behind four bytes that say so.
    Cdr,
}

/// Reads a message from its start; every method gives `None` where it is too short.
pub(super) struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    coding: Coding,
}

impl<'a> Reader<'a> {
    /// At the start of a message; `None` where CDR is of another kind than little-endian.
    pub(super) fn new(bytes: &'a [u8], coding: Coding) -> Option<Self> {
        match coding {
            Coding::Ros1 => Some(Self { bytes, at: 0, coding }),
            Coding::Cdr => {
                let (head, bytes) = bytes.split_at_checked(4)?;
                (head[0] == 0 && head[1] & 1 == 1).then_some(Self { bytes, at: 0, coding })
            }
        }
    }

    pub(super) fn is_ros1(&self) -> bool {
        self.coding == Coding::Ros1
    }

    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let taken = self.bytes.get(self.at..self.at.checked_add(count)?)?;
        self.at += count;
        Some(taken)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        if self.coding == Coding::Cdr {
            self.at = self.at.next_multiple_of(N);
        }
        self.take(N)?.try_into().ok()
    }

    pub(super) fn u8(&mut self) -> Option<u8> {
        self.array::<1>().map(|b| b[0])
    }

    pub(super) fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    pub(super) fn f32(&mut self) -> Option<f32> {
        self.array().map(f32::from_le_bytes)
    }

    pub(super) fn f64(&mut self) -> Option<f64> {
        self.array().map(f64::from_le_bytes)
    }

    pub(super) fn f64s<const N: usize>(&mut self) -> Option<[f64; N]> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.f64()?;
        }
        Some(values)
    }

    /// A list of doubles, of which a calibration has a few.
    pub(super) fn f64_list(&mut self) -> Option<Vec<f64>> {
        let count = self.u32()?;
        (count <= 64).then(|| (0..count).map(|_| self.f64()).collect())?
    }

    pub(super) fn bytes(&mut self) -> Option<&'a [u8]> {
        let count = self.u32()? as usize;
        self.take(count)
    }

    pub(super) fn text(&mut self) -> Option<&'a str> {
        let bytes = self.bytes()?;
        // CDR counts the zero at the end.
        std::str::from_utf8(bytes.strip_suffix(&[0]).unwrap_or(bytes)).ok()
    }

    /// A message's header: its time, nanoseconds, and its frame's name.
    pub(super) fn header(&mut self) -> Option<(i64, &'a str)> {
        if self.is_ros1() {
            self.u32()?;
        }
        let (seconds, nanoseconds) = (self.u32()?, self.u32()?);
        Some((i64::from(seconds) * 1_000_000_000 + i64::from(nanoseconds), self.text()?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cdr_is_aligned_behind_its_head_and_ros1_is_packed() {
        let packed = [7, 1, 0, 0, 0, b'a', 2, 0, 0, 0];
        let mut reader = Reader::new(&packed, Coding::Ros1).unwrap();
        assert_eq!((reader.u8(), reader.text(), reader.u32(), reader.u8()), (Some(7), Some("a"), Some(2), None));
        let aligned = [0, 1, 0, 0, 7, 9, 9, 9, 2, 0, 0, 0, b'a', 0, 9, 9, 2, 0, 0, 0];
        let mut reader = Reader::new(&aligned, Coding::Cdr).unwrap();
        assert_eq!((reader.u8(), reader.text(), reader.u32(), reader.u8()), (Some(7), Some("a"), Some(2), None));
        assert!(Reader::new(&[0, 0, 0, 0], Coding::Cdr).is_none(), "big-endian");
        assert!(Reader::new(&[255, 255, 255, 255], Coding::Ros1).unwrap().text().is_none());
    }
}
