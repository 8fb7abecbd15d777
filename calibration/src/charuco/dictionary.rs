//! Dictionaries of markers: the black and white squares of each id.
//!
//! The codes are those of OpenCV's predefined dictionaries (`DICT_4X4`, `DICT_5X5` and `DICT_6X6` of 50, 100, 250 and 1000
//! markers; Garrido-Jurado et al. 2014, "Automatic generation and detection of highly reliable fiducial markers under
//! occlusion"). The smaller ones are the first markers of the largest one, so a file of three tables holds them all.

use std::str::FromStr;

/// Codes of 4, 5 and 6 squares along a side, a thousand each: row by row, white is 1, the highest byte first.
const CODES: &[u8] = include_bytes!("../../assets/markers.bin");
/// Markers in a table.
const COUNT: usize = 1000;
/// Bits that may be read wrongly: no two markers of a dictionary of up to 250 differ by fewer than three.
const WRONG_BITS: u32 = 1;

/// A dictionary of square markers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Dictionary {
    /// Squares along a side of a marker, without its black border: 4, 5 or 6.
    pub squares: usize,
    /// How many markers it has: 50, 100, 250 or 1000.
    pub count: usize,
}

impl Dictionary {
    /// The squares of a marker row by row, white is 1, the last one in the lowest bit; `None` where it has no such marker.
    pub fn code(&self, id: usize) -> Option<u64> {
        let bytes = (self.squares * self.squares).div_ceil(8);
        let start = match self.squares {
            4 => 0,
            5 => 2 * COUNT,
            6 => 6 * COUNT,
            _ => return None,
        };
        let code = CODES.get(start + id * bytes..)?.get(..bytes).filter(|_| id < self.count)?;
        Some(code.iter().fold(0, |code, byte| code << 8 | u64::from(*byte)))
    }

    /// The marker among the first `most` whose squares were read, and by how many quarter turns what was read must be turned to
    /// have it upright.
    pub(super) fn find(&self, mut read: u64, most: usize) -> Option<(usize, usize)> {
        for turns in 0..4 {
            let is_it = |id: &usize| self.code(*id).is_some_and(|code| (code ^ read).count_ones() <= WRONG_BITS);
            if let Some(id) = (0..most.min(self.count)).find(is_it) {
                return Some((id, turns));
            }
            read = self.turned(read);
        }
        None
    }

    /// A code after a quarter turn: its row r, column c is row n - 1 - c, column r of the one before.
    fn turned(&self, code: u64) -> u64 {
        let n = self.squares;
        let bit = |row: usize, column: usize| code >> (n * n - 1 - (row * n + column)) & 1;
        (0..n * n).fold(0, |turned, k| turned << 1 | bit(n - 1 - k % n, k / n))
    }
}

impl FromStr for Dictionary {
    type Err = String;

    /// `DICT_4X4_50`, or `4x4_50`.
    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!("`{text}` is no dictionary; read are DICT_4X4, DICT_5X5 and DICT_6X6 with _50, _100, _250 or _1000")
        };
        let name = text.to_ascii_uppercase();
        let (size, count) = name.strip_prefix("DICT_").unwrap_or(&name).split_once('_').ok_or_else(wrong)?;
        let squares = [(4, "4X4"), (5, "5X5"), (6, "6X6")].into_iter().find(|(_, known)| *known == size);
        let count = [50, 100, 250, 1000].into_iter().find(|known| known.to_string() == count);
        match (squares, count) {
            (Some((squares, _)), Some(count)) => Ok(Self { squares, count }),
            _ => Err(wrong()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markers_are_found_turned_and_with_a_wrong_square() {
        for name in ["DICT_4X4_50", "5x5_250", "dict_6x6_1000"] {
            let dictionary: Dictionary = name.parse().unwrap();
            let n = dictionary.squares;
            let code = dictionary.code(17).unwrap();
            // What a camera reads of it that is turned by three quarters needs one more.
            let read = (0..3).fold(code, |code, _| dictionary.turned(code));
            assert_eq!(dictionary.find(read ^ 4, 40), Some((17, 1)), "{name}");
            assert_eq!(
                dictionary.turned(dictionary.turned(dictionary.turned(read))),
                (0..2).fold(code, |c, _| dictionary.turned(c))
            );
            assert_eq!((dictionary.code(dictionary.count), dictionary.find(read, 17)), (None, None), "{name}");
            assert!(code < 1 << (n * n));
        }
        assert!("DICT_4X4_60".parse::<Dictionary>().unwrap_err().contains("_250"));
        assert!("7X7_50".parse::<Dictionary>().is_err());
    }
}
