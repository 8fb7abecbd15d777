//! Corrections by hand: strokes that say what belongs to the garment, and lines that its hem follows.
//!
//! Edits are data, applied again whenever the layer is rebuilt. Points lie in the frame of the take's scan, which stays
//! the same from build to build. An edit changes labels only in its neighbourhood: [`GROWTH`] radii around a stroke, the
//! reach of a hem line.

use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};
use toile_geometry::{Mesh, bvh::Bvh};

use crate::{ExtractSettings, GarmentError, evidence::Evidence, labels, labels::Labels, scan_graph::ScanGraph};

/// The version of the format that is read and written.
pub const VERSION: u32 = 1;
/// Around a stroke, up to this many radii, the border may move to a better place.
pub const GROWTH: f32 = 2.0;
/// Points may lie this far off the scan's surface, metres.
const OFF_SURFACE: f32 = 0.03;
/// Radii and reaches that make sense, metres.
const RADII: [f32; 2] = [0.002, 0.2];
/// Most points of all edits of a layer.
const MOST_POINTS: usize = 100_000;
/// What a stroke says beside itself, nats; it fades to nothing at the end of the neighbourhood.
const BESIDE: f32 = 3.0;
/// What is certain, nats.
const CERTAIN: f32 = 100.0;

/// All edits of a layer, as in `edits/01-trousers.json`.
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

/// What a stroke says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mark {
    /// What is touched belongs to the garment.
    Belongs,
    /// What is touched does not belong to it.
    DoesNotBelong,
}

/// A stroke of a brush over the scan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stroke {
    /// What it says.
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

/// What edits did to a scan's labels.
#[derive(Debug, Clone)]
pub struct Applied {
    /// True for vertices whose labels an edit may have changed.
    pub near: Vec<bool>,
    /// 1 where a stroke says that the vertex belongs, −1 where it says that it does not, else 0.
    pub painted: Vec<f32>,
    /// Signed distance from a hem line, metres, positive on the garment's side; NaN away from hem lines.
    pub hem_distance: Vec<f32>,
    /// Area whose label changed, square metres.
    pub changed_m2: f32,
}

impl Edits {
    /// Checks version, counts and numbers.
    ///
    /// # Errors
    /// [`GarmentError::Edits`] names the first stroke or hem line that is wrong, and why.
    pub fn check(&self) -> Result<(), GarmentError> {
        let wrong = |what: String| Err(GarmentError::Edits(what));
        if self.version != VERSION {
            return wrong(format!("version {} is not known; this program reads version {VERSION}", self.version));
        }
        for (what, points, radius, least) in self.parts() {
            if points.len() < least {
                return wrong(format!("{what} has {} points; it needs {least} or more", points.len()));
            }
            if !(RADII[0]..=RADII[1]).contains(&radius) {
                return wrong(format!("{what}: {radius} m is no radius or reach; use {} to {} m", RADII[0], RADII[1]));
            }
            if points.iter().flatten().any(|x| !x.is_finite()) {
                return wrong(format!("{what} has a point that is no number"));
            }
        }
        let count: usize = self.parts().map(|p| p.1.len()).sum();
        if count > MOST_POINTS {
            return wrong(format!("{count} points are too many; thin the strokes to {MOST_POINTS} or fewer"));
        }
        Ok(())
    }

    /// Checks that every point lies on the scan.
    ///
    /// # Errors
    /// [`GarmentError::Edits`] names the first point that does not.
    pub fn check_on(&self, scan: &Mesh) -> Result<(), GarmentError> {
        let bvh = Bvh::new(&scan.positions, &scan.triangles);
        for (what, points, ..) in self.parts() {
            if let Some(i) = points.iter().position(|&p| bvh.closest(&Point3::from(p), OFF_SURFACE).is_none()) {
                let reason = format!("point {} lies more than {:.0} mm off the scan", i + 1, 1e3 * OFF_SURFACE);
                let help = "points are metres in the frame of the layer's scan.ply";
                return Err(GarmentError::Edits(format!("{what}: {reason}; {help}")));
            }
        }
        Ok(())
    }

    /// Name, points, radius and least number of points of every stroke and hem line.
    fn parts(&self) -> impl Iterator<Item = (String, &[[f32; 3]], f32, usize)> {
        let strokes =
            self.strokes.iter().enumerate().map(|(k, s)| (format!("stroke {}", k + 1), &s.points[..], s.radius, 1));
        let hems =
            self.hems.iter().enumerate().map(|(k, h)| (format!("hem line {}", k + 1), &h.points[..], h.reach, 2));
        strokes.chain(hems)
    }

    /// Applies the edits to the labels of a scan.
    pub fn apply(
        &self,
        scan: &Mesh,
        graph: &ScanGraph,
        evidence: &Evidence,
        labels: &mut Labels,
        settings: &ExtractSettings,
    ) -> Applied {
        let before = labels.garment.clone();
        let count = graph.len();
        let mut applied = Applied {
            near: vec![false; count],
            painted: vec![0.0; count],
            hem_distance: vec![f32::NAN; count],
            changed_m2: 0.0,
        };
        for stroke in &self.strokes {
            stroke.apply(scan, graph, evidence, labels, settings, &mut applied);
        }
        for hem in &self.hems {
            hem.apply(scan, graph, labels, &mut applied);
        }
        applied.changed_m2 = (0..count).filter(|&v| before[v] != labels.garment[v]).map(|v| graph.areas[v]).sum();
        applied
    }
}

impl Stroke {
    fn apply(
        &self,
        scan: &Mesh,
        graph: &ScanGraph,
        evidence: &Evidence,
        labels: &mut Labels,
        settings: &ExtractSettings,
        applied: &mut Applied,
    ) {
        let line = Line::new(&self.points);
        let belongs = self.mark == Mark::Belongs;
        let sign = if belongs { 1.0 } else { -1.0 };
        let far = GROWTH * self.radius;
        let distance: Vec<f32> = scan.positions.iter().map(|p| line.closest(p).distance).collect();
        let mut local = labels.clone();
        for (v, &d) in distance.iter().enumerate() {
            let sure = if labels.garment[v] { CERTAIN } else { -CERTAIN };
            local.log_odds[v] = match d {
                d if d <= self.radius => sign * CERTAIN,
                d if d < far => labels.log_odds[v] + sign * BESIDE * (far - d) / (far - self.radius),
                _ => sure,
            };
        }
        labels::relabel(graph, evidence, &mut local, settings);
        for (v, &d) in distance.iter().enumerate().filter(|(_, d)| **d < far) {
            applied.near[v] = true;
            if d <= self.radius {
                applied.painted[v] = sign;
            } else if labels.garment[v] != local.garment[v] {
                applied.painted[v] = 0.0;
            }
            labels.garment[v] = if d <= self.radius { belongs } else { local.garment[v] };
            labels.confidence[v] = if d <= self.radius { 1.0 } else { labels.confidence[v] };
        }
    }
}

impl HemLine {
    fn apply(&self, scan: &Mesh, graph: &ScanGraph, labels: &mut Labels, applied: &mut Applied) {
        let line = Line::new(&self.points);
        let near: Vec<(usize, f32)> = (0..graph.len())
            .filter_map(|v| {
                let hit = line.closest(&scan.positions[v]);
                let side = hit.along.cross(&(scan.positions[v] - hit.point)).dot(&graph.normals[v]);
                (hit.within && hit.distance < self.reach).then(|| (v, hit.distance.copysign(side)))
            })
            .collect();
        // The garment lies on the side that has more of it already.
        let of_garment = |(v, s): &(usize, f32)| if labels.garment[*v] { graph.areas[*v] * s.signum() } else { 0.0 };
        let garment_side: f32 = near.iter().map(of_garment).sum::<f32>().signum();
        for (v, s) in near {
            let signed = s * garment_side;
            applied.near[v] = true;
            applied.hem_distance[v] = signed;
            applied.painted[v] = 0.0;
            labels.garment[v] = signed > 0.0;
            labels.confidence[v] = 1.0;
        }
    }
}

/// A polyline.
struct Line {
    points: Vec<Point3<f32>>,
    closed: bool,
}

/// The place of a polyline that is closest to a point.
struct OnLine {
    point: Point3<f32>,
    distance: f32,
    /// Direction of the line there.
    along: Vector3<f32>,
    /// False where the point lies beyond an end.
    within: bool,
}

impl Line {
    fn new(points: &[[f32; 3]]) -> Self {
        let closed = points.len() > 3 && points.first() == points.last();
        Self { points: points.iter().map(|&p| Point3::from(p)).collect(), closed }
    }

    fn closest(&self, p: &Point3<f32>) -> OnLine {
        let start = self.points[0];
        let mut best = OnLine { point: start, distance: (p - start).norm(), along: Vector3::zeros(), within: false };
        let last = self.points.len().saturating_sub(2);
        for (k, pair) in self.points.windows(2).enumerate() {
            let along = pair[1] - pair[0];
            let t = (p - pair[0]).dot(&along) / along.norm_squared().max(1e-12);
            let point = pair[0] + along * t.clamp(0.0, 1.0);
            let distance = (p - point).norm();
            if distance <= best.distance {
                let beyond = !self.closed && ((k == 0 && t < 0.0) || (k == last && t > 1.0));
                best = OnLine { point, distance, along, within: !beyond };
            }
        }
        best
    }
}
