//! Disk, floor and wall.

use nalgebra::Point3;
use toile_geometry::Mesh;

/// Radius of the disk, metres.
pub const DISK_RADIUS: f32 = 0.45;
/// How far the disk's top is above the floor, metres.
const DISK_HEIGHT: f32 = 0.08;
/// Edge of the disk's checks, metres.
const CHECK: f32 = 0.075;
/// Edge of the floor's and wall's tiles, metres.
const TILE: f32 = 0.3;
/// Depth of the wall behind the axis, metres.
const WALL_Z: f32 = -1.3;
/// Half the width of floor and wall, metres.
const HALF_WIDTH: f32 = 1.2;
/// Height of the wall over the floor, metres.
const WALL_HEIGHT: f32 = 1.6;

/// The disk, its top at y = 0 around the y axis: a checked top and a plain rim. It turns with the subject.
pub fn disk() -> Mesh {
    /// Quads a check along each edge, so that checks follow the circle.
    const FINE: i32 = 3;
    const SIDES: usize = 96;
    let mut disk = Mesh::default();
    let n = (DISK_RADIUS / CHECK).ceil() as i32;
    let size = CHECK / FINE as f32;
    for i in -n * FINE..n * FINE {
        for j in -n * FINE..n * FINE {
            let dark = (i.div_euclid(FINE) + j.div_euclid(FINE)).rem_euclid(2) == 0;
            let corner = |a: i32, b: i32| onto_disk((i + a) as f32 * size, (j + b) as f32 * size);
            let color = if dark { [46, 46, 54] } else { [92, 94, 104] };
            add_quad(&mut disk, [corner(0, 0), corner(0, 1), corner(1, 1), corner(1, 0)], color);
        }
    }
    for k in 0..SIDES {
        let at = |k: usize, y: f32| {
            let (sin, cos) = (std::f32::consts::TAU * k as f32 / SIDES as f32).sin_cos();
            Point3::new(DISK_RADIUS * sin, y, DISK_RADIUS * cos)
        };
        let rim = [at(k, -DISK_HEIGHT), at(k + 1, -DISK_HEIGHT), at(k + 1, 0.0), at(k, 0.0)];
        add_quad(&mut disk, rim, [60, 60, 66]);
    }
    disk
}

/// A point of the top; beyond the rim the nearest point of the rim.
fn onto_disk(x: f32, z: f32) -> Point3<f32> {
    let scale = (DISK_RADIUS / x.hypot(z).max(1e-6)).min(1.0);
    Point3::new(x * scale, 0.0, z * scale)
}

/// Floor and, where sensors look from one side alone, a wall; they stand still. Room frame: the disk's axis is y, its top y = 0, the camera on the +z side.
pub fn floor_and_wall(with_wall: bool) -> Mesh {
    let mut room = Mesh::default();
    let tiles = |length: f32| (length / TILE).round() as i32;
    for i in 0..tiles(2.0 * HALF_WIDTH) {
        let (x, wide) = (-HALF_WIDTH + i as f32 * TILE, TILE);
        for j in 0..tiles(2.4) {
            let z = WALL_Z + j as f32 * TILE;
            let y = -DISK_HEIGHT;
            let quad = [(x, z), (x, z + wide), (x + wide, z + wide), (x + wide, z)].map(|(x, z)| Point3::new(x, y, z));
            add_quad(&mut room, quad, if (i + j) % 2 == 0 { [176, 172, 164] } else { [170, 166, 160] });
        }
        for j in 0..if with_wall { tiles(WALL_HEIGHT) } else { 0 } {
            let y = -DISK_HEIGHT + j as f32 * TILE;
            let quad =
                [(x, y), (x + wide, y), (x + wide, y + wide), (x, y + wide)].map(|(x, y)| Point3::new(x, y, WALL_Z));
            add_quad(&mut room, quad, [190, 188, 182]);
        }
    }
    room
}

fn add_quad(mesh: &mut Mesh, corners: [Point3<f32>; 4], color: [u8; 3]) {
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(corners);
    mesh.colors.extend([color; 4]);
    mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
}
