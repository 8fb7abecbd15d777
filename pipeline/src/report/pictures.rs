//! The pictures of a report.

use std::{
    f32::consts::TAU,
    f64::consts::{FRAC_PI_2, PI},
};

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use toile_fitting::ScanLandmark;
use toile_geometry::{Mesh, bvh::Bvh};
use toile_render::{Drawn, RenderError, View, picture, sheet};

use crate::report::page::Picture;

/// Size of a picture of a whole person, pixels.
const SIZE: (u32, u32) = (300, 440);
/// Size of a picture in which a hem can be judged: a garment of a metre has pixels of less than 2 mm.
const LARGE: (u32, u32) = (560, 720);
/// Distances between body and scan are drawn from 0 to this, millimetres.
const DISTANCE_RANGE_MM: f32 = 15.0;
/// Name of the attribute that holds them.
const DISTANCE: &str = "distance_mm";
/// Colour and radius (metres) of the tapes on the body.
const TAPE: [u8; 3] = [200, 30, 40];
const CORD_RADIUS: f32 = 0.004;
/// Half the width of a mark at a landmark, metres, and its colour: found on the scan, set by hand, estimated.
const MARK: f32 = 0.008;
const FOUND: [u8; 3] = [30, 120, 60];
const BY_HAND: [u8; 3] = [30, 80, 200];
const ESTIMATED: [u8; 3] = [190, 120, 30];
/// Colours of the scan's and the body's section.
const SECTION_OF_SCAN: [u8; 3] = [30, 60, 140];
/// Elevation from which sections are seen, radians.
const FROM_ABOVE: f64 = 1.5;
/// Space between layers that are drawn apart, metres.
const BETWEEN: f32 = 0.1;
/// Colour of the body under a garment.
const SKIN: [u8; 3] = [205, 190, 178];

/// Corners of the box around all `meshes`; `None` where they are empty.
pub fn bounds<'a>(meshes: impl IntoIterator<Item = &'a Mesh>) -> Option<(Point3<f32>, Point3<f32>)> {
    meshes.into_iter().filter_map(Mesh::bounds).reduce(|a, b| (a.0.inf(&b.0), a.1.sup(&b.1)))
}

/// A mesh in its colours from front, side and back, and in grey.
///
/// # Errors
/// [`RenderError`] where the mesh cannot be drawn.
pub fn scan(mesh: &Mesh) -> Result<Vec<Picture>, RenderError> {
    let mut pictures = turn(&[Drawn::colored(mesh)], &["front", "left side", "back"])?;
    pictures.push(one(&[Drawn::clay(mesh)], &View::around(0.5, 0.1), "shape")?);
    Ok(pictures)
}

/// The body over the scan: how far every point of the scan is from the body, front and back, and both together.
///
/// # Errors
/// [`RenderError`] where a mesh cannot be drawn.
pub fn body_over_scan(scan: &Mesh, body: &Mesh) -> Result<Vec<Picture>, RenderError> {
    let mapped = with_distances(scan, body);
    let mut pictures = maps(&mapped, DISTANCE, (0.0, DISTANCE_RANGE_MM), "mm", "scan to body")?;
    pictures.push(one(&[Drawn::clay(body)], &View::front(), "body, front")?);
    pictures.push(one(&[Drawn::clay(body)], &View::around(FRAC_PI_2, 0.0), "body, left side")?);
    Ok(pictures)
}

/// The landmarks on the scan from front, side and back: found (green), set by hand (blue), estimated (ochre).
///
/// # Errors
/// [`RenderError`] where the mesh cannot be drawn.
pub fn landmarks(scan: &Mesh, landmarks: &[ScanLandmark]) -> Result<Vec<Picture>, RenderError> {
    let marks = |is_one: &dyn Fn(&ScanLandmark) -> bool| {
        cords(&landmarks.iter().filter(|l| is_one(l)).flat_map(|l| cross(l.position)).collect::<Vec<_>>())
    };
    let found = marks(&|l| !l.by_hand && l.seen > 0.0);
    let (by_hand, estimated) = (marks(&|l| l.by_hand), marks(&|l| !l.by_hand && l.seen == 0.0));
    let drawn = [
        Drawn::clay(scan),
        Drawn::solid(&found, FOUND, 1.0),
        Drawn::solid(&by_hand, BY_HAND, 1.0),
        Drawn::solid(&estimated, ESTIMATED, 1.0),
    ];
    turn(&drawn, &["landmarks, front", "landmarks, left side", "landmarks, back"])
}

/// Three strokes through a point.
fn cross(at: [f64; 3]) -> Vec<Vec<[f64; 3]>> {
    let stroke = |axis: usize| {
        let end = |sign: f64| std::array::from_fn(|k| at[k] + if k == axis { sign * f64::from(MARK) } else { 0.0 });
        vec![end(-1.0), end(1.0)]
    };
    (0..3).map(stroke).collect()
}

/// Sections of scan (blue) and body (red) at some heights (metres, with their names), seen from above.
///
/// # Errors
/// [`RenderError`] where a mesh cannot be drawn.
pub fn sections(scan: &Mesh, body: &Mesh, heights: &[(String, f64)]) -> Result<Vec<Picture>, RenderError> {
    let one_height = |(name, height): &(String, f64)| {
        let [of_scan, of_body] = [scan, body].map(|mesh| cords(&section(mesh, *height as f32)));
        let view = View { bounds: bounds([&of_scan, &of_body]), ..View::around(0.0, FROM_ABOVE) };
        let drawn = [Drawn::solid(&of_scan, SECTION_OF_SCAN, 1.0), Drawn::solid(&of_body, TAPE, 1.0)];
        one(&drawn, &view, &format!("section at the {name}, from above"))
    };
    heights.iter().map(one_height).collect()
}

/// Where the level at `height` cuts the triangles: pieces of two points.
fn section(mesh: &Mesh, height: f32) -> Vec<Vec<[f64; 3]>> {
    let cut = |corners: [Point3<f32>; 3]| {
        let crossing = |k: usize| {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            let crosses = (a.y < height) != (b.y < height);
            crosses.then(|| (a + (b - a) * ((height - a.y) / (b.y - a.y))).cast::<f64>().into())
        };
        let ends: Vec<[f64; 3]> = (0..3).filter_map(crossing).collect();
        (ends.len() == 2).then_some(ends)
    };
    (0..mesh.triangles.len()).filter_map(|t| cut(mesh.corners(t))).collect()
}

/// The standing body with the tapes that measured it from front, side and back.
///
/// # Errors
/// [`RenderError`] where the mesh cannot be drawn.
pub fn measured(standing: &Mesh, tapes: &[Vec<[f64; 3]>]) -> Result<Vec<Picture>, RenderError> {
    let cords = cords(tapes);
    turn(&[Drawn::clay(standing), Drawn::solid(&cords, TAPE, 1.0)], &["front", "left side", "back"])
}

/// Three-sided cords along polylines.
fn cords(lines: &[Vec<[f64; 3]>]) -> Mesh {
    let mut mesh = Mesh::default();
    for ends in lines.iter().flat_map(|l| l.windows(2)) {
        let [a, b] = [0, 1].map(|k| Point3::from(ends[k]).cast::<f32>());
        let Some(along) = (b - a).try_normalize(1e-6) else { continue };
        let seed = if along.y.abs() < 0.9 { Vector3::y() } else { Vector3::x() };
        let u = along.cross(&seed).normalize();
        let v = along.cross(&u);
        let first = mesh.positions.len() as u32;
        for k in 0..3 {
            let angle = TAU * k as f32 / 3.0;
            let out = (u * angle.cos() + v * angle.sin()) * CORD_RADIUS;
            mesh.positions.extend([a + out, b + out]);
        }
        for k in 0..3u32 {
            let (p, q) = (first + 2 * k, first + 2 * ((k + 1) % 3));
            mesh.triangles.extend([[p, q, p + 1], [q, q + 1, p + 1]]);
        }
    }
    mesh.recompute_normals();
    mesh
}

/// A garment alone, front and back, large enough to judge its hems.
///
/// # Errors
/// [`RenderError`] where a mesh cannot be drawn.
pub fn garment(garment: &Mesh) -> Result<Vec<Picture>, RenderError> {
    let side = |heading: f64, caption: &str| -> Result<Picture, RenderError> {
        let image = picture(&[Drawn::colored(garment)], &View::around(heading, 0.0), LARGE.0, LARGE.1)?;
        Ok(Picture { caption: caption.into(), image })
    };
    Ok(vec![side(0.0, "alone, front")?, side(PI, "alone, back")?])
}

/// A garment on what is worn below it, and maps of where its border is unsure and of what nobody saw of it.
///
/// # Errors
/// [`RenderError`] where a mesh cannot be drawn.
pub fn garment_worn(garment: &Mesh, body: &Mesh) -> Result<Vec<Picture>, RenderError> {
    let on_body = [Drawn::solid(body, SKIN, 1.0), Drawn::colored(garment)];
    let mut pictures = vec![
        one(&on_body, &View::front(), "on the body, front")?,
        one(&on_body, &View::around(PI, 0.0), "on the body, back")?,
    ];
    let mut garment = garment.clone();
    if let Some(confidence) = garment.attributes.get("confidence") {
        // The least that a label can be sure of, one of two, is a doubt of 1.
        let doubt = confidence.iter().map(|c| 2.0 * (1.0 - c)).collect();
        garment.attributes.insert("doubt".into(), doubt);
    }
    for (name, caption) in [("doubt", "how unsure its border is"), ("filled", "filled: nobody saw it")] {
        if garment.attributes.contains_key(name) {
            pictures.extend(maps(&garment, name, (0.0, 1.0), "", caption)?);
        }
    }
    Ok(pictures)
}

/// A map of an attribute, front and back, in the one scale of the page: dark is low, bright is high.
fn maps(mesh: &Mesh, name: &str, range: (f32, f32), unit: &str, caption: &str) -> Result<Vec<Picture>, RenderError> {
    let side = |(heading, side): (f64, &str)| -> Result<Picture, RenderError> {
        let drawn = [Drawn::attribute(mesh, name, range)];
        let mut map = one(&drawn, &View::around(heading, 0.0), &format!("{caption}, {side}"))?;
        map.image = sheet::scale_bar(&map.image, range, unit);
        Ok(map)
    };
    [(0.0, "front"), (PI, "back")].into_iter().map(side).collect()
}

/// All layers beside one another, inside to outside from left to right.
///
/// # Errors
/// [`RenderError`] where a mesh cannot be drawn.
pub fn exploded(layers: &[&Mesh]) -> Result<Vec<Picture>, RenderError> {
    let mut right = 0.0;
    let mut apart = Vec::new();
    for mesh in layers {
        let Some((low, high)) = mesh.bounds() else { continue };
        let mut moved = Mesh::clone(mesh);
        moved.positions.iter_mut().for_each(|p| p.x += right - low.x);
        right += high.x - low.x + BETWEEN;
        apart.push(moved);
    }
    let drawn: Vec<Drawn> = apart.iter().map(Drawn::colored).collect();
    let width = SIZE.0 * layers.len().clamp(1, 6) as u32;
    let image = picture(&drawn, &View::front(), width, SIZE.1)?;
    Ok(vec![Picture { caption: "all layers apart, front".into(), image }])
}

/// All layers together from front, side and back.
///
/// # Errors
/// [`RenderError`] where a mesh cannot be drawn.
pub fn dressed(layers: &[&Mesh]) -> Result<Vec<Picture>, RenderError> {
    let drawn: Vec<Drawn> = layers.iter().map(|m| Drawn::colored(m)).collect();
    turn(&drawn, &["front", "left side", "back"])
}

/// All layers at several times of a motion, each time framed by itself.
///
/// # Errors
/// [`RenderError`] where a mesh cannot be drawn.
pub fn motion(frames: &[(String, Vec<Mesh>)]) -> Result<Vec<Picture>, RenderError> {
    let framed = |(caption, layers): &(String, Vec<Mesh>)| {
        let drawn: Vec<Drawn> = layers.iter().map(Drawn::colored).collect();
        one(&drawn, &View::around(0.6, 0.1), caption)
    };
    frames.iter().map(framed).collect()
}

/// The mesh with its vertices' distances to `body` in millimetres.
fn with_distances(scan: &Mesh, body: &Mesh) -> Mesh {
    let bvh = Bvh::new(&body.positions, &body.triangles);
    let distance = |p: &Point3<f32>| bvh.closest(p, f32::INFINITY).map_or(f32::NAN, |hit| hit.distance * 1e3);
    let mut mapped = scan.clone();
    mapped.attributes.insert(DISTANCE.into(), scan.positions.par_iter().map(distance).collect());
    mapped
}

fn turn(drawn: &[Drawn], names: &[&str; 3]) -> Result<Vec<Picture>, RenderError> {
    let box_of_all = bounds(drawn.iter().map(|d| d.mesh));
    let headings = [0.0, FRAC_PI_2, PI];
    headings
        .iter()
        .zip(names)
        .map(|(&heading, name)| {
            let view = View { bounds: box_of_all, ..View::around(heading, 0.0) };
            one(drawn, &view, name)
        })
        .collect()
}

fn one(drawn: &[Drawn], view: &View, caption: &str) -> Result<Picture, RenderError> {
    Ok(Picture { caption: caption.into(), image: picture(drawn, view, SIZE.0, SIZE.1)? })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_section_of_a_tetrahedron_is_a_triangle_at_that_height() {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]].map(Point3::from);
        let mesh = Mesh::new(corners.to_vec(), vec![[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]]);
        let pieces = section(&mesh, 0.25);
        assert_eq!(pieces.len(), 3);
        let length: f64 = pieces.iter().map(|p| (Point3::from(p[0]) - Point3::from(p[1])).norm()).sum();
        assert!((length - 0.75 * (2.0 + 2f64.sqrt())).abs() < 1e-6, "{length}");
        assert!(pieces.iter().flatten().all(|p| (p[1] - 0.25).abs() < 1e-6));
        assert!(section(&mesh, 1.5).is_empty());
    }
}
