//! Benchmarks of the Kinect v2 driver, named stage/case/size, on a made-up pattern. Measured is the processor time of this
//! process, which does everything in one thread.
#![allow(missing_docs, clippy::unwrap_used)]

use std::{hint::black_box, time::Duration};

use criterion::{
    Criterion, criterion_group, criterion_main,
    measurement::{Measurement, ValueFormatter, WallTime},
};
use toile_driver_kinect2::{Calibration, DecodeSettings, Decoder, Registration, color};
use toile_driver_simulated::kinect2::{Content, Pattern};

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

fn decoding(c: &mut Criterion<CpuTime>) {
    let mut pattern = Pattern::default();
    let [depth, color, p0] = pattern.optics().answers();
    let calibration = Calibration::parse(&depth, &color, &p0).unwrap();
    let mut decoder = Decoder::new(&calibration, DecodeSettings::default());
    let packets: Vec<_> = (0..Pattern::FRAMES).map(|frame| pattern.depth(frame)).collect();
    let mut next = packets.iter().cycle();
    let jpeg = pattern.jpeg(0);
    let registration = Registration::new(&calibration);
    let decoded = decoder.decode(&packets[0]).unwrap();
    let pixels = color::decode(&jpeg).unwrap();
    let mut group = c.benchmark_group("kinect2");
    group.bench_function("decode/depth/512x424", |b| {
        b.iter(|| decoder.decode(next.next().map(|packet| &packet[..]).unwrap_or_default()).unwrap());
    });
    group.bench_function("decode/color/1920x1080", |b| b.iter(|| color::decode(black_box(&jpeg)).unwrap()));
    group.bench_function("register/color/512x424", |b| {
        b.iter(|| registration.register(black_box(&decoded.depth_mm), black_box(&pixels)));
    });
    group.finish();
}

criterion_group! { name = benches; config = Criterion::default().with_measurement(CpuTime); targets = decoding }
criterion_main!(benches);
