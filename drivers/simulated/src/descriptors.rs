//! Standard USB requests (USB 2.0 §9.4): what a kernel asks before any driver does.

use toile_driver_transport::{Setup, simulated::Answer};

/// An endpoint of a device's only interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Endpoint {
    /// Number with the direction bit.
    pub address: u8,
    /// 1 isochronous, 2 bulk, 3 interrupt.
    pub attributes: u8,
    /// `wMaxPacketSize`: bytes, and in bits 12:11 how many more transactions a microframe has.
    pub packet_size: u16,
    /// `bInterval`.
    pub interval: u8,
}

/// The descriptors of a device with one interface.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Descriptors {
    /// Vendor, product and release.
    pub ids: [u16; 3],
    /// Manufacturer, product and serial number.
    pub strings: [String; 3],
    /// The interface's endpoints.
    pub endpoints: Vec<Endpoint>,
}

impl Descriptors {
    /// The answer to a standard request; `None` for requests that are not standard.
    pub fn answer(&self, setup: Setup) -> Option<Answer> {
        standard(setup, self.device(), self.configuration(), &self.strings)
    }

    /// The device descriptor, 18 bytes.
    pub fn device(&self) -> Vec<u8> {
        let [vendor, product, release] = self.ids.map(u16::to_le_bytes);
        let mut bytes = vec![18, 1, 0x00, 0x02, 0, 0, 0, 64];
        bytes.extend([vendor, product, release].as_flattened());
        bytes.extend([1, 2, 3, 1]);
        bytes
    }

    /// The configuration with its interface and endpoints.
    pub fn configuration(&self) -> Vec<u8> {
        let total = 9 + 9 + 7 * self.endpoints.len() as u16;
        let mut bytes = vec![9, 2];
        bytes.extend(total.to_le_bytes());
        bytes.extend([1, 1, 0, 0xc0, 8]);
        bytes.extend([9, 4, 0, 0, self.endpoints.len() as u8, 0xff, 0xff, 0xff, 0]);
        for endpoint in &self.endpoints {
            let size = endpoint.packet_size.to_le_bytes();
            bytes.extend([7, 5, endpoint.address, endpoint.attributes, size[0], size[1], endpoint.interval]);
        }
        bytes
    }
}

/// The answer to a standard request to a device with these descriptors; `None` for requests that are not standard.
pub fn standard(setup: Setup, device: Vec<u8>, configuration: Vec<u8>, strings: &[String; 3]) -> Option<Answer> {
    if setup.request_type & 0x60 != 0 {
        return None;
    }
    let mut data = match (setup.request, setup.value >> 8) {
        (0x06, 1) => device,
        (0x06, 2) => configuration,
        (0x06, 3) => match string(strings, setup.value as u8) {
            Some(string) => string,
            None => return Some(Answer::Stall),
        },
        // GET_STATUS, GET_CONFIGURATION, GET_INTERFACE
        (0x00, _) => vec![0, 0],
        (0x08, _) => vec![1],
        (0x0a, _) => vec![0],
        // CLEAR_FEATURE, SET_FEATURE, SET_ADDRESS, SET_CONFIGURATION, SET_INTERFACE
        (0x01 | 0x03 | 0x05 | 0x09 | 0x0b, _) => Vec::new(),
        _ => return Some(Answer::Stall),
    };
    data.truncate(usize::from(setup.length));
    Some(Answer::Data(data))
}

fn string(strings: &[String; 3], index: u8) -> Option<Vec<u8>> {
    if index == 0 {
        return Some(vec![4, 3, 0x09, 0x04]);
    }
    let string = strings.get(usize::from(index) - 1)?;
    let text: Vec<u8> = string.encode_utf16().flat_map(u16::to_le_bytes).take(252).collect();
    let mut bytes = vec![text.len() as u8 + 2, 3];
    bytes.extend(text);
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Descriptors {
        Descriptors {
            ids: [0x045e, 0x02ae, 0x010b],
            strings: ["Maker", "Camera", "A1"].map(String::from),
            endpoints: vec![Endpoint { address: 0x81, attributes: 1, packet_size: 0x0bc0, interval: 1 }],
        }
    }

    fn get(setup: Setup) -> Option<Answer> {
        sample().answer(setup)
    }

    #[test]
    fn lengths_in_the_descriptors_are_their_lengths() {
        let (device, configuration) = (sample().device(), sample().configuration());
        assert_eq!((device.len(), usize::from(device[0])), (18, 18));
        assert_eq!(usize::from(u16::from_le_bytes([configuration[2], configuration[3]])), configuration.len());
        let mut rest = &configuration[..];
        while let [length, ..] = *rest {
            rest = &rest[usize::from(length)..];
        }
    }

    #[test]
    fn answers_are_cut_to_what_was_asked_and_other_requests_are_left_to_the_model() {
        let first = Setup { request_type: 0x80, request: 6, value: 0x100, index: 0, length: 8 };
        assert_eq!(get(first), Some(Answer::Data(sample().device()[..8].to_vec())));
        let serial = Setup { value: 0x303, length: 255, ..first };
        assert_eq!(get(serial), Some(Answer::Data(vec![6, 3, b'A', 0, b'1', 0])));
        assert_eq!(get(Setup { value: 0x309, ..serial }), Some(Answer::Stall));
        assert_eq!(get(Setup { request_type: 0xc0, ..first }), None);
    }
}
