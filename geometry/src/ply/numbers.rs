//! The numbers after the header, one after the other.

use super::header::{Format, Scalar};

/// A file's numbers.
pub(super) trait Numbers {
    /// The next number, of type `scalar` in binary files.
    fn next(&mut self, scalar: Scalar) -> Result<f64, String>;
}

/// The numbers in `body`.
pub(super) fn over(format: Format, body: &[u8]) -> Result<Box<dyn Numbers + '_>, String> {
    Ok(match format {
        Format::Ascii => {
            let text =
                std::str::from_utf8(body).map_err(|_| "the file says that it is ASCII, but holds other bytes")?;
            Box::new(AsciiNumbers(text.split_ascii_whitespace()))
        }
        Format::Binary { big_endian } => Box::new(BinaryNumbers { bytes: body, big_endian }),
    })
}

fn torn() -> String {
    "the file ends before its last element: it is torn".into()
}

struct AsciiNumbers<'a>(std::str::SplitAsciiWhitespace<'a>);

impl Numbers for AsciiNumbers<'_> {
    fn next(&mut self, _: Scalar) -> Result<f64, String> {
        let word = self.0.next().ok_or_else(torn)?;
        word.parse().map_err(|_| format!("\"{word}\" is not a number"))
    }
}

struct BinaryNumbers<'a> {
    bytes: &'a [u8],
    big_endian: bool,
}

impl Numbers for BinaryNumbers<'_> {
    #[inline]
    fn next(&mut self, scalar: Scalar) -> Result<f64, String> {
        let size = scalar.size();
        let (number, rest) = self.bytes.split_at_checked(size).ok_or_else(torn)?;
        self.bytes = rest;
        let mut raw = [0u8; 8];
        raw[..size].copy_from_slice(number);
        if self.big_endian {
            raw[..size].reverse();
        }
        let bits = u64::from_le_bytes(raw);
        Ok(match scalar {
            Scalar::I8 => f64::from(bits as i8),
            Scalar::U8 => f64::from(bits as u8),
            Scalar::I16 => f64::from(bits as i16),
            Scalar::U16 => f64::from(bits as u16),
            Scalar::I32 => f64::from(bits as i32),
            Scalar::U32 => f64::from(bits as u32),
            Scalar::F32 => f64::from(f32::from_bits(bits as u32)),
            Scalar::F64 => f64::from_bits(bits),
        })
    }
}
