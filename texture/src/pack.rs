//! Charts laid flat, and their places in the picture.
//!
//! Charts are packed as in the game of falling blocks (Lévy et al. 2002): the largest first, each where it comes to lie lowest over
//! what is there, turned by quarters, with its own outline instead of its box.

use nalgebra::Vector3;
use toile_geometry::Mesh;

/// Cells that the picture is divided into along each edge.
const CELLS: usize = 1024;
/// Directions that a chart's box is tried in.
const TURNS: usize = 16;
/// Share of the picture that charts are tried to cover first, and by how much the scale is lowered until they fit.
const FIRST_SHARE: f64 = 0.72;
const LOWER: f64 = 0.99;

/// A chart laid flat.
pub(crate) struct Flat {
    pub triangles: Vec<u32>,
    /// Directions on the surface along which columns and rows grow.
    axes: [Vector3<f32>; 2],
    /// Least coordinates along both, metres.
    least: [f32; 2],
    /// Size along both, metres.
    size: [f32; 2],
}

/// Where a chart lies.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    /// First column and row, texels.
    at: [f32; 2],
    /// Quarter turns.
    turn: u8,
}

impl Flat {
    /// Projects a chart along its axis, turned so that its box is smallest.
    pub(crate) fn new(mesh: &Mesh, triangles: Vec<u32>, axis: &Vector3<f32>) -> Self {
        let aside = if axis.y.abs() < 0.8 { Vector3::y() } else { Vector3::x() };
        let right = aside.cross(axis).normalize();
        let down = axis.cross(&right) * -1.0;
        let mut best: Option<(f32, Self)> = None;
        for k in 0..TURNS {
            let (sin, cos) = (k as f32 / TURNS as f32 * std::f32::consts::FRAC_PI_2).sin_cos();
            let axes = [right * cos + down * sin, down * cos - right * sin];
            let (mut lo, mut hi) = ([f32::MAX; 2], [f32::MIN; 2]);
            for p in triangles.iter().flat_map(|&t| mesh.corners(t as usize)) {
                for i in 0..2 {
                    let x = axes[i].dot(&p.coords);
                    (lo[i], hi[i]) = (lo[i].min(x), hi[i].max(x));
                }
            }
            let size = [hi[0] - lo[0], hi[1] - lo[1]];
            let area = size[0] * size[1];
            if best.as_ref().is_none_or(|b| area < b.0 * 0.999) {
                best = Some((area, Self { triangles: Vec::new(), axes, least: lo, size }));
            }
        }
        let flat =
            best.map_or(Self { triangles: Vec::new(), axes: [right, down], least: [0.0; 2], size: [0.0; 2] }, |b| b.1);
        Self { triangles, ..flat }
    }

    /// A vertex in the chart, metres from its least corner.
    fn at(&self, p: &nalgebra::Point3<f32>) -> [f32; 2] {
        [0, 1].map(|i| self.axes[i].dot(&p.coords) - self.least[i])
    }

    /// A vertex in texels, for a place and `scale` texels a metre.
    pub(crate) fn texel(&self, p: &nalgebra::Point3<f32>, place: Place, scale: f32) -> [f32; 2] {
        let [x, y] = turned(self.at(p), self.size, place.turn);
        [place.at[0] + x * scale, place.at[1] + y * scale]
    }

    /// Area of its triangles when flat, square metres.
    fn area(&self, mesh: &Mesh) -> f64 {
        let of = |&t: &u32| {
            let [a, b, c] = mesh.corners(t as usize).map(|p| self.at(&p));
            0.5 * f64::from((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])).abs()
        };
        self.triangles.iter().map(of).sum()
    }

    /// Lowest and highest row of cells in each column, turned, with `around` texels on each side; `cell` texels a cell.
    fn outline(&self, mesh: &Mesh, turn: u8, scale: f32, cell: f32, around: f32) -> Outline {
        let size = if turn.is_multiple_of(2) { self.size } else { [self.size[1], self.size[0]] };
        let columns = ((size[0] * scale + 2.0 * around) / cell).ceil() as usize + 1;
        let (mut low, mut high) = (vec![i32::MAX; columns], vec![i32::MIN; columns]);
        for &t in &self.triangles {
            let corners =
                mesh.corners(t as usize).map(|p| turned(self.at(&p), self.size, turn).map(|x| x * scale + around));
            let (mut lo, mut hi) = ([f32::MAX; 2], [f32::MIN; 2]);
            for c in corners {
                (0..2).for_each(|i| (lo[i], hi[i]) = (lo[i].min(c[i]), hi[i].max(c[i])));
            }
            let rows = [((lo[1] - around) / cell).floor() as i32, ((hi[1] + around) / cell).floor() as i32];
            for column in
                ((lo[0] - around) / cell).max(0.0) as usize..=(((hi[0] + around) / cell) as usize).min(columns - 1)
            {
                (low[column], high[column]) = (low[column].min(rows[0]), high[column].max(rows[1]));
            }
        }
        Outline { turn, low, high }
    }
}

/// Lowest and highest row of a chart in each column of cells.
struct Outline {
    turn: u8,
    low: Vec<i32>,
    high: Vec<i32>,
}

/// A point of a chart after quarter turns of it.
fn turned([x, y]: [f32; 2], [width, height]: [f32; 2], turn: u8) -> [f32; 2] {
    match turn {
        0 => [x, y],
        1 => [height - y, x],
        2 => [width - x, height - y],
        _ => [y, width - x],
    }
}

/// Places for all charts in a picture of `size` texels, `around` texels around each, and texels a metre: as many as fit, at most
/// `finest`.
///
/// `None` where they do not fit at any scale.
pub(crate) fn pack(mesh: &Mesh, charts: &[Flat], size: u32, around: u32, finest: f32) -> Option<(Vec<Place>, f32)> {
    let area: f64 = charts.iter().map(|chart| chart.area(mesh)).sum();
    let mut order: Vec<usize> = (0..charts.len()).collect();
    let longest = |i: usize| charts[i].size[0].max(charts[i].size[1]);
    order.sort_by(|&a, &b| longest(b).total_cmp(&longest(a)).then(a.cmp(&b)));
    let mut scale = (f64::from(size) * (FIRST_SHARE / area.max(1e-12)).sqrt()).min(f64::from(finest));
    for _ in 0..400 {
        if let Some(places) = fit(mesh, charts, &order, size as f32, around as f32, scale as f32) {
            return Some((places, scale as f32));
        }
        scale *= LOWER;
    }
    None
}

/// Places at one scale; `None` where the picture is too small.
fn fit(mesh: &Mesh, charts: &[Flat], order: &[usize], size: f32, around: f32, scale: f32) -> Option<Vec<Place>> {
    let cell = size / CELLS as f32;
    let mut top = [0i32; CELLS];
    let mut places = vec![Place { at: [0.0; 2], turn: 0 }; charts.len()];
    for &i in order {
        let outlines = (0..4).map(|turn| charts[i].outline(mesh, turn, scale, cell, around));
        let best = outlines.filter_map(|outline| Some((lowest(&outline, &top)?, outline)));
        let ((_, column, row), outline) =
            best.min_by_key(|((cost, column, _), outline)| (*cost, *column, outline.turn))?;
        for (k, &high) in outline.high.iter().enumerate().filter(|(_, high)| **high > i32::MIN) {
            top[column + k] = row + high + 1;
        }
        let at = [column as f32 * cell + around, row as f32 * cell + around];
        places[i] = Place { at, turn: outline.turn };
    }
    Some(places)
}

/// Where an outline comes to lie best over `top`: cost, column and row.
fn lowest(outline: &Outline, top: &[i32; CELLS]) -> Option<(i64, usize, i32)> {
    let width = outline.low.len();
    let reach = outline.high.iter().copied().max().unwrap_or(0);
    let known = || outline.low.iter().enumerate().filter(|(_, low)| **low < i32::MAX);
    let mut best: Option<(i64, usize, i32)> = None;
    for column in 0..(CELLS + 1).saturating_sub(width) {
        let row = known().map(|(k, low)| top[column + k] - low).max().unwrap_or(0).max(0);
        if row + reach >= CELLS as i32 {
            continue;
        }
        // What is lost below it counts as much as how high it comes to lie.
        if best.is_some_and(|b| i64::from(row + reach) * width as i64 >= b.0) {
            continue;
        }
        let lost: i64 = known().map(|(k, low)| i64::from(row + low - top[column + k])).sum();
        let cost = i64::from(row + reach) * width as i64 + lost;
        if best.is_none_or(|b| cost < b.0) {
            best = Some((cost, column, row));
        }
    }
    best
}
