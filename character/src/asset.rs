//! The body asset's bytes: header, sections of little-endian numbers, CRC-32 (written by `character/generator`).
//!
//! ```text
//! "TOILEBOD"  u32 version  u32 length of the header  header (JSON)  sections one after another  u32 CRC-32 of all before
//! ```
//! The header names each section with its length; the order is theirs. Arrays are vertex-major (x, y, z).

use nalgebra::{Point3, Vector3};
use serde::Deserialize;

use crate::{
    BodyModel, CharacterError, Region, Skeleton, SkinWeights,
    body_model::PopulationInfo,
    joint::{JOINT_COUNT, JOINTS},
    skin::INFLUENCES,
};

const MAGIC: &[u8; 8] = b"TOILEBOD";
const VERSION: u32 = 1;
/// Weights are in units of 1/65535.
const WEIGHT_ONE: u32 = 65535;

#[derive(Deserialize)]
struct Header {
    vertices: usize,
    triangles: usize,
    components: usize,
    joints: Vec<String>,
    landmarks: Vec<Landmark>,
    sigma_mm: Vec<f32>,
    beta_male: Vec<f32>,
    beta_female: Vec<f32>,
    report: serde_json::Value,
    sections: Vec<Section>,
}

#[derive(Deserialize)]
struct Landmark {
    name: String,
    vertex: u32,
}

#[derive(Deserialize)]
struct Section {
    name: String,
    bytes: usize,
}

/// The asset that ships with the program, made by `character/generator`.
const DEFAULT_ASSET: &[u8] = include_bytes!("../assets/body.toile");

impl BodyModel {
    /// The model that ships with the program.
    ///
    /// # Errors
    /// [`CharacterError::Asset`] where the program was built with a broken asset.
    pub fn load_default() -> Result<Self, CharacterError> {
        Self::from_bytes(DEFAULT_ASSET)
    }

    /// Reads a body asset.
    ///
    /// # Errors
    /// [`CharacterError::Asset`] says what is torn, of another kind or out of range.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, CharacterError> {
        read(bytes)
    }
}

fn read(bytes: &[u8]) -> Result<BodyModel, CharacterError> {
    let (header, mut body) = open(bytes)?;
    let mut sections = Vec::with_capacity(header.sections.len());
    for s in &header.sections {
        let (data, rest) = body
            .split_at_checked(s.bytes)
            .ok_or_else(|| wrong(format!("section {} runs past the end of the file", s.name)))?;
        sections.push((s.name.as_str(), data));
        body = rest;
    }
    let reader = Reader { header: &header, sections };
    reader.model()
}

/// Checks frame and checksum; returns the header and the bytes of the sections.
fn open(bytes: &[u8]) -> Result<(Header, &[u8]), CharacterError> {
    if !bytes.starts_with(MAGIC) {
        return Err(wrong("this is not a Toile body model (it does not begin with TOILEBOD)"));
    }
    let (data, sum) = bytes.split_last_chunk::<4>().filter(|(d, _)| d.len() >= 16).ok_or_else(|| wrong(torn(bytes)))?;
    let version = u32_at(data, 8);
    if version != VERSION {
        return Err(wrong(format!("version {version} is not known (this program reads version {VERSION})")));
    }
    let (text, body) = data[16..].split_at_checked(u32_at(data, 12) as usize).ok_or_else(|| wrong(torn(bytes)))?;
    if crc32fast::hash(data) != u32::from_le_bytes(*sum) {
        return Err(wrong(torn(bytes)));
    }
    let header = serde_json::from_slice(text).map_err(|e| wrong(format!("header: {e}")))?;
    Ok((header, body))
}

fn torn(bytes: &[u8]) -> String {
    format!(
        "the file is torn or was changed ({} bytes, checksum does not match); copy or generate it again",
        bytes.len()
    )
}

fn wrong(reason: impl Into<String>) -> CharacterError {
    CharacterError::Asset(reason.into())
}

fn u32_at(data: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([data[at], data[at + 1], data[at + 2], data[at + 3]])
}

struct Reader<'a> {
    header: &'a Header,
    sections: Vec<(&'a str, &'a [u8])>,
}

impl Reader<'_> {
    fn model(&self) -> Result<BodyModel, CharacterError> {
        self.check_header()?;
        let h = self.header;
        let mean = self.floats("mean", h.vertices * 3)?;
        Ok(BodyModel {
            triangles: self.triangles()?,
            mean: mean.chunks_exact(3).map(|p| Point3::new(p[0], p[1], p[2])).collect(),
            components: self.components()?,
            weights: self.weights()?,
            mean_skeleton: self.skeleton()?,
            joint_components: self.joint_components()?,
            regions: self.regions()?,
            inner: self.bytes("inner", h.vertices)?.iter().map(|&b| b != 0).collect(),
            landmarks: h.landmarks.iter().map(|l| (l.name.clone(), l.vertex)).collect(),
            sigma: h.sigma_mm.iter().map(|s| s * 1e-3).collect(),
            population: PopulationInfo {
                beta_male: h.beta_male.clone(),
                beta_female: h.beta_female.clone(),
                report: h.report.clone(),
            },
            mean_value_weights: std::sync::OnceLock::new(),
        })
    }

    fn check_header(&self) -> Result<(), CharacterError> {
        let h = self.header;
        if h.joints.len() != JOINT_COUNT || h.joints.iter().zip(JOINTS).any(|(n, j)| n != j.name()) {
            return Err(wrong(format!("its joints are not the {JOINT_COUNT} of this program, in this order")));
        }
        if h.vertices == 0 || h.vertices > 1 << 16 || h.triangles > 1 << 20 || h.components > 1 << 10 {
            return Err(wrong(format!("{} vertices, {} components: out of range", h.vertices, h.components)));
        }
        if let Some(l) = h.landmarks.iter().find(|l| l.vertex as usize >= h.vertices) {
            return Err(wrong(format!("landmark {} names vertex {}, but there are {}", l.name, l.vertex, h.vertices)));
        }
        if [&h.sigma_mm, &h.beta_male, &h.beta_female].iter().any(|v| v.len() != h.components) {
            return Err(wrong(format!("sigma or mean betas are not of length {}", h.components)));
        }
        Ok(())
    }

    fn bytes(&self, name: &str, length: usize) -> Result<&[u8], CharacterError> {
        let (_, data) = self
            .sections
            .iter()
            .find(|(n, _)| *n == name)
            .ok_or_else(|| wrong(format!("section {name} is missing")))?;
        if data.len() != length {
            return Err(wrong(format!("section {name} has {} bytes instead of {length}", data.len())));
        }
        Ok(data)
    }

    fn floats(&self, name: &str, count: usize) -> Result<Vec<f32>, CharacterError> {
        let data = self.bytes(name, count * 4)?;
        let out: Vec<f32> = data.chunks_exact(4).map(|c| f32::from_le_bytes([c[0], c[1], c[2], c[3]])).collect();
        match out.iter().position(|x| !x.is_finite()) {
            Some(i) => Err(wrong(format!("section {name}: number {i} is not finite"))),
            None => Ok(out),
        }
    }

    fn words(&self, name: &str, count: usize) -> Result<Vec<u16>, CharacterError> {
        Ok(self.bytes(name, count * 2)?.chunks_exact(2).map(|c| u16::from_le_bytes([c[0], c[1]])).collect())
    }

    fn triangles(&self) -> Result<Vec<[u32; 3]>, CharacterError> {
        let words = self.words("triangles", self.header.triangles * 3)?;
        if let Some(i) = words.iter().position(|&v| usize::from(v) >= self.header.vertices) {
            return Err(wrong(format!("triangle {} names vertex {}", i / 3, words[i])));
        }
        Ok(words.chunks_exact(3).map(|t| [t[0].into(), t[1].into(), t[2].into()]).collect())
    }

    fn components(&self) -> Result<Vec<Vec<Vector3<f32>>>, CharacterError> {
        let h = self.header;
        let scales = self.floats("scales", h.components)?;
        let data = self.bytes("components", h.components * h.vertices * 6)?;
        let number = |c: &[u8], at: usize, scale: f32| f32::from(i16::from_le_bytes([c[at], c[at + 1]])) * scale;
        let column = |(data, &s): (&[u8], &f32)| {
            data.chunks_exact(6).map(|c| Vector3::new(number(c, 0, s), number(c, 2, s), number(c, 4, s))).collect()
        };
        Ok(data.chunks_exact(h.vertices * 6).zip(&scales).map(column).collect())
    }

    fn weights(&self) -> Result<SkinWeights, CharacterError> {
        let count = self.header.vertices;
        let joints = self.bytes("influences", count * INFLUENCES)?;
        let words = self.words("weights", count * INFLUENCES)?;
        let mut out = SkinWeights::default();
        for (v, (j, w)) in joints.chunks_exact(INFLUENCES).zip(words.chunks_exact(INFLUENCES)).enumerate() {
            if j.iter().any(|&j| usize::from(j) >= JOINT_COUNT)
                || w.iter().map(|&w| u32::from(w)).sum::<u32>() != WEIGHT_ONE
            {
                return Err(wrong(format!("weights of vertex {v} do not sum to 1, or name an unknown joint")));
            }
            let pairs: Vec<(u8, f32)> = j.iter().zip(w).map(|(&j, &w)| (j, f32::from(w) / WEIGHT_ONE as f32)).collect();
            out.push(&pairs);
        }
        Ok(out)
    }

    fn skeleton(&self) -> Result<Skeleton, CharacterError> {
        let numbers = self.floats("joints", JOINT_COUNT * 3)?;
        let mut rest = [Point3::origin(); JOINT_COUNT];
        for (joint, p) in rest.iter_mut().zip(numbers.chunks_exact(3)) {
            *joint = Point3::new(p[0].into(), p[1].into(), p[2].into());
        }
        Ok(Skeleton { rest })
    }

    fn joint_components(&self) -> Result<Vec<Vec<Vector3<f64>>>, CharacterError> {
        let numbers = self.floats("joint_components", self.header.components * JOINT_COUNT * 3)?;
        let vector = |p: &[f32]| Vector3::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2]));
        Ok(numbers.chunks_exact(JOINT_COUNT * 3).map(|c| c.chunks_exact(3).map(vector).collect()).collect())
    }

    fn regions(&self) -> Result<Vec<Region>, CharacterError> {
        let codes = self.bytes("regions", self.header.vertices)?;
        codes
            .iter()
            .enumerate()
            .map(|(v, &c)| Region::from_code(c).ok_or_else(|| wrong(format!("vertex {v} has unknown region {c}"))))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_torn_or_changed_file_is_named_so() {
        let count = DEFAULT_ASSET.len();
        for end in [0, 7, 8, 12, 15, 16, 19, 20, 500, count / 2, count - 1] {
            let message = read(&DEFAULT_ASSET[..end]).unwrap_err().to_string();
            let expected = if end < 8 { "not a Toile body" } else { "torn" };
            assert!(message.contains(expected) || message.contains("version"), "{end}: {message}");
        }
        let mut changed = DEFAULT_ASSET.to_vec();
        changed[count / 3] ^= 4;
        assert!(read(&changed).unwrap_err().to_string().contains("torn"));
        assert!(read(b"ply\nformat binary").unwrap_err().to_string().contains("not a Toile body"));
    }

    #[test]
    fn a_newer_version_and_wrong_contents_are_named() {
        let sealed = |mut data: Vec<u8>| {
            let end = data.len() - 4;
            let sum = crc32fast::hash(&data[..end]).to_le_bytes();
            data[end..].copy_from_slice(&sum);
            read(&data).unwrap_err().to_string()
        };
        let mut newer = DEFAULT_ASSET.to_vec();
        newer[8] = 9;
        assert!(sealed(newer).contains("version 9"));
        let header = 16 + u32_at(DEFAULT_ASSET, 12) as usize;
        let mut beyond = DEFAULT_ASSET.to_vec();
        beyond[header..header + 2].copy_from_slice(&u16::MAX.to_le_bytes());
        assert!(sealed(beyond).contains("triangle 0 names vertex 65535"));
        let mut region = DEFAULT_ASSET.to_vec();
        let at = region.len() - 4 - 2 * 13_380;
        region[at] = 77;
        assert!(sealed(region).contains("region 77"));
        let mut joints = DEFAULT_ASSET.to_vec();
        let name = joints.windows(6).position(|w| w == b"\"hips\"").unwrap();
        joints[name + 1] = b'x';
        assert!(sealed(joints).contains("joints"));
    }
}
