//! A track of a Matroska file, and its frames as pictures.

use std::sync::Arc;

use super::ebml::{children, text, unsigned};
use crate::{
    ColorImage, DepthImage, RgbImage, encoded,
    pixels::{Rows, rgb_from_yuv, whole_jpeg, yuyv},
    printable,
};

/// The largest number of pixels of a raw picture.
const MAX_PIXELS: u64 = 1 << 26;
/// Where the header of a bitmap, which the codec `V_MS/VFW/FOURCC` stands before its frames, has the four letters of its format.
const FOURCC_AT: usize = 16;

/// How the bytes of frames are packed in the file.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
enum Packing {
    #[default]
    None,
    /// The same bytes at the start of every frame are left out.
    Headless(Vec<u8>),
    Zlib,
    /// Another one, by its number; encrypted tracks have none.
    Other(Option<u64>),
}

/// A track.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Track {
    pub(super) number: u64,
    pub(super) uid: u64,
    pub(super) name: String,
    pub(super) is_video: bool,
    /// The codec's name; of bitmaps the four letters of their format.
    pub(super) format: String,
    pub(super) width: u32,
    pub(super) height: u32,
    /// Nanoseconds from frame to frame; 0 where it does not say.
    pub(super) period_ns: u64,
    packing: Packing,
}

impl Track {
    /// Reads a track's entry; what it does not say stays 0 or empty.
    pub(super) fn read(entry: &[u8]) -> Self {
        let mut track = Self::default();
        let mut header: &[u8] = &[];
        for (id, bytes) in children(entry) {
            match id {
                0xd7 => track.number = unsigned(bytes).unwrap_or(0),
                0x73c5 => track.uid = unsigned(bytes).unwrap_or(0),
                0x83 => track.is_video = unsigned(bytes) == Some(1),
                0x536e => track.name = text(bytes),
                0x86 => track.format = text(bytes),
                0x63a2 => header = bytes,
                0x0023_e383 => track.period_ns = unsigned(bytes).unwrap_or(0),
                0xe0 => {
                    let fields = children(bytes);
                    let size = |id| {
                        let value =
                            fields.iter().find(|(found, _)| *found == id).and_then(|(_, bytes)| unsigned(bytes));
                        value.and_then(|value| u32::try_from(value).ok()).unwrap_or(0)
                    };
                    (track.width, track.height) = (size(0xb0), size(0xba));
                }
                0x6d80 => track.packing = packing(bytes),
                _ => {}
            }
        }
        if let Some(letters) = header.get(FOURCC_AT..FOURCC_AT + 4).filter(|_| track.format == "V_MS/VFW/FOURCC") {
            track.format = text(letters);
        } else if track.format == "V_MJPEG" {
            track.format = "MJPG".into();
        }
        track
    }

    /// A frame's bytes as they were before they were packed.
    ///
    /// # Errors
    /// That they cannot be unpacked.
    fn unpack(&self, bytes: Vec<u8>) -> Result<Vec<u8>, String> {
        match &self.packing {
            Packing::None => Ok(bytes),
            Packing::Headless(head) => Ok([head.as_slice(), &bytes].concat()),
            Packing::Zlib => miniz_oxide::inflate::decompress_to_vec_zlib_with_limit(&bytes, 8 * MAX_PIXELS as usize)
                .map_err(|error| format!("cannot be unpacked: {error}")),
            Packing::Other(_) => Err("is packed in a way that is not read".into()),
        }
    }

    /// A sentence where the track's frames cannot be read as depth.
    ///
    /// # Errors
    /// That sentence.
    pub(super) fn check(&self, formats: &[&str]) -> Result<(), String> {
        let what = printable(&self.name).into_owned();
        if let Packing::Other(number) = self.packing {
            let number = number.map_or("encrypted".to_string(), |n| format!("packed in the way {n}"));
            return Err(format!(
                "its track {what} is {number}, which is not read; `mkvmerge --compression -1:none` unpacks it"
            ));
        }
        if !formats.contains(&self.format.as_str()) {
            let format = printable(&self.format).into_owned();
            return Err(format!(
                "its track {what} has frames of the format `{format}`; read are {}",
                formats.join(", ")
            ));
        }
        if self.width == 0 || self.height == 0 || u64::from(self.width) * u64::from(self.height) > MAX_PIXELS {
            return Err(format!("its track {what} says {} x {} pixels: it is damaged", self.width, self.height));
        }
        Ok(())
    }

    /// Depth of 16 bits, the higher byte first.
    ///
    /// # Errors
    /// What is wrong with the frame.
    pub(super) fn depth(&self, bytes: Vec<u8>) -> Result<DepthImage, String> {
        let bytes = self.unpack(bytes)?;
        let values: Vec<u16> = bytes.as_chunks::<2>().0.iter().map(|b| u16::from_be_bytes(*b)).collect();
        self.check_length(bytes.len(), 2 * self.pixels())?;
        Ok(DepthImage { width: self.width, height: self.height, values })
    }

    /// A colour picture; JPEG stays as it is.
    ///
    /// # Errors
    /// What is wrong with the frame.
    pub(super) fn color(&self, bytes: Vec<u8>) -> Result<ColorImage, String> {
        let bytes = self.unpack(bytes)?;
        let (width, height) = (self.width, self.height);
        let image = match self.format.as_str() {
            "MJPG" => {
                encoded::size(&bytes)?;
                return Ok(ColorImage::Jpeg(whole_jpeg(&bytes).unwrap_or(&bytes).into()));
            }
            "YUY2" => yuyv(&bytes, Rows { width, height, stride: 2 * width }).map_err(|error| error.to_string())?,
            "NV12" => {
                self.check_length(bytes.len(), self.pixels() + 2 * self.pixels().div_ceil(4))?;
                nv12(&bytes, width as usize, height as usize).ok_or("has an odd number of columns or rows")?
            }
            _ => {
                self.check_length(bytes.len(), 4 * self.pixels())?;
                let pixels = bytes.as_chunks::<4>().0.iter().map(|[b, g, r, _]| [*r, *g, *b]).collect();
                RgbImage { width, height, pixels }
            }
        };
        Ok(ColorImage::Rgb(Arc::new(image)))
    }

    fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    fn check_length(&self, bytes: usize, needed: usize) -> Result<(), String> {
        if bytes == needed {
            return Ok(());
        }
        Err(format!("has {bytes} bytes, but {} x {} pixels need {needed}", self.width, self.height))
    }
}

/// Brightness of every pixel, then colour of every two by two; `None` where the size is odd.
fn nv12(bytes: &[u8], width: usize, height: usize) -> Option<RgbImage> {
    if !width.is_multiple_of(2) || !height.is_multiple_of(2) {
        return None;
    }
    let (luma, chroma) = bytes.split_at_checked(width * height)?;
    let pixel = |(i, y): (usize, &u8)| {
        let k = (i / width / 2) * width + (i % width) / 2 * 2;
        Some(rgb_from_yuv(*y, *chroma.get(k)?, *chroma.get(k + 1)?))
    };
    let pixels = luma.iter().enumerate().map(pixel).collect::<Option<_>>()?;
    Some(RgbImage { width: width as u32, height: height as u32, pixels })
}

fn packing(encodings: &[u8]) -> Packing {
    const ENCODING: u32 = 0x6240;
    const COMPRESSION: u32 = 0x5034;
    let all = children(encodings);
    let compressions: Vec<_> = all.iter().filter(|(id, _)| *id == ENCODING).map(|(_, bytes)| children(bytes)).collect();
    let [one] = &compressions[..] else { return Packing::Other(None) };
    let Some((_, fields)) = one.iter().find(|(id, _)| *id == COMPRESSION) else { return Packing::Other(None) };
    let fields = children(fields);
    let of = |id: u32| fields.iter().find(|(found, _)| *found == id).map(|(_, bytes)| *bytes);
    match of(0x4254).and_then(unsigned).unwrap_or(0) {
        0 => Packing::Zlib,
        3 => Packing::Headless(of(0x4255).unwrap_or_default().to_vec()),
        other => Packing::Other(Some(other)),
    }
}
