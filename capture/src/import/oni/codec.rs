//! OpenNI's packed depth, `16zP` and `16zT`: differences of neighbours in halves of bytes.
//!
//! A byte below 0xe0 holds two differences of up to 6 (a half from 0 to 12 says 6 minus it); its lower half may say instead that
//! there is none (13) or that a larger step follows (15). Bytes 0xe1 to 0xef say how many pairs repeat the value; 0xff says that a
//! larger step follows. A larger step is a byte with its highest bit set (192 minus the difference), or else a value of two bytes, the
//! higher one first. `16zT` packs places in a table of the values that occur, which stands before.

/// Unpacks `count` values; `has_table` for `16zT`.
///
/// # Errors
/// What is wrong with the bytes.
pub(super) fn unpack(bytes: &[u8], has_table: bool, count: usize) -> Result<Vec<u16>, String> {
    const CUT: &str = "is cut off in the middle of its packed values";
    let word = |at: usize| bytes.get(at..at + 2).map(|b| u16::from_le_bytes([b[0], b[1]]));
    let mut at = 0;
    let mut table = None;
    if has_table {
        let size = usize::from(word(0).ok_or(CUT)?);
        let values: Option<Vec<u16>> = (0..size).map(|k| word(2 + 2 * k)).collect();
        table = Some(values.ok_or(CUT)?);
        at = 2 + 2 * size;
    }
    let first = word(at).ok_or(CUT)?;
    let packed = &bytes[at + 2..];
    let mut values = vec![first];
    Packed { bytes: packed, last: first, values: &mut values, count }
        .read()
        .ok_or_else(|| "holds more values than its picture has pixels, or ends in the middle of one".to_string())?;
    if values.len() != count {
        return Err(format!("unpacks to {} values, but its picture has {count} pixels", values.len()));
    }
    let Some(table) = table else { return Ok(values) };
    let real: Option<Vec<u16>> = values.iter().map(|place| table.get(usize::from(*place)).copied()).collect();
    real.ok_or_else(|| "names a value that its table does not have".into())
}

struct Packed<'a> {
    bytes: &'a [u8],
    last: u16,
    values: &'a mut Vec<u16>,
    count: usize,
}

impl Packed<'_> {
    /// Reads all; `None` where the bytes end within a step or give too many values.
    fn read(mut self) -> Option<()> {
        while let Some(byte) = self.next() {
            match byte {
                0xff => self.large_step()?,
                0xe0..=0xfe => (0..2 * usize::from(byte - 0xe0)).try_for_each(|_| self.step(0))?,
                _ => {
                    self.step(6 - i32::from(byte >> 4))?;
                    match byte & 0x0f {
                        0x0f => self.large_step()?,
                        0x0d => {}
                        half => self.step(6 - i32::from(half))?,
                    }
                }
            }
        }
        Some(())
    }

    fn next(&mut self) -> Option<u8> {
        let (first, rest) = self.bytes.split_first()?;
        self.bytes = rest;
        Some(*first)
    }

    fn large_step(&mut self) -> Option<()> {
        let high = self.next()?;
        if high & 0x80 != 0 {
            return self.step(192 - i32::from(high));
        }
        let low = self.next()?;
        self.put(u16::from_be_bytes([high, low]))
    }

    fn step(&mut self, by: i32) -> Option<()> {
        self.put(self.last.wrapping_add(by as u16))
    }

    fn put(&mut self, value: u16) -> Option<()> {
        self.last = value;
        self.values.push(value);
        (self.values.len() <= self.count).then_some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_runs_and_tables_are_unpacked() {
        // 1000, then 1001 and 999 (5 and 8), two pairs of the same, a step of -40 (192 + 40), the value 2000, a single -6.
        let packed = [0xe8, 0x03, 0x58, 0xe2, 0xff, 0xe8, 0xff, 0x07, 0xd0, 0xcd];
        let values = [1000, 1001, 999, 999, 999, 999, 999, 959, 2000, 1994];
        assert_eq!(unpack(&packed, false, 10).unwrap(), values);
        // A step that follows in the same byte: 6 and 15.
        assert_eq!(unpack(&[1, 0, 0x6f, 0x0b, 0xb8], false, 3).unwrap(), [1, 1, 3000]);
        // A table of 0, 700 and 900: the first, the second, the third, the third.
        let table = [3, 0, 0, 0, 0xbc, 0x02, 0x84, 0x03, 0, 0, 0x55, 0x6d];
        assert_eq!(unpack(&table, true, 4).unwrap(), [0, 700, 900, 900]);
        for (bytes, count) in
            [(&packed[..9], 10), (&packed[..8], 10), (&packed[..], 9), (&packed[..], 11), (&[1][..], 1)]
        {
            assert!(unpack(bytes, false, count).is_err(), "{bytes:?} {count}");
        }
        assert!(unpack(&table[..7], true, 4).unwrap_err().contains("cut off"));
        assert!(unpack(&[1, 0, 0, 0, 5, 0], true, 1).unwrap_err().contains("table"));
    }
}
