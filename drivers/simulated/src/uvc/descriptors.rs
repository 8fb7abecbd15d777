//! Descriptors of a UVC camera.

/// How pictures go over the bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wire {
    /// Bulk: one payload a picture.
    Bulk,
    /// Isochronous: one payload a microframe, three times 1024 bytes.
    Isochronous,
}

/// A format and its sizes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FormatShape {
    /// First four bytes of its GUID: a code such as `YUY2`.
    pub code: [u8; 4],
    /// Bits a pixel.
    pub bits: u8,
    /// Columns, rows.
    pub sizes: Vec<(u16, u16)>,
    /// Frames a second, the first one by default.
    pub rates: Vec<u32>,
}

/// A stream.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StreamShape {
    /// Its endpoint, with the direction bit.
    pub endpoint: u8,
    /// Its formats.
    pub formats: Vec<FormatShape>,
}

/// An extension unit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExtensionShape {
    /// Its number.
    pub unit: u8,
    /// Its GUID as it stands in the descriptor.
    pub guid: [u8; 16],
    /// How many selectors, from 1.
    pub selectors: u8,
}

/// A camera part: a control interface and its streams.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FunctionShape {
    /// Its streams.
    pub streams: Vec<StreamShape>,
    /// Its extension unit.
    pub extension: Option<ExtensionShape>,
}

/// A whole device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Shape {
    /// Vendor, product and release.
    pub ids: [u16; 3],
    /// Manufacturer, product and serial number.
    pub strings: [String; 3],
    /// Its camera parts.
    pub functions: Vec<FunctionShape>,
    /// How pictures go over the bus.
    pub wire: Wire,
}

/// Last twelve bytes of a format's GUID (UVC payload specification for uncompressed video, table 2-1).
const GUID_END: [u8; 12] = [0, 0, 0x10, 0, 0x80, 0, 0, 0xaa, 0, 0x38, 0x9b, 0x71];
/// Clock of the time stamps, Hz: microseconds.
pub(super) const CLOCK: u32 = 1_000_000;
/// Bytes of a microframe: three transactions of 1024.
pub(super) const MICROFRAME: usize = 3072;

impl Shape {
    /// Numbers of the control and streaming interfaces of every part.
    pub(super) fn interfaces(&self) -> Vec<(u8, Vec<u8>)> {
        let mut next = 0;
        let numbers = |function: &FunctionShape| {
            let control = next;
            next += 1 + function.streams.len() as u8;
            (control, (control + 1..next).collect())
        };
        self.functions.iter().map(numbers).collect()
    }

    /// All streams with their interfaces.
    pub(super) fn streams(&self) -> Vec<(u8, StreamShape)> {
        let numbers = self.interfaces().into_iter().flat_map(|(_, streams)| streams);
        numbers.zip(self.functions.iter().flat_map(|f| f.streams.iter().cloned())).collect()
    }

    /// The device descriptor of a device whose interfaces belong together in groups (class 0xef).
    pub fn device(&self) -> Vec<u8> {
        let [vendor, product, release] = self.ids.map(u16::to_le_bytes);
        let mut bytes = vec![18, 1, 0x00, 0x02, 0xef, 2, 1, 64];
        bytes.extend([vendor, product, release].as_flattened());
        bytes.extend([1, 2, 3, 1]);
        bytes
    }

    /// The configuration with all that belongs to it.
    pub fn configuration(&self) -> Vec<u8> {
        let mut rest = Vec::new();
        let mut count = 0;
        for (function, (control, streaming)) in self.functions.iter().zip(self.interfaces()) {
            count += 1 + streaming.len() as u8;
            rest.extend([8, 11, control, 1 + streaming.len() as u8, 14, 3, 0, 0]);
            rest.extend(control_interface(function, control, &streaming));
            for (i, (stream, number)) in function.streams.iter().zip(streaming).enumerate() {
                rest.extend(self.streaming_interface(stream, number, OUTPUT + i as u8));
            }
        }
        let total = (9 + rest.len()) as u16;
        let mut bytes = vec![9, 2];
        bytes.extend(total.to_le_bytes());
        bytes.extend([count, 1, 0, 0x80, 220]);
        bytes.extend(rest);
        bytes
    }

    fn streaming_interface(&self, stream: &StreamShape, number: u8, terminal: u8) -> Vec<u8> {
        let is_bulk = self.wire == Wire::Bulk;
        let mut bytes = vec![9, 4, number, 0, u8::from(is_bulk), 14, 2, 0, 0];
        let formats: Vec<u8> = (1..).zip(&stream.formats).flat_map(|(i, f)| format_bytes(f, i)).collect();
        let (count, length) = (stream.formats.len() as u8, 13 + stream.formats.len() as u8);
        let total = u16::from(length) + formats.len() as u16;
        bytes.extend([length, 0x24, 1, count]);
        bytes.extend(total.to_le_bytes());
        bytes.extend([stream.endpoint, 0, terminal, 0, 0, 0, 1]);
        bytes.extend(vec![0; stream.formats.len()]);
        bytes.extend(formats);
        if is_bulk {
            bytes.extend([7, 5, stream.endpoint, 2, 0x00, 0x02, 0]);
        } else {
            bytes.extend([9, 4, number, 1, 1, 14, 2, 0, 0]);
            // Asynchronous; 1024 bytes, two more transactions.
            bytes.extend([7, 5, stream.endpoint, 5, 0x00, 0x14, 1]);
        }
        bytes
    }
}

/// Numbers of the camera terminal, the processing unit and the first output terminal.
const CAMERA: u8 = 1;
const PROCESSING: u8 = 2;
const OUTPUT: u8 = 5;

fn control_interface(function: &FunctionShape, number: u8, streaming: &[u8]) -> Vec<u8> {
    let mut units = vec![18, 0x24, 2, CAMERA, 0x01, 0x02, 0, 0, 0, 0, 0, 0, 0, 0, 3, 0, 0, 0];
    units.extend([12, 0x24, 5, PROCESSING, CAMERA, 0, 0, 2, 0, 0, 0, 0]);
    let mut source = PROCESSING;
    if let Some(extension) = &function.extension {
        let controls = (1u32 << extension.selectors) - 1;
        units.extend([28, 0x24, 6, extension.unit]);
        units.extend(extension.guid);
        units.extend([extension.selectors, 1, source, 3]);
        units.extend(&controls.to_le_bytes()[..3]);
        units.push(0);
        source = extension.unit;
    }
    for i in 0..streaming.len() as u8 {
        units.extend([9, 0x24, 3, OUTPUT + i, 0x01, 0x01, 0, source, 0]);
    }
    let length = 12 + streaming.len() as u8;
    let total = u16::from(length) + units.len() as u16;
    let mut bytes = vec![9, 4, number, 0, 0, 14, 1, 0, 0];
    bytes.extend([length, 0x24, 1, 0x10, 0x01]);
    bytes.extend(total.to_le_bytes());
    bytes.extend(CLOCK.to_le_bytes());
    bytes.push(streaming.len() as u8);
    bytes.extend(streaming);
    bytes.extend(units);
    bytes
}

fn format_bytes(format: &FormatShape, index: u8) -> Vec<u8> {
    let mut bytes = vec![27, 0x24, 4, index, format.sizes.len() as u8];
    bytes.extend(format.code);
    bytes.extend(GUID_END);
    bytes.extend([format.bits, 1, 0, 0, 0, 0]);
    for (i, &(width, height)) in (1..).zip(&format.sizes) {
        let size = u32::from(width) * u32::from(height) * u32::from(format.bits) / 8;
        bytes.extend([26 + 4 * format.rates.len() as u8, 0x24, 5, i, 0]);
        bytes.extend(width.to_le_bytes());
        bytes.extend(height.to_le_bytes());
        let rate = format.rates.first().copied().unwrap_or(30);
        for number in [size * 8 * rate, size * 8 * rate, size, 10_000_000 / rate] {
            bytes.extend(number.to_le_bytes());
        }
        bytes.push(format.rates.len() as u8);
        bytes.extend(format.rates.iter().flat_map(|rate| (10_000_000 / rate).to_le_bytes()));
    }
    // Colours: sRGB, BT.709, BT.601 (table 3-19).
    bytes.extend([6, 0x24, 0x0d, 1, 1, 4]);
    bytes
}
