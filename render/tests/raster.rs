//! The rasteriser against brute-force rays, and its promises.

use nalgebra::{Point3, Vector3};
use proptest::prelude::*;
use toile_geometry::{Mesh, Rigid, bvh::Bvh, camera::PinholeCamera};
use toile_render::{Camera, Drawn, NOTHING, Paint, View, picture, rasterize};

/// A bumpy closed surface of a few thousand triangles around the origin.
fn bumpy_ball(radius: f32) -> Mesh {
    let (rings, sides) = (48, 64);
    let mut positions = Vec::new();
    for i in 0..=rings {
        let polar = std::f32::consts::PI * i as f32 / rings as f32;
        for j in 0..sides {
            let around = std::f32::consts::TAU * j as f32 / sides as f32;
            let r = radius * (1.0 + 0.15 * (5.0 * around).sin() * polar.sin() + 0.1 * (7.0 * polar).cos());
            positions.push(Point3::new(
                r * polar.sin() * around.cos(),
                r * polar.cos(),
                r * polar.sin() * around.sin(),
            ));
        }
    }
    let at = |i: usize, j: usize| (i * sides + j % sides) as u32;
    let quads = (0..rings).flat_map(|i| (0..sides).map(move |j| (i, j)));
    let triangles = quads
        .flat_map(|(i, j)| [[at(i, j), at(i + 1, j + 1), at(i + 1, j)], [at(i, j), at(i, j + 1), at(i + 1, j + 1)]])
        .collect();
    Mesh::new(positions, triangles)
}

fn camera(distance: f64, yaw: f64) -> Camera {
    let lens = PinholeCamera::ideal(96, 80, 75.0, 80.0, 46.3, 41.1);
    Camera { lens, camera_from_world: Rigid::new(Vector3::new(0.02, -0.03, distance), Vector3::new(0.3, yaw, 0.1)) }
}

/// Every pixel's ray cast through the mesh: depth along +Z, or 0.
fn cast(mesh: &Mesh, camera: &Camera) -> Vec<f32> {
    let in_camera = mesh.transformed(&camera.camera_from_world);
    let bvh = Bvh::new(&in_camera.positions, &in_camera.triangles);
    let rays = camera.lens.rays();
    let hit = |[x, y]: &[f32; 2]| bvh.ray(&Point3::origin(), &Vector3::new(*x, *y, 1.0), f32::INFINITY);
    rays.iter().map(|ray| hit(ray).map_or(0.0, |h| h.t)).collect()
}

#[test]
fn depth_is_what_rays_find() {
    let mesh = bumpy_ball(0.5);
    for (distance, yaw) in [(1.5, 0.0), (0.9, 1.0), (0.75, 2.5)] {
        let camera = camera(distance, yaw);
        let (raster, truth) = (rasterize(&mesh, &camera), cast(&mesh, &camera));
        // A ray that grazes an edge may hit for one and miss for the other, or see the surface behind.
        let wrong = raster.depth.iter().zip(&truth).filter(|(a, b)| (*a - *b).abs() > 1e-4).count();
        assert!(wrong <= 2, "{wrong} pixels differ at {distance} m");
        assert!(raster.depth.iter().filter(|&&z| z > 0.0).count() > 1000);
    }
}

#[test]
fn barycentrics_give_the_pixel_back() {
    let mesh = bumpy_ball(0.5);
    let camera = camera(1.2, 0.7);
    let raster = rasterize(&mesh, &camera);
    for pixel in 0..raster.depth.len() {
        let Some((t, w)) = raster.hit(pixel) else {
            assert_eq!((raster.depth[pixel], raster.triangle[pixel]), (0.0, NOTHING));
            continue;
        };
        let [a, b, c] = mesh.corners(t);
        let world = toile_geometry::triangle::at(w, &a, &b, &c);
        let p = camera.camera_from_world * world.cast::<f64>();
        let q = camera.lens.project(&p).unwrap();
        assert!((p.z - f64::from(raster.depth[pixel])).abs() < 1e-5);
        assert!((q.x - (pixel % 96) as f64).abs() < 2e-3 && (q.y - (pixel / 96) as f64).abs() < 2e-3, "{q}");
    }
}

#[test]
fn a_camera_inside_sees_the_mesh_all_around() {
    let mesh = bumpy_ball(0.5);
    let camera = camera(0.05, 0.4);
    let (raster, truth) = (rasterize(&mesh, &camera), cast(&mesh, &camera));
    assert!(raster.depth.iter().zip(&truth).all(|(a, b)| *a > 0.0 && (a - b).abs() < 1e-4));
}

#[test]
fn a_plane_through_the_camera_is_cut_at_the_near_plane() {
    let floor = Mesh::new(
        vec![Point3::new(-9.0, 1.0, -9.0), Point3::new(9.0, 1.0, -9.0), Point3::new(0.0, 1.0, 40.0)],
        vec![[0, 1, 2]],
    );
    let camera = Camera { camera_from_world: Rigid::identity(), ..camera(1.0, 0.0) };
    let (raster, truth) = (rasterize(&floor, &camera), cast(&floor, &camera));
    let seen = truth.iter().filter(|&&z| z > 0.0).count();
    assert!(seen > 500);
    assert!(raster.depth.iter().zip(&truth).all(|(a, b)| (a - b).abs() < 1e-3 * b.max(1.0)));
}

#[test]
fn same_bytes_for_any_number_of_threads() {
    let mesh = bumpy_ball(0.5);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let drawn = [Drawn::clay(&mesh)];
            (rasterize(&mesh, &camera(1.2, 0.0)), picture(&drawn, &View::front(), 60, 70).unwrap().into_raw())
        })
    };
    assert!(run(1) == run(3));
}

#[test]
fn transparent_layers_mix_and_opaque_ones_hide() {
    let quad = |z: f32| {
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let positions = corners.iter().map(|&(x, y)| Point3::new(x, y, z)).collect();
        Mesh::new(positions, vec![[0, 1, 2], [0, 2, 3]])
    };
    let (near, far) = (quad(0.5), quad(0.0));
    let centre = |opacity: f32| {
        let drawn = [Drawn::solid(&near, [250, 0, 0], opacity), Drawn::solid(&far, [0, 0, 250], 1.0)];
        picture(&drawn, &View::front(), 40, 40).unwrap().get_pixel(20, 20).0
    };
    assert!(centre(1.0)[2] < 5 && centre(1.0)[0] > 150);
    assert!(centre(0.0)[0] < 5 && centre(0.0)[2] > 150);
    assert!(centre(0.5)[0] > 100 && centre(0.5)[2] > 100);
}

#[test]
fn bad_input_is_refused_by_name() {
    let mut mesh = bumpy_ball(0.5);
    let missing = Drawn { mesh: &mesh, paint: Paint::Attribute("strain".into(), (0.0, 1.0)), opacity: 1.0 };
    let error = picture(&[missing], &View::front(), 10, 10).unwrap_err().to_string();
    assert!(error.contains("strain"), "{error}");
    assert!(picture(&[], &View::front(), 10, 10).is_err());
    assert!(picture(&[Drawn::clay(&mesh)], &View::front(), 0, 10).is_err());
    mesh.triangles[3] = [0, 1, 999_999];
    let error = picture(&[Drawn::clay(&mesh)], &View::front(), 10, 10).unwrap_err().to_string();
    assert!(error.contains("mesh 0"), "{error}");
}

proptest! {
    #[test]
    fn two_triangles_sharing_an_edge_leave_no_gap(x in -0.9f32..0.9, y in -0.9f32..0.9, z in 1.0f32..3.0) {
        let corners = [(-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)];
        let mut positions: Vec<_> = corners.iter().map(|&(x, y)| Point3::new(x, y, 1.0)).collect();
        positions.push(Point3::new(x, y, z));
        let fan = Mesh::new(positions, vec![[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]);
        let lens = PinholeCamera::ideal(32, 32, 20.0, 20.0, 15.5, 15.5);
        let raster = rasterize(&fan, &Camera { lens, camera_from_world: Rigid::identity() });
        prop_assert!(raster.depth.iter().all(|&z| z > 0.0));
    }
}
