//! The binary part of a glTF file: typed arrays with the accessors that describe them.

use serde_json::{Map, Value, json};

/// Use of a buffer view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Target {
    /// Vertex attributes.
    Vertices = 34962,
    /// Triangle indices.
    Indices = 34963,
    /// Neither: matrices, key times, key values.
    Data = 0,
}

/// Element kind of an accessor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Shape {
    Scalar = 1,
    Vec2 = 2,
    Vec3 = 3,
    Vec4 = 4,
    Mat4 = 16,
}

impl Shape {
    fn name(self) -> &'static str {
        match self {
            Self::Scalar => "SCALAR",
            Self::Vec2 => "VEC2",
            Self::Vec3 => "VEC3",
            Self::Vec4 => "VEC4",
            Self::Mat4 => "MAT4",
        }
    }
}

/// A number type that glTF stores.
pub(crate) trait Component: Copy {
    /// glTF's code of the type.
    const CODE: u32;
    /// Appends the little-endian bytes.
    fn put(self, bytes: &mut Vec<u8>);
}

macro_rules! component {
    ($type:ty, $code:literal) => {
        impl Component for $type {
            const CODE: u32 = $code;
            fn put(self, bytes: &mut Vec<u8>) {
                bytes.extend_from_slice(&self.to_le_bytes());
            }
        }
    };
}

component!(u8, 5121);
component!(u16, 5123);
component!(u32, 5125);
component!(f32, 5126);

/// Bytes, views and accessors as they grow: one view an accessor, every element 4-byte aligned.
#[derive(Debug, Default)]
pub(crate) struct Buffer {
    pub bytes: Vec<u8>,
    pub views: Vec<Value>,
    pub accessors: Vec<Value>,
}

impl Buffer {
    /// Adds an array of `values`, `shape` numbers an element; returns the accessor's index.
    pub fn add<T: Component>(&mut self, values: &[T], shape: Shape, target: Target) -> usize {
        let offset = self.bytes.len();
        values.iter().for_each(|v| v.put(&mut self.bytes));
        let length = self.bytes.len() - offset;
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": length });
        if target != Target::Data {
            view["target"] = json!(target as u32);
        }
        self.views.push(view);
        self.accessors.push(json!({
            "bufferView": self.views.len() - 1,
            "componentType": T::CODE,
            "count": values.len() / shape as usize,
            "type": shape.name(),
        }));
        self.accessors.len() - 1
    }

    /// Adds a file, such as a picture; returns the view's index.
    pub fn add_file(&mut self, bytes: &[u8]) -> usize {
        let offset = self.bytes.len();
        self.bytes.extend_from_slice(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.push(json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() }));
        self.views.len() - 1
    }

    /// Adds floats with their `min` and `max`, which glTF requires for positions and key times.
    pub fn add_bounded(&mut self, values: &[f32], shape: Shape, target: Target) -> usize {
        let accessor = self.add(values, shape, target);
        let width = shape as usize;
        let bound = |pick: fn(f32, f32) -> f32| -> Vec<f64> {
            let of_column = |k: usize| values.iter().skip(k).step_by(width).copied().reduce(pick).unwrap_or(0.0);
            (0..width).map(|k| f64::from(of_column(k))).collect()
        };
        self.accessors[accessor]["min"] = json!(bound(f32::min));
        self.accessors[accessor]["max"] = json!(bound(f32::max));
        accessor
    }

    /// Marks an accessor's integers as fractions of their largest value.
    pub fn normalized(&mut self, accessor: usize) -> usize {
        self.accessors[accessor]["normalized"] = json!(true);
        accessor
    }

    /// The binary glTF 2.0 file of `document`, into which buffer, views and accessors are put.
    pub fn into_glb(self, mut document: Map<String, Value>) -> Vec<u8> {
        const MAGIC: &[u8] = b"glTF";
        document.insert("buffers".into(), json!([{ "byteLength": self.bytes.len() }]));
        document.insert("bufferViews".into(), Value::Array(self.views));
        document.insert("accessors".into(), Value::Array(self.accessors));
        let mut text = Value::Object(document).to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let total = 12 + 8 + text.len() + 8 + self.bytes.len();
        let mut out = Vec::with_capacity(total);
        out.extend_from_slice(MAGIC);
        for word in [2, total as u32, text.len() as u32] {
            word.put(&mut out);
        }
        out.extend_from_slice(b"JSON");
        out.extend_from_slice(&text);
        (self.bytes.len() as u32).put(&mut out);
        out.extend_from_slice(b"BIN\0");
        out.extend_from_slice(&self.bytes);
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_are_aligned_and_described() {
        let mut buffer = Buffer::default();
        buffer.add(&[1u8, 2, 3], Shape::Scalar, Target::Data);
        let second = buffer.add_bounded(&[1.0, -2.0, 3.0, 4.0, 5.0, -6.0], Shape::Vec3, Target::Vertices);
        assert_eq!(buffer.views[second]["byteOffset"], 4);
        assert_eq!(buffer.accessors[second]["count"], 2);
        assert_eq!(buffer.accessors[second]["min"], json!([1.0, -2.0, -6.0]));
        let glb = buffer.into_glb(Map::new());
        assert_eq!(glb.len() % 4, 0);
        assert_eq!(u32::from_le_bytes([glb[8], glb[9], glb[10], glb[11]]) as usize, glb.len());
    }
}
