//! The rough mesh of a garment: what is moved in place of the scanned mesh.

use nalgebra::{Point3, Vector3};
use toile_character::{PosedSkin, Skinner};
use toile_geometry::{bvh::Bvh, remesh, topology::Edges};

use super::{
    class::{Class, HalfSphere, floating, on_limb},
    hit::{HITS, Hit},
    link::Link,
    on::On,
};
use crate::{
    AnimationError,
    blend::{
        anchors::{Closeness, frequency},
        layer::OutfitLayer,
        proxy::carried_over,
        ride::Ride,
    },
};

/// Vertices that a rough mesh aims at: edges of some 35 mm on a pair of trousers.
const VERTICES: f64 = 900.0;
/// Shortest edge, metres: half the thickness of a wrist.
const SHORTEST_EDGE: f64 = 0.025;

/// The rough mesh of a garment and how it moves.
pub(super) struct Rough {
    pub triangles: Vec<[u32; 3]>,
    pub skinner: Skinner,
    pub skin: PosedSkin,
    pub classes: Vec<Class>,
    /// How far each vertex floats: 0 on the skin, 1 where it hangs free.
    pub floats: Vec<f32>,
    /// Frequency of the spring to the skinned place, rad/s.
    pub frequencies: Vec<f32>,
    pub half_spheres: Vec<HalfSphere>,
    pub links: Vec<Link>,
    pub ride: Ride,
    /// Skinned places before and at the end of a piece of a frame.
    pub from: Vec<Point3<f32>>,
    pub to: Vec<Point3<f32>>,
    pub places: Vec<Point3<f32>>,
    pub before: Vec<Point3<f32>>,
    pub velocities: Vec<Vector3<f32>>,
    pub hits: Vec<[Hit; HITS]>,
    /// Height over the surface of each lower layer at rest, metres; infinite where none is near.
    pub heights: Vec<Vec<f32>>,
    /// What each vertex lies on.
    pub on: Vec<Option<On>>,
    /// Where the rough mesh was at the start of the piece, for the layers above.
    pub start: Vec<Point3<f32>>,
    pub bvh: Bvh,
    /// Displacements from the skinned places, metres.
    pub moved: Vec<Vector3<f32>>,
}

impl Rough {
    /// Of a garment over the body of `closeness`.
    pub fn new(layer: &OutfitLayer, closeness: &Closeness) -> Result<Self, AnimationError> {
        let wrong = |reason: String| AnimationError::Motion(format!("layer {}: {reason}", layer.name));
        // An equilateral triangle of edge e has an area of 0.433 e², and there are two a vertex.
        let edge = (layer.mesh.area() / (2.0 * VERTICES * 0.433)).sqrt().max(SHORTEST_EDGE);
        let mesh = remesh::isotropic(&layer.mesh, edge as f32);
        let (weights, free) = carried_over(&layer.mesh, &layer.weights, &mesh);
        let n = mesh.positions.len();
        let over: Option<Vec<_>> = (0..n).map(|v| closeness.foot(&mesh.positions[v])).collect();
        let over = over.ok_or_else(|| wrong("there is no body below it".into()))?;
        let distance = |v: usize| (mesh.positions[v] - over[v].0).norm();
        let class = |v: usize| Class::of(distance(v), free[v] as f32, on_limb(&weights, v));
        let classes: Vec<Class> = (0..n).map(class).collect();
        let sphere = |v: usize| HalfSphere::new(mesh.positions[v] - over[v].0, over[v].1, 0.0);
        let places = mesh.positions.clone();
        Ok(Self {
            frequencies: (0..n).map(|v| frequency(f64::from(distance(v)), free[v]) as f32).collect(),
            floats: (0..n).map(|v| floating(distance(v), free[v] as f32)).collect(),
            half_spheres: (0..n).map(sphere).collect(),
            links: links(&mesh.positions, &mesh.triangles, &classes),
            ride: Ride::new(&layer.mesh, &mesh),
            skinner: Skinner::new(&mesh, &weights).map_err(|e| wrong(e.to_string()))?,
            skin: PosedSkin::with_frames(),
            bvh: Bvh::new(&places, &mesh.triangles),
            triangles: mesh.triangles,
            velocities: vec![Vector3::zeros(); n],
            hits: vec![[Hit::NONE; HITS]; n],
            heights: Vec::new(),
            on: Vec::new(),
            moved: vec![Vector3::zeros(); n],
            from: places.clone(),
            to: places.clone(),
            start: places.clone(),
            before: places.clone(),
            places,
            classes,
        })
    }
}

/// Along each edge of particles, and across each edge from corner to corner, which keeps the sheet from folding.
fn links(places: &[Point3<f32>], triangles: &[[u32; 3]], classes: &[Class]) -> Vec<Link> {
    let edges = Edges::new(triangles);
    let pulls = |a: u32, b: u32| classes[a as usize].is_particle() || classes[b as usize].is_particle();
    let link = |a: u32, b: u32, along: bool| {
        let length = (places[a as usize] - places[b as usize]).norm();
        let mobile = |v: u32| f32::from(u8::from(classes[v as usize].is_particle()));
        Link { ends: [a, b], mobile: [mobile(a), mobile(b)], length, along }
    };
    let mut links: Vec<Link> =
        edges.vertices.iter().filter(|[a, b]| pulls(*a, *b)).map(|&[a, b]| link(a, b, true)).collect();
    for (e, [t, u]) in edges.triangles().into_iter().enumerate().filter(|(_, [_, u])| *u != u32::MAX) {
        let ends = edges.vertices[e];
        let apex = |t: u32| triangles[t as usize].into_iter().find(|v| !ends.contains(v));
        if let (Some(a), Some(b)) = (apex(t), apex(u))
            && pulls(a, b)
        {
            links.push(link(a, b, false));
        }
    }
    links
}
