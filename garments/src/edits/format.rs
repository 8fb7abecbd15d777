//! The file of a layer's edits: strokes and hem lines, as data.

use nalgebra::Point3;
use serde::{Deserialize, Serialize};
use toile_geometry::{Mesh, bvh::Bvh};

use crate::error::GarmentError;

/// The version of the format that is read and written.
pub const VERSION: u32 = 1;
/// Points may lie this far off the scan's surface, metres.
const OFF_SURFACE: f32 = 0.03;
/// Radii and reaches that make sense, metres.
const RADII: [f32; 2] = [0.002, 0.2];
/// Coordinates lie within this distance of the origin, metres: no scan is larger, and squares stay finite.
const LARGEST_COORDINATE: f32 = 100.0;
/// A hem line has at least this length, metres.
const SHORTEST_LINE: f32 = 0.002;
/// Limit of the points of all edits of a layer.
const MAX_POINTS: usize = 100_000;
/// Limit of a file's size, bytes: [`MAX_POINTS`] in full precision take a twentieth of it.
const LARGEST_FILE: usize = 100_000_000;

/// All edits of a layer, as in `edits/01-trousers.json`.
///
/// Points lie in the frame of the take's scan, which stays the same from build to build.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Edits {
    /// [`VERSION`].
    pub version: u32,
    /// Strokes of a brush, applied in their order.
    #[serde(default)]
    pub strokes: Vec<Stroke>,
    /// Lines that the hem follows, applied after the strokes.
    #[serde(default)]
    pub hems: Vec<HemLine>,
}

/// The statement of a stroke.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mark {
    /// The touched cloth belongs to the garment.
    Belongs,
    /// The touched surface does not belong to it.
    DoesNotBelong,
}

impl Mark {
    /// 1 for what belongs, −1 for what does not.
    pub(crate) fn sign(self) -> f32 {
        match self {
            Self::Belongs => 1.0,
            Self::DoesNotBelong => -1.0,
        }
    }
}

/// A stroke of a brush over the scan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stroke {
    /// Its statement.
    pub mark: Mark,
    /// Its path: one point or more on the scan's surface, in the scan's frame, metres.
    pub points: Vec<[f32; 3]>,
    /// Radius of the brush, metres.
    pub radius: f32,
}

/// A line that the hem follows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HemLine {
    /// Two points or more on the scan's surface, in the scan's frame, metres; a closed line ends where it began.
    pub points: Vec<[f32; 3]>,
    /// How far from the line the hem is looked for and moved onto it, metres.
    #[serde(default = "default_reach")]
    pub reach: f32,
}

fn default_reach() -> f32 {
    0.02
}

/// A stroke or a hem line, for messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case", tag = "kind", content = "number")]
pub enum EditName {
    /// The nth stroke, counted from 1.
    Stroke(usize),
    /// The nth hem line, counted from 1.
    HemLine(usize),
}

impl std::fmt::Display for EditName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Stroke(n) => write!(f, "stroke {n}"),
            Self::HemLine(n) => write!(f, "hem line {n}"),
        }
    }
}

/// A stroke or a hem line as both are checked.
struct Part<'a> {
    name: EditName,
    points: &'a [[f32; 3]],
    /// Radius or reach, metres.
    radius: f32,
    fewest_points: usize,
}

impl Edits {
    /// Reads and checks a file of edits.
    ///
    /// # Errors
    /// [`GarmentError::Edits`] says why these bytes are not a valid edits file.
    pub fn from_json(bytes: &[u8]) -> Result<Self, GarmentError> {
        let invalid = |why: String| GarmentError::Edits(format!("not a valid edits file: {why}"));
        if bytes.len() > LARGEST_FILE {
            return Err(invalid(format!("it has {} bytes; the limit is {LARGEST_FILE}", bytes.len())));
        }
        let edits: Self = serde_json::from_slice(bytes).map_err(|e| invalid(e.to_string()))?;
        edits.check().map_err(|e| invalid(e.to_string()))?;
        Ok(edits)
    }

    /// Checks version, counts and numbers.
    ///
    /// # Errors
    /// [`GarmentError::Edits`] names the first stroke or hem line that is wrong, and why.
    pub fn check(&self) -> Result<(), GarmentError> {
        let wrong = |what: String| Err(GarmentError::Edits(what));
        if self.version != VERSION {
            return wrong(format!("version {} is not known; this program reads version {VERSION}", self.version));
        }
        let count: usize = self.parts().map(|p| p.points.len()).sum();
        if count > MAX_POINTS {
            return wrong(format!("{count} points are too many; thin the strokes to at most {MAX_POINTS}"));
        }
        self.parts().find_map(|part| part.fault()).map_or(Ok(()), wrong)
    }

    /// Checks that every point lies on the scan.
    ///
    /// # Errors
    /// [`GarmentError::Edits`] names the first point that does not.
    pub fn check_on(&self, scan: &Mesh) -> Result<(), GarmentError> {
        let bvh = Bvh::new(&scan.positions, &scan.triangles);
        let off = |p: &[f32; 3]| bvh.closest(&Point3::from(*p), OFF_SURFACE).is_none();
        let first_off = |part: Part| Some((part.name, part.points.iter().position(off)?));
        let Some((name, i)) = self.parts().find_map(first_off) else { return Ok(()) };
        let reason = format!("point {} lies more than {:.0} mm off the scan", i + 1, 1e3 * OFF_SURFACE);
        let help = "points are metres in the frame of the layer's scan.ply";
        Err(GarmentError::Edits(format!("{name}: {reason}; {help}")))
    }

    fn parts(&self) -> impl Iterator<Item = Part<'_>> {
        let stroke = |(k, s): (usize, &'_ Stroke)| (EditName::Stroke(k + 1), s.radius, 1);
        let strokes = self.strokes.iter().enumerate().map(move |(k, s)| (stroke((k, s)), &s.points[..]));
        let hems = self.hems.iter().enumerate().map(|(k, h)| ((EditName::HemLine(k + 1), h.reach, 2), &h.points[..]));
        let part = |((name, radius, fewest_points), points)| Part { name, points, radius, fewest_points };
        strokes.chain(hems).map(part)
    }
}

impl Part<'_> {
    /// A sentence on what is wrong with it, if anything is.
    fn fault(&self) -> Option<String> {
        let (name, count, [least, most]) = (self.name, self.points.len(), RADII);
        if count < self.fewest_points {
            let points = if count == 1 { "point" } else { "points" };
            return Some(format!("{name} has {count} {points}; it needs at least {}", self.fewest_points));
        }
        if !(least..=most).contains(&self.radius) {
            let what = if matches!(name, EditName::Stroke(_)) { "radius" } else { "reach" };
            return Some(format!("{name}: the {what} is {} m; it must be {least} to {most} m", self.radius));
        }
        let is_far = |p: &[f32; 3]| p.iter().any(|x| x.is_nan() || x.abs() > LARGEST_COORDINATE);
        if let Some(i) = self.points.iter().position(is_far) {
            let limit = format!("coordinates are metres, at most {LARGEST_COORDINATE} from the origin");
            return Some(format!("{name}: point {} is {:?}; {limit}", i + 1, self.points[i]));
        }
        (self.fewest_points > 1 && length(self.points) < SHORTEST_LINE)
            .then(|| format!("{name} has no length: its points are the same place"))
    }
}

/// Length of a polyline, metres.
fn length(points: &[[f32; 3]]) -> f32 {
    points.windows(2).map(|p| (Point3::from(p[0]) - Point3::from(p[1])).norm()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(json: &str) -> String {
        Edits::from_json(json.as_bytes()).unwrap_err().to_string()
    }

    #[test]
    fn valid_files_are_read_and_written_alike() {
        let json = r#"{"version":1,"strokes":[{"mark":"belongs","points":[[0.1,1.2,0.1]],"radius":0.03}],
            "hems":[{"points":[[0,1,0],[0.1,1,0]]}]}"#;
        let edits = Edits::from_json(json.as_bytes()).unwrap();
        assert_eq!(edits.hems[0].reach, 0.02);
        assert_eq!(Edits::from_json(&serde_json::to_vec(&edits).unwrap()), Ok(edits));
    }

    #[test]
    fn other_files_are_refused_by_a_sentence() {
        for json in ["", "[]", "{}", "null", "{\"version\":1,\"stroke\":[]}", "\u{0}\u{1}", "{\"version\":-1}"] {
            assert!(refused(json).starts_with("not a valid edits file: "), "{json}: {}", refused(json));
        }
        let nested = "[".repeat(100_000);
        assert!(refused(&nested).starts_with("not a valid edits file: "));
    }

    #[test]
    fn coordinates_that_no_scan_has_are_refused_with_their_place() {
        for number in ["1e38", "-1e38", "5e4"] {
            let json = format!(
                r#"{{"version":1,"strokes":[{{"mark":"belongs","points":[[0,1,0],[0,{number},0]],"radius":0.03}}]}}"#
            );
            assert!(refused(&json).contains("stroke 1: point 2"), "{number}: {}", refused(&json));
        }
        let json = r#"{"version":1,"hems":[{"points":[[0,1,0],[0,1e300,0]]}]}"#;
        assert!(refused(json).contains("number out of range at line 1 column"), "{}", refused(json));
    }

    #[test]
    fn a_hem_line_needs_a_length() {
        let json = r#"{"version":1,"hems":[{"points":[[0,1,0],[0,1,0]]}]}"#;
        assert!(refused(json).contains("hem line 1 has no length"), "{}", refused(json));
    }
}
