//! Answers to a kernel that asks a USB 3 device with two interfaces (USB 3.2 §9.6); the interfaces and endpoints are those of
//! libfreenect2's `protocol/usb_control.h`.

use toile_driver_transport::{Setup, simulated::Answer};

/// Bytes that one isochronous packet of depth may have: eleven bursts of three times 1024 bytes (libfreenect2
/// `Freenect2DeviceImpl::open` wants 0x8400).
pub(super) const DEPTH_ROOM: u16 = 0x8400;

/// The device descriptor: USB 3.0, packets of 2⁹ bytes on endpoint 0.
fn device() -> Vec<u8> {
    let mut bytes = vec![18, 1, 0x00, 0x03, 0xef, 2, 1, 9];
    bytes.extend([0x045e_u16, 0x02c4, 0x0100].map(u16::to_le_bytes).as_flattened());
    bytes.extend([1, 2, 3, 1]);
    bytes
}

/// An endpoint with its USB 3 companion.
fn endpoint(address: u8, kind: u8, size: u16, interval: u8, companion: [u8; 2], bytes_per_interval: u16) -> Vec<u8> {
    let mut bytes = vec![7, 5, address, kind];
    bytes.extend(size.to_le_bytes());
    bytes.push(interval);
    bytes.extend([6, 0x30, companion[0], companion[1]]);
    bytes.extend(bytes_per_interval.to_le_bytes());
    bytes
}

/// The configuration: control and colour, and depth with an empty and a streaming setting.
fn configuration() -> Vec<u8> {
    let interface = |number, alternate, endpoints| vec![9, 4, number, alternate, endpoints, 0xff, 0xff, 0xff, 0];
    let parts = [
        vec![8, 11, 0, 2, 0xff, 0xff, 0xff, 0],
        interface(0, 0, 4),
        endpoint(0x81, 2, 1024, 0, [0, 0], 0),
        endpoint(0x02, 2, 1024, 0, [0, 0], 0),
        endpoint(0x83, 2, 1024, 0, [15, 0], 0),
        endpoint(0x82, 3, 1024, 4, [0, 0], 1024),
        interface(1, 0, 0),
        interface(1, 1, 1),
        endpoint(0x84, 1, 1024, 1, [10, 2], DEPTH_ROOM),
    ]
    .concat();
    let mut bytes = vec![9, 2];
    bytes.extend((9 + parts.len() as u16).to_le_bytes());
    bytes.extend([2, 1, 0, 0xc0, 1]);
    bytes.extend(parts);
    bytes
}

/// The binary object store: USB 2 extension and SuperSpeed capability.
fn object_store() -> Vec<u8> {
    vec![5, 15, 22, 0, 2, 7, 16, 2, 0, 0, 0, 0, 10, 16, 3, 0, 0x0e, 0, 3, 0, 0, 0]
}

fn string(index: u8, serial: &str) -> Option<Vec<u8>> {
    let text = match index {
        0 => return Some(vec![4, 3, 0x09, 0x04]),
        1 => "Microsoft",
        2 => "Xbox NUI Sensor",
        3 => serial,
        _ => return None,
    };
    let text: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).take(252).collect();
    Some([vec![text.len() as u8 + 2, 3], text].concat())
}

/// The answer to a standard request; `None` for requests that are not standard.
pub(super) fn answer(setup: Setup, serial: &str) -> Option<Answer> {
    if setup.request_type & 0x60 != 0 {
        return None;
    }
    let mut data = match (setup.request, setup.value >> 8) {
        (0x06, 1) => device(),
        (0x06, 2) => configuration(),
        (0x06, 15) => object_store(),
        (0x06, 3) => match string(setup.value as u8, serial) {
            Some(string) => string,
            None => return Some(Answer::Stall),
        },
        // GET_STATUS, GET_CONFIGURATION, GET_INTERFACE
        (0x00, _) => vec![0, 0],
        (0x08, _) => vec![1],
        (0x0a, _) => vec![0],
        // CLEAR_FEATURE, SET_FEATURE, SET_ADDRESS, SET_CONFIGURATION, SET_INTERFACE, SET_SEL, SET_ISOCH_DELAY
        (0x01 | 0x03 | 0x05 | 0x09 | 0x0b | 0x30 | 0x31, _) => Vec::new(),
        _ => return Some(Answer::Stall),
    };
    data.truncate(usize::from(setup.length));
    Some(Answer::Data(data))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_in_the_descriptors_are_their_lengths() {
        let configuration = configuration();
        assert_eq!((device().len(), object_store().len()), (18, 22));
        assert_eq!(usize::from(u16::from_le_bytes([configuration[2], configuration[3]])), configuration.len());
        let (mut rest, mut endpoints) = (&configuration[..], 0);
        while let [length, kind, ..] = *rest {
            endpoints += usize::from(kind == 5);
            rest = &rest[usize::from(length)..];
        }
        assert_eq!(endpoints, 5);
    }
}
