//! Benchmarks of the fusion stage on generated frames (a figure of capsules that turns on a disk before a wall); cases are
//! named stage/case/size. Measured is the processor time of all threads, so that other work on the machine matters little;
//! with `RAYON_NUM_THREADS=1` that is what one thread needs.
#![allow(missing_docs, clippy::unwrap_used)]

#[path = "../src/test_scene.rs"]
#[allow(dead_code, unreachable_pub)]
mod test_scene;

use std::{cell::Cell, hint::black_box, time::Duration};

use criterion::{
    BatchSize, Bencher, Criterion, criterion_group, criterion_main,
    measurement::{Measurement, ValueFormatter, WallTime},
};
use test_scene::{Memory, Scene, steps};
use toile_capture::Frame;
use toile_fusion::{
    Fuser, FusionSettings, fuse,
    steps::{
        CutDepth, DepthView, Rectifier, Tsdf, drop_edges, extract_surface, integrate, ray_cast, surface_elements, track,
    },
    survey,
};
use toile_geometry::{Rigid, camera::PinholeCamera};

/// Frames that the cases of single frames go through in turn, and degrees between them.
const FRAMES: usize = 12;
const STEP_DEG: f64 = 4.0;
/// Frames and degrees between them of a whole take.
const TAKE: (usize, f64) = (60, 6.1);

/// Processor time of this process.
struct CpuTime;

impl Measurement for CpuTime {
    type Intermediate = Duration;
    type Value = Duration;

    fn start(&self) -> Duration {
        let now = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
        Duration::new(now.tv_sec as u64, now.tv_nsec as u32)
    }

    fn end(&self, start: Duration) -> Duration {
        self.start().saturating_sub(start)
    }

    fn add(&self, a: &Duration, b: &Duration) -> Duration {
        *a + *b
    }

    fn zero(&self) -> Duration {
        Duration::ZERO
    }

    fn to_f64(&self, value: &Duration) -> f64 {
        WallTime.to_f64(value)
    }

    fn formatter(&self) -> &dyn ValueFormatter {
        const { &WallTime }.formatter()
    }
}

/// Frames of one image size with their true poses.
struct Material {
    scene: Scene,
    size: String,
    frames: Vec<Frame>,
    views: Vec<DepthView>,
    poses: Vec<Rigid>,
}

impl Material {
    fn new(width: u32, height: u32, focal: f64) -> Self {
        let center = [f64::from(width - 1) / 2.0, f64::from(height - 1) / 2.0];
        let scene =
            Scene { camera: PinholeCamera::ideal(width, height, focal, focal, center[0], center[1]), ..Scene::new() };
        let figure = Scene { with_floor: false, with_wall: false, ..scene.clone() };
        let angles = steps(FRAMES, STEP_DEG);
        let view = |frame: &Frame| {
            let rectifier = Rectifier::new(&figure.rig().sensors[0], 6.0);
            let depth = rectifier.rectify(frame.depth.as_ref().unwrap());
            let mut view = CutDepth::new(&rectifier.camera, &drop_edges(&rectifier.camera, &depth, 8.3), 0.001).view(2);
            let shade = |n: f32| (128.0 + 100.0 * n) as u8;
            view.colors = view
                .elements
                .iter()
                .map(|e| e.parts())
                .map(|[_, f, x, y]| [shade(f), shade(x), shade(y), 255])
                .collect();
            view
        };
        Self {
            size: format!("{width}x{height}"),
            frames: scene.frames(&angles),
            views: figure.frames(&angles).iter().map(view).collect(),
            poses: angles.iter().map(|a| scene.figure_from_camera(a.unwrap())).collect(),
            scene,
        }
    }

    /// The field of all frames.
    fn model(&self, with_color: bool) -> Tsdf {
        let mut model = Tsdf::new(0.004, 0.016, with_color);
        self.views.iter().zip(&self.poses).for_each(|(v, p)| {
            integrate(&mut model, v, p).unwrap();
        });
        model
    }
}

/// Times one frame after the other.
fn each<T>(b: &mut Bencher<'_, CpuTime>, mut run: impl FnMut(usize) -> T) {
    let next = Cell::new(0);
    b.iter(|| {
        let i = next.replace((next.get() + 1) % FRAMES);
        black_box(run(i))
    });
}

/// One case a step of a frame.
fn steps_of_a_frame(c: &mut Criterion<CpuTime>, m: &Material) {
    let mut group = c.benchmark_group("fusion");
    group.sample_size(20);
    let settings = FusionSettings::default();
    let camera = m.scene.camera;
    let rectifier = Rectifier::new(&m.scene.rig().sensors[0], 6.0);
    let raw: Vec<Vec<f32>> = m.frames.iter().map(|f| rectifier.rectify(f.depth.as_ref().unwrap())).collect();
    let cut: Vec<Vec<f32>> =
        m.views.iter().map(|v| v.elements[..v.pixels()].iter().map(|e| e.depth()).collect()).collect();
    group.bench_function(format!("filter/{}", m.size), |b| {
        each(b, |i| drop_edges(&camera, &raw[i], settings.jump_slope));
    });
    group.bench_function(format!("normals/{}", m.size), |b| {
        each(b, |i| surface_elements(&m.views[i].camera, &cut[i], 2));
    });
    for (name, with_color) in [("integrate", false), ("integrate-colour", true)] {
        let mut field = m.model(with_color);
        group.bench_function(format!("{name}/{}", m.size), |b| {
            each(b, |i| integrate(&mut field, &m.views[i], &m.poses[i]).unwrap());
        });
    }
    let model = m.model(false);
    group.bench_function(format!("raycast/{}", m.size), |b| {
        each(b, |i| ray_cast(&model, &m.views[i].camera, &m.poses[i], 1));
    });
    group.bench_function(format!("track/{}", m.size), |b| {
        // From the pose before: as far off as a turn without any prior.
        each(b, |i| track(&model, &m.views[i], &m.poses[i.saturating_sub(1)]));
    });
    group.bench_function(format!("extract/{}", m.size), |b| b.iter(|| extract_surface(&model, 6)));
    group.finish();
}

/// Frames pushed one by one, and a whole take from frames in memory to the finished scan.
fn takes(c: &mut Criterion<CpuTime>, m: &Material) {
    let mut group = c.benchmark_group("fusion");
    group.sample_size(10);
    let settings = FusionSettings::default();
    let frames = m.scene.frames(&steps(TAKE.0, TAKE.1));
    let rig = m.scene.rig();
    let volume = survey(&rig, &frames, &settings).unwrap();
    let fuser = || Fuser::new(&rig, Some(volume.clone()), settings.clone()).unwrap();
    let push = |mut fuser: Fuser| frames[..FRAMES].iter().map(|f| fuser.push(f).unwrap()).last();
    group.bench_function(format!("push/{}x{FRAMES}", m.size), |b| b.iter_batched(fuser, push, BatchSize::LargeInput));
    let source = || Memory { rig: rig.clone(), frames: frames.clone(), next: 0 };
    let whole = |mut source: Memory| fuse(&mut source, &settings, &|_| {}).unwrap();
    group.bench_function(format!("take/{}x{}", m.size, TAKE.0), |b| {
        b.iter_batched(source, whole, BatchSize::LargeInput);
    });
    group.finish();
}

fn benches(c: &mut Criterion<CpuTime>) {
    for (width, height, focal) in [(512, 424, 365.0), (640, 480, 525.0)] {
        let material = Material::new(width, height, focal);
        steps_of_a_frame(c, &material);
        takes(c, &material);
    }
}

criterion_group! { name = fusion; config = Criterion::default().with_measurement(CpuTime); targets = benches }
criterion_main!(fusion);
