//! Levels of detail that keep their places in the texture.
//!
//! Edges are collapsed onto one of their ends, cheapest first under quadric error (Garland and Heckbert 1997), so that every vertex that is left is one of
//! the mesh's, with its place in the texture and everything else that is known of it. A vertex on a border of charts goes along that border only, on both
//! sides at once, as in Hoppe 1999 ("New quadric metric for simplifying meshes with appearance attributes"); one where three charts meet stays.

mod cost;
mod seamed;
mod state;

pub use seamed::Seamed;
use state::State;

/// Simplifies a surface to each of `targets` triangles, which fall; returns the triangles of each level, in vertices of the texture.
///
/// Outlines of charts move by at most `room`; where a level has too many triangles then, by twice as much: they come nearer to the next chart than to their
/// own, but not into it. A level still has more triangles than asked for where no edge can be collapsed without that, without folding the surface or a chart, or
/// without changing its topology. O(n log n); the same for any number of threads.
pub fn simplify(surface: &Seamed, targets: &[usize]) -> Vec<Vec<[u32; 3]>> {
    let mut state = State::new(surface);
    let level = |&target: &usize| {
        let before = state.clone();
        while state.alive > target && state.round(target) > 0 {}
        if state.alive > target {
            // From the start, so that the inside of charts is not used up first.
            state = before;
            state.room = 2.0 * surface.room;
            while state.alive > target && state.round(target) > 0 {}
        }
        state.triangles()
    };
    targets.iter().map(level).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use nalgebra::{Point3, Vector3};
    use toile_geometry::{Mesh, bvh::Bvh, topology::Edges};

    use super::*;
    use crate::{Atlas, Shape, TextureSettings, raster, relief, unwrap};

    /// A closed bumpy ball of 0.3 m: waves of 60 mm, 3 mm high.
    fn ball(rows: usize, columns: usize) -> Mesh {
        let point = |row: usize, column: usize| {
            let (s, c) = (std::f32::consts::PI * row as f32 / rows as f32).sin_cos();
            let (t, d) = (std::f32::consts::TAU * column as f32 / columns as f32).sin_cos();
            let way = Vector3::new(s * d, c, s * t);
            Point3::from(way * (0.3 + 0.003 * (way.x * 31.0).sin() * (way.y * 31.0).sin()))
        };
        let mut positions = vec![point(0, 0), point(rows, 0)];
        positions.extend((1..rows).flat_map(|r| (0..columns).map(move |c| (r, c))).map(|(r, c)| point(r, c)));
        let at = |r: usize, c: usize| match r {
            0 => 0,
            _ if r == rows => 1,
            _ => (2 + (r - 1) * columns + c % columns) as u32,
        };
        let cell = |k: usize| {
            let (r, c) = (k / columns, k % columns);
            let [a, b, d, e] = [at(r, c), at(r + 1, c), at(r, c + 1), at(r + 1, c + 1)];
            [[a, d, b], [b, d, e]]
        };
        let whole = |t: &[u32; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
        let triangles = (0..rows * columns).flat_map(cell).filter(whole).collect();
        let mut mesh = Mesh::new(positions, triangles);
        mesh.recompute_normals();
        mesh
    }

    const ROOM: f32 = 7.0 / 4096.0;

    fn textured() -> (Mesh, Atlas) {
        let mesh = ball(90, 180);
        let settings = TextureSettings { size: 1024, padding: 8, ..TextureSettings::default() };
        let atlas = unwrap(&mesh, &settings).unwrap().in_order(mesh.positions.len());
        (mesh, atlas)
    }

    fn simplified(mesh: &Mesh, atlas: &Atlas, targets: &[usize]) -> Vec<Vec<[u32; 3]>> {
        let (positions, source, uv, triangles) = (&mesh.positions, &atlas.source, &atlas.uv, &atlas.triangles);
        simplify(&Seamed { positions, source, uv, triangles, room: ROOM }, targets)
    }

    #[test]
    fn levels_stay_closed_near_and_in_their_places() {
        let (mesh, atlas) = textured();
        assert!(mesh.signed_volume() > 0.0);
        let bvh = Bvh::new(&mesh.positions, &mesh.triangles);
        let sign = crate::atlas::area(atlas.texels(0)).signum();
        for (level, target) in simplified(&mesh, &atlas, &[8000, 3000]).iter().zip([8000, 3000]) {
            assert!(level.len() <= target && level.len() > target * 9 / 10, "{} of {target}", level.len());
            let welded: Vec<[u32; 3]> = level.iter().map(|t| t.map(|v| atlas.source[v as usize])).collect();
            assert!(Edges::new(&welded).is_closed(), "seams must not open");
            let simple = Mesh::new(mesh.positions.clone(), welded);
            let middle = |t: usize| {
                let [a, b, c] = simple.corners(t);
                Point3::from((a.coords + b.coords + c.coords) / 3.0)
            };
            // Waves of 3 mm either way, and up to 2 mm inside of a ball of 0.3 m where edges are twice as long as on average.
            let far = (0..level.len())
                .filter_map(|t| bvh.closest(&middle(t), 1.0))
                .map(|hit| hit.distance)
                .fold(0.0, f32::max);
            assert!(far < 0.008, "{far} m from the surface");
            let flat = Atlas { triangles: level.clone(), ..atlas.clone() };
            let areas = (0..level.len()).map(|t| crate::atlas::area(flat.texels(t)) * sign);
            assert!(areas.fold(f32::MAX, f32::min) > 0.0, "a triangle is turned over in the picture");
            if target == 8000 {
                assert_eq!(raster::folded(&flat), [0u32; 0], "charts must stay apart");
            }
            let kept: BTreeSet<u32> = level.iter().flatten().copied().collect();
            assert!(kept.len() < atlas.source.len() / 3);
        }
    }

    #[test]
    fn a_border_stays_and_a_surface_without_a_texture_is_simplified_too() {
        let whole = ball(40, 80);
        let (mesh, _) = whole.filter_triangles(|t| whole.corners(t).iter().all(|p| p.y < 0.1));
        let source: Vec<u32> = (0..mesh.positions.len() as u32).collect();
        let surface =
            Seamed { positions: &mesh.positions, source: &source, uv: &[], triangles: &mesh.triangles, room: 0.0 };
        let level = &simplify(&surface, &[800])[0];
        assert!(level.len() <= 800, "{}", level.len());
        let top = |triangles: &[[u32; 3]]| {
            triangles.iter().flatten().map(|&v| mesh.positions[v as usize].y).fold(f32::MIN, f32::max)
        };
        assert!((top(level) - top(&mesh.triangles)).abs() < 0.01);
        assert!((Mesh::new(mesh.positions.clone(), level.clone()).area() / mesh.area() - 1.0).abs() < 0.03);
        assert_eq!(simplify(&surface, &[1_000_000])[0], mesh.triangles, "what has few triangles stays");
    }

    #[test]
    fn the_same_for_any_number_of_threads() {
        let (mesh, atlas) = textured();
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| simplified(&mesh, &atlas, &[4000]))
        };
        assert_eq!(with(1), with(3));
    }

    /// Mean angle, degrees, between the normals of the whole surface and those of a level, with its normal map and without, at the texels that both have.
    fn angles(mesh: &Mesh, atlas: &Atlas, level: &[[u32; 3]]) -> [f64; 2] {
        const SIZE: usize = 1024;
        let welded: Vec<[u32; 3]> = level.iter().map(|t| t.map(|v| atlas.source[v as usize])).collect();
        let normals = toile_geometry::mesh::vertex_normals(&mesh.positions, &welded);
        let of = |normals: &[Vector3<f32>]| atlas.source.iter().map(|&v| normals[v as usize]).collect::<Vec<_>>();
        let (fine, simple) = (of(&mesh.normals), of(&normals));
        let fine = Shape { uv: &atlas.uv, normals: &fine, triangles: &atlas.triangles };
        let simple = Shape { uv: &atlas.uv, normals: &simple, triangles: level };
        // Any tangents will do as long as the one who reads the map has the same.
        let along =
            |n: &Vector3<f32>| (Vector3::new(0.3, 0.9, -0.2) - n * n.dot(&Vector3::new(0.3, 0.9, -0.2))).normalize();
        let tangents: Vec<[f32; 4]> = simple.normals.iter().map(along).map(|t| [t.x, t.y, t.z, 1.0]).collect();
        let map = relief(&fine, &simple, &tangents, SIZE as u32);
        let draw = |shape: &Shape| {
            let mut found = vec![None; SIZE * SIZE];
            let atlas = Atlas { size: SIZE as u32, triangles: shape.triangles.to_vec(), ..atlas.clone() };
            let corners = |t: usize| shape.triangles[t];
            raster::draw(&atlas, &mut found, corners, |corners, w, texel| {
                let mixed =
                    |of: &dyn Fn(u32) -> Vector3<f32>| (0..3).map(|k| of(corners[k]) * w[k]).sum::<Vector3<f32>>();
                let normal = mixed(&|v| shape.normals[v as usize]);
                let tangent = mixed(&|v| Vector3::from_row_slice(&tangents[v as usize][..3]));
                *texel = Some((normal, tangent));
            });
            found
        };
        let (mut sums, mut count) = ([0.0; 2], 0.0);
        for (texel, (wanted, found)) in draw(&fine).into_iter().zip(draw(&simple)).enumerate() {
            let (Some((wanted, _)), Some((normal, tangent))) = (wanted, found) else { continue };
            let [x, y, z] = map[texel].map(|c| (f32::from(c) - 127.5) / 127.5);
            let mapped = tangent * x + normal.cross(&tangent) * y + normal * z;
            sums[0] += f64::from(mapped.angle(&wanted).to_degrees());
            sums[1] += f64::from(normal.angle(&wanted).to_degrees());
            count += 1.0;
        }
        sums.map(|sum| sum / count)
    }

    #[test]
    fn a_normal_map_gives_a_level_the_relief_that_it_lost() {
        let (mesh, atlas) = textured();
        let [with, without] = angles(&mesh, &atlas, &simplified(&mesh, &atlas, &[2000])[0]);
        assert!(with < 1.0 && without > 4.0 * with, "{with} degrees with the map, {without} without");
    }
}
