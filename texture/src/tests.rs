//! A ball with prints on a turntable, under a lamp that rests, seen by a camera whose exposure drifts.

use nalgebra::{Point3, Translation3, UnitQuaternion, Vector3};
use toile_capture::{ColorImage, RgbImage};
use toile_geometry::{
    Mesh, Rigid,
    camera::PinholeCamera,
    raster::{Camera, rasterize},
};

use crate::{
    Atlas, Photo, Texture, TextureError, TextureSettings,
    atlas::area,
    bake, fitting_size,
    photo::{linear_of_srgb, srgb_of_linear},
    raster, unwrap,
};

const RADIUS: f32 = 0.3;

/// A tube around a circle: with a thick circle and a thin tube none is a graph over any plane.
fn ring(circle: f32, tube: f32, around: usize, across: usize) -> Mesh {
    let turn = |i: usize, n: usize| std::f32::consts::TAU * i as f32 / n as f32;
    let point = |i: usize| {
        let ((s, c), (t, d)) = (turn(i / across, around).sin_cos(), turn(i % across, across).sin_cos());
        Point3::new((circle + tube * d) * c, tube * t, (circle + tube * d) * s)
    };
    let at = |i: usize, j: usize| (i % around * across + j % across) as u32;
    let cell = |k: usize| {
        let (i, j) = (k / across, k % across);
        [[at(i, j), at(i, j + 1), at(i + 1, j)], [at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)]]
    };
    Mesh::new((0..around * across).map(point).collect(), (0..around * across).flat_map(cell).collect())
}

fn ball() -> Mesh {
    let (rows, columns) = (60, 120);
    let point = |i: usize| {
        let polar = std::f32::consts::PI * ((i / columns) as f32 + 0.5) / rows as f32;
        let (sin, cos) = (std::f32::consts::TAU * (i % columns) as f32 / columns as f32).sin_cos();
        Point3::new(polar.sin() * cos, polar.cos(), polar.sin() * sin) * RADIUS
    };
    let cell = |k: usize| {
        let (i, j) = (k / columns, k % columns);
        let at = |i: usize, j: usize| (i * columns + j % columns) as u32;
        [[at(i, j), at(i, j + 1), at(i + 1, j)], [at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)]]
    };
    let triangles = (0..(rows - 1) * columns).flat_map(cell).collect();
    Mesh::new((0..rows * columns).map(point).collect(), triangles)
}

/// The ball's own colour: stripes of 30 mm on a ground that changes slowly.
fn own_color(p: &Point3<f32>) -> [f32; 3] {
    let stripe = if (p.x * 4.0).sin() > 0.0 { 0.5 + 0.35 * (std::f32::consts::TAU * p.y / 0.03).sin() } else { 0.6 };
    [stripe * 0.8, stripe * (0.5 + 0.3 * (5.0 * p.z).sin()), stripe * 0.4]
}

/// Pictures of the whole turn, light and exposure on them.
fn photos(mesh: &Mesh) -> Vec<Photo> {
    let camera = PinholeCamera::ideal(420, 420, 460.0, 460.0, 209.5, 209.5);
    let lamp = Vector3::new(0.6f32, -0.5, -0.6).normalize();
    let photo = |k: u32| {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), f64::from(k) * std::f64::consts::TAU / 24.0);
        let facing = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        let pose = Rigid::from_parts(Translation3::new(0.0, 0.0, 1.2), facing * turn);
        let raster = rasterize(mesh, &Camera { lens: camera, camera_from_world: pose });
        let exposure = 0.8 + 0.15 * (k as f32 * 0.7).sin();
        let shade = |i: usize| {
            let Some((t, w)) = raster.hit(i) else { return [200; 3] };
            let [a, b, c] = mesh.corners(t).map(|p| p.coords);
            let p = Point3::from(a * w[0] + b * w[1] + c * w[2]);
            let normal = pose.rotation.cast::<f32>() * p.coords.normalize();
            let light = exposure * (0.4 + 0.7 * normal.dot(&lamp).max(0.0));
            own_color(&p).map(|c| (srgb_of_linear((c * light).min(1.0)) * 255.0).round() as u8)
        };
        let pixels = (0..420 * 420).map(shade).collect();
        let image = ColorImage::Rgb(RgbImage { width: 420, height: 420, pixels }.into());
        let room_from_camera = UnitQuaternion::identity();
        Photo { frame: u64::from(k), camera, camera_from_surface: pose, room_from_camera, image }
    };
    (0..24).map(photo).collect()
}

fn settings() -> TextureSettings {
    TextureSettings { size: 1024, ..TextureSettings::default() }
}

/// Root of the mean squared difference of logarithms of brightness from the ball's own, after one gain, away from the poles.
fn error(mesh: &Mesh, atlas: &Atlas, texture: &Texture) -> f32 {
    let size = texture.size as usize;
    let rest = |(v, uv): (&u32, &[f32; 2])| {
        let p = mesh.positions[*v as usize];
        let [x, y] = uv.map(|c| ((c * size as f32) as usize).min(size - 1));
        let found = texture.pixels[y * size + x].map(|c| linear_of_srgb(f32::from(c) / 255.0));
        let is_told = p.y.abs() < 0.8 * RADIUS;
        is_told.then(|| (found.iter().sum::<f32>().max(1e-3) / own_color(&p).iter().sum::<f32>()).ln())
    };
    let all: Vec<f32> = atlas.source.iter().zip(&atlas.uv).filter_map(rest).collect();
    let mean = all.iter().sum::<f32>() / all.len() as f32;
    (all.iter().map(|r| (r - mean).powi(2)).sum::<f32>() / all.len() as f32).sqrt()
}

#[test]
fn light_and_exposure_are_taken_out_and_stripes_stay() {
    let mesh = ball();
    let (photos, settings) = (photos(&mesh), settings());
    let atlas = unwrap(&mesh, &settings).unwrap();
    let bake = |settings: &TextureSettings| bake(&mesh, &atlas, &photos, settings, &|_| {}).unwrap();
    let even = error(&mesh, &atlas, &bake(&settings));
    let lit = error(&mesh, &atlas, &bake(&TextureSettings { even_light: false, ..settings }));
    assert!(even < 0.12 && lit > 1.3 * even, "{even} with the light taken out, {lit} with it");
}

#[test]
fn any_number_of_threads_bakes_the_same() {
    let mesh = ball();
    let (photos, settings) = (photos(&mesh), settings());
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let atlas = unwrap(&mesh, &settings).unwrap();
            let texture = bake(&mesh, &atlas, &photos[..8], &settings, &|_| {}).unwrap();
            (atlas, texture.to_jpeg().unwrap(), texture)
        })
    };
    let (one, three) = (with(1), with(3));
    assert!(one == three);
    assert_eq!(one.2.seen.iter().filter(|s| **s == 128).count() > 0, one.2.report.seen_percent < 100.0);
}

#[test]
fn an_atlas_turns_nothing_over_and_folds_nothing() {
    for mesh in [ball(), ring(0.25, 0.08, 120, 50)] {
        let atlas = unwrap(&mesh, &settings()).unwrap();
        assert_eq!(raster::folded(&atlas), [0u32; 0]);
        let areas: Vec<f32> = (0..mesh.triangles.len()).map(|t| area(atlas.texels(t))).collect();
        let sign = areas[0].signum();
        assert!(areas.iter().all(|a| a * sign > 0.0), "a triangle is turned over");
        assert!(atlas.uv.iter().flatten().all(|c| (0.0..=1.0).contains(c)));
        assert!(atlas.used() > 0.45, "{}", atlas.used());
        for (own, made) in mesh.triangles.iter().zip(&atlas.triangles) {
            assert_eq!(*own, made.map(|v| atlas.source[v as usize]));
        }
    }
}

#[test]
fn pictures_of_another_size_or_of_nothing_are_refused() {
    let mesh = ball();
    let atlas = unwrap(&mesh, &settings()).unwrap();
    let refused = |photos: &[Photo]| bake(&mesh, &atlas, photos, &settings(), &|_| {}).unwrap_err();
    let mut photos = photos(&mesh);
    assert_eq!(fitting_size(&mesh, &photos, &TextureSettings::default()), 2048);
    photos.iter_mut().for_each(|photo| photo.camera.width = 640);
    let error = refused(&photos);
    assert!(matches!(error, TextureError::Size { frame: 0, width: 420, .. }), "{error}");
    photos.iter_mut().for_each(|photo| photo.camera_from_surface.translation.z = -5.0);
    assert!(matches!(refused(&photos), TextureError::NothingSeen { photos: 24 }));
    let wrong = TextureSettings { size: 3000, ..TextureSettings::default() };
    assert!(unwrap(&mesh, &wrong).unwrap_err().to_string().contains("3000"));
}
