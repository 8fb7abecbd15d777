//! Several virtual sensors around the disk: where they stand, where the recording says that they stand, their clocks and
//! how they disturb each other.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use serde_json::{Value, json};
use toile_geometry::Rigid;

use crate::{random::Random, settings::SyntheticSettings};

/// The error of a recorded place is at least this share of the largest one.
const LEAST_ERROR: f64 = 0.5;
/// A quartz clock's own error, parts of one.
const QUARTZ: f64 = 20e-6;
/// Largest start of a device's clock, nanoseconds.
const EPOCH_NS: f64 = 300e9;

/// A sensor of the rig.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Stand {
    /// Its name, unique in the rig.
    pub name: String,
    /// Where it truly stands.
    pub room_from_camera: Rigid,
    /// Where the recording says that it stands: the first one where the rig's frame is.
    pub recorded: Rigid,
    /// Device time at the take's start, nanoseconds, and how fast it runs.
    pub clock: (i64, f64),
}

/// The sensors of a session's rig, the first one in front of the subject.
pub(crate) fn stands(settings: &SyntheticSettings) -> Vec<Stand> {
    let first = camera_stand(settings, 0);
    let stand = |k: usize| {
        let room_from_camera = if k == 0 { first } else { camera_stand(settings, k) };
        let truth = first.inverse() * room_from_camera;
        let recorded = if k == 0 { Rigid::identity() } else { truth * misplaced(settings, k) };
        let name = if k == 0 { "camera".into() } else { format!("camera-{}", k + 1) };
        Stand { name, room_from_camera, recorded, clock: clock(settings, k) }
    };
    (0..settings.rig.sensors.max(1)).map(stand).collect()
}

/// The camera looks at the disk's axis, tilted and turned a little as a tripod by hand is.
fn camera_stand(settings: &SyntheticSettings, k: usize) -> Rigid {
    let name = if k == 0 { "camera".into() } else { format!("camera {k}") };
    let mut random = Random::new(settings.seed, &name);
    let (tilt, yaw) = (random.range(-1.5, 1.5).to_radians(), random.range(-1.5, 1.5).to_radians());
    let level = Matrix3::new(1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0);
    let level = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(level));
    let aim = UnitQuaternion::from_euler_angles(tilt, yaw, 0.0);
    let distance = settings.distance_m.unwrap_or_else(|| settings.sensor.usual_distance());
    let place = Vector3::new(random.range(-0.03, 0.03), settings.height_m, distance);
    let turn = std::f64::consts::TAU * k as f64 / settings.rig.sensors.max(1) as f64;
    let around = UnitQuaternion::from_scaled_axis(Vector3::y() * turn);
    leaning(settings) * Rigid::from_parts((around * place).into(), around * aim * level)
}

/// The room in the frame of the disk, whose axis leans against the vertical: identity where it does not.
pub(crate) fn leaning(settings: &SyntheticSettings) -> Rigid {
    if settings.tilt_degrees == 0.0 {
        return Rigid::identity();
    }
    let towards = Random::new(settings.seed, "tilt").range(0.0, std::f64::consts::TAU);
    let axis = Vector3::new(towards.cos(), 0.0, towards.sin());
    Rigid::from_parts(
        Vector3::zeros().into(),
        UnitQuaternion::from_scaled_axis(axis * settings.tilt_degrees.to_radians()),
    )
}

fn misplaced(settings: &SyntheticSettings, k: usize) -> Rigid {
    let mut random = Random::new(settings.seed, &format!("camera {k} misplaced"));
    let mut vector = |largest: f64| {
        let size = largest * random.range(LEAST_ERROR, 1.0);
        direction(&mut random) * size
    };
    let shift = vector(settings.rig.error_m);
    let turn = vector(settings.rig.error_degrees.to_radians());
    Rigid::new(shift, turn)
}

/// How the last sensor was pushed from the middle of the take on, in its own frame.
pub(crate) fn knock(settings: &SyntheticSettings, take: usize) -> Rigid {
    const DEGREES_A_METRE: f64 = 200.0;
    let mut random = Random::new(settings.seed, &format!("take {take} knock"));
    let size = settings.rig.knock_m;
    Rigid::new(direction(&mut random) * size, direction(&mut random) * (size * DEGREES_A_METRE).to_radians())
}

/// A unit vector.
pub(crate) fn direction(random: &mut Random) -> Vector3<f64> {
    let v = Vector3::new(random.normal(3.0), random.normal(3.0), random.normal(3.0));
    v.try_normalize(1e-6).unwrap_or_else(Vector3::x)
}

/// Start and rate of a sensor's clock: the first one's begins with the take.
fn clock(settings: &SyntheticSettings, k: usize) -> (i64, f64) {
    if settings.rig.sensors < 2 {
        return (0, 1.0);
    }
    let mut random = Random::new(settings.seed, &format!("camera {k} clock"));
    let drift = if k % 2 == 1 { settings.rig.clock_drift_ppm * 1e-6 } else { 0.0 };
    let epoch = if k == 0 { 0 } else { random.range(0.0, EPOCH_NS) as i64 };
    (epoch, 1.0 + drift + random.range(-QUARTZ, QUARTZ))
}

/// What is true of a take's rig (`rig.json`).
pub(crate) fn rig_json(stands: &[Stand], knock: Option<Rigid>) -> Value {
    let first = stands[0].room_from_camera;
    let rows = |pose: &Rigid| {
        let matrix = pose.to_homogeneous();
        (0..4).map(|i| (0..4).map(|j| matrix[(i, j)]).collect()).collect::<Vec<Vec<f64>>>()
    };
    let last = stands.len() - 1;
    let sensor = |(k, stand): (usize, &Stand)| {
        let mut value = json!({
            "name": stand.name,
            "rig_from_depth": rows(&(first.inverse() * stand.room_from_camera)),
            "recorded_rig_from_depth": rows(&stand.recorded),
            "room_from_depth": rows(&stand.room_from_camera),
            "clock_start_ns": stand.clock.0,
            "clock_rate": stand.clock.1,
        });
        if let Some(knock) = knock.filter(|_| k == last) {
            value["rig_from_depth_after_knock"] = json!(rows(&(first.inverse() * stand.room_from_camera * knock)));
        }
        value
    };
    json!({ "sensors": stands.iter().enumerate().map(sensor).collect::<Vec<Value>>() })
}
