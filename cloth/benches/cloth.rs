//! One step of a hanging sheet.
#![allow(missing_docs)]

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::{Point3, Vector3};
use toile_cloth::{Anchors, Effort, Fabric, RestShape, Sheet, Surroundings};

fn step(c: &mut Criterion) {
    let n = 70u32;
    let at = |v: u32| Point3::new(f64::from(v % n) * 0.012, f64::from(v / n) * -0.012, 0.0);
    let rest: Vec<Point3<f64>> = (0..n * n).map(at).collect();
    let cell = |q: u32| q / (n - 1) * n + q % (n - 1);
    let triangles: Vec<[u32; 3]> =
        (0..(n - 1) * (n - 1)).map(cell).flat_map(|a| [[a, a + n, a + 1], [a + 1, a + n, a + n + 1]]).collect();
    let stiffness = (0..n * n).map(|v| if v < n { 1e4 } else { 0.0 }).collect();
    let fabric = Fabric::named("shirting").expect("the table has it");
    let shape = RestShape { positions: &rest, triangles: &triangles, curved: false, grain: Vector3::y() };
    let mut sheet = Sheet::new(&shape, fabric, Anchors { stiffness }).expect("a sheet");
    let anchors: Vec<Vector3<f64>> = rest.iter().map(|p| p.coords).collect();
    let around = Surroundings { anchors: &anchors, wind: Vector3::new(0.0, 0.0, 2.0), ..Surroundings::default() };
    c.bench_function("one step of 1/60 s, 4,900 vertices", |b| {
        b.iter(|| sheet.advance(1.0 / 60.0, &around, &Effort::default()).expect("a step"));
    });
}

criterion_group!(benches, step);
criterion_main!(benches);
