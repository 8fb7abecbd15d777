//! The part of Protocol Buffers' wire format that recordings need: writing fields, and reading them back with every
//! length checked.

/// One field's value, as it stands on the wire.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Value<'a> {
    /// Wire type 0.
    Varint(u64),
    /// Wire type 1: fixed64, sfixed64, double.
    Fixed64([u8; 8]),
    /// Wire type 2: string, bytes, message, packed numbers.
    Bytes(&'a [u8]),
    /// Wire type 5: fixed32.
    Fixed32([u8; 4]),
}

/// Appends fields to a message.
#[derive(Debug, Default)]
pub(super) struct Writer {
    /// The message so far.
    pub(super) bytes: Vec<u8>,
}

impl Writer {
    pub(super) fn varint(&mut self, number: u32, value: u64) -> &mut Self {
        self.tag(number, 0);
        self.push_varint(value);
        self
    }

    pub(super) fn fixed32(&mut self, number: u32, value: u32) -> &mut Self {
        self.tag(number, 5);
        self.bytes.extend_from_slice(&value.to_le_bytes());
        self
    }

    pub(super) fn fixed64(&mut self, number: u32, value: [u8; 8]) -> &mut Self {
        self.tag(number, 1);
        self.bytes.extend_from_slice(&value);
        self
    }

    pub(super) fn bytes(&mut self, number: u32, value: &[u8]) -> &mut Self {
        self.tag(number, 2);
        self.push_varint(value.len() as u64);
        self.bytes.extend_from_slice(value);
        self
    }

    pub(super) fn string(&mut self, number: u32, value: &str) -> &mut Self {
        self.bytes(number, value.as_bytes())
    }

    pub(super) fn doubles(&mut self, number: u32, values: &[f64]) -> &mut Self {
        let packed: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.bytes(number, &packed)
    }

    fn tag(&mut self, number: u32, wire_type: u32) {
        self.push_varint(u64::from(number << 3 | wire_type));
    }

    fn push_varint(&mut self, mut value: u64) {
        while value >= 0x80 {
            self.bytes.push(value as u8 | 0x80);
            value >>= 7;
        }
        self.bytes.push(value as u8);
    }
}

/// The fields of a message in their order; `None` at the first bytes that are not a field.
pub(super) fn fields(bytes: &[u8]) -> Fields<'_> {
    Fields { bytes }
}

/// See [`fields`].
pub(super) struct Fields<'a> {
    bytes: &'a [u8],
}

impl<'a> Fields<'a> {
    fn take_field(&mut self) -> Option<(u32, Value<'a>)> {
        let bytes = &mut self.bytes;
        let tag = take_varint(bytes)?;
        let number = u32::try_from(tag >> 3).ok()?;
        let value = match tag & 7 {
            0 => Value::Varint(take_varint(bytes)?),
            1 => Value::Fixed64(take_array(bytes)?),
            2 => {
                let length = usize::try_from(take_varint(bytes)?).ok()?;
                let (value, rest) = bytes.split_at_checked(length)?;
                *bytes = rest;
                Value::Bytes(value)
            }
            5 => Value::Fixed32(take_array(bytes)?),
            _ => return None,
        };
        Some((number, value))
    }
}

impl<'a> Iterator for Fields<'a> {
    type Item = Option<(u32, Value<'a>)>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.bytes.is_empty() {
            return None;
        }
        let field = self.take_field();
        if field.is_none() {
            self.bytes = &[];
        }
        Some(field)
    }
}

fn take_varint(bytes: &mut &[u8]) -> Option<u64> {
    let mut value = 0_u64;
    for shift in (0..64).step_by(7) {
        let (&byte, rest) = bytes.split_first()?;
        *bytes = rest;
        value |= u64::from(byte & 0x7f).checked_shl(shift)?;
        if byte < 0x80 {
            return Some(value);
        }
    }
    None
}

fn take_array<const N: usize>(bytes: &mut &[u8]) -> Option<[u8; N]> {
    let (value, rest) = bytes.split_first_chunk::<N>()?;
    *bytes = rest;
    Some(*value)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(bytes: &[u8]) -> Option<Vec<(u32, Value<'_>)>> {
        fields(bytes).collect()
    }
    use proptest::prelude::*;

    #[test]
    fn known_bytes_from_the_protobuf_documentation() {
        // protobuf.dev/programming-guides/encoding: field 1 = 150 is 08 96 01; field 2 = "testing" is 12 07 ...
        let mut writer = Writer::default();
        writer.varint(1, 150).string(2, "testing");
        assert_eq!(writer.bytes, b"\x08\x96\x01\x12\x07testing");
        assert_eq!(all(&writer.bytes).unwrap(), [(1, Value::Varint(150)), (2, Value::Bytes(b"testing"))]);
    }

    proptest! {
        #[test]
        fn garbage_never_panics(bytes in proptest::collection::vec(any::<u8>(), 0..80)) {
            let _ = all(&bytes);
        }

        #[test]
        fn varints_round_trip(value in any::<u64>(), number in 1_u32..10_000) {
            let mut writer = Writer::default();
            writer.varint(number, value);
            prop_assert_eq!(all(&writer.bytes).unwrap(), vec![(number, Value::Varint(value))]);
        }
    }
}
