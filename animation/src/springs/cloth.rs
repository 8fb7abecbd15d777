//! The cloth that hangs around the legs: how far out, and how much of its motion is its own.

use nalgebra::Point3;
use rayon::prelude::*;
use toile_character::FREE_PART;

use super::{
    around::{Around, CHAINS, beside},
    layer::RestedLayer,
};
use crate::blend::{Closeness, frequency};

/// Rows of the table of the cloth, from the hips down to the hem.
const ROWS: usize = 12;
/// Angular frequency of a stride, rad/s: a walk swings each leg once a second.
const STRIDE: f64 = std::f64::consts::TAU;
/// A layer hangs where it reaches so far below the hips' joints, metres, on that many of the chains: the shortest skirts reach 0.2 m,
/// jumpers 0.05 m.
const LEAST_REACH: f64 = 0.1;
const LEAST_CHAINS: usize = 8;
/// And where so much of its motion is its own somewhere down a chain.
const LEAST_OWN: f64 = 0.2;

/// What hangs, by angle and height.
#[derive(Debug)]
pub(super) struct Cloth {
    /// Which layers hang.
    pub hangs: Vec<bool>,
    /// Height of the lowest hem, metres.
    pub low: f64,
    /// Height at which the table begins, metres.
    top: f64,
    /// Mean distance from the axis, metres.
    radius: Table,
    /// Share of the cloth's motion that is its own, 0 to 1.
    own: Table,
}

/// A value for each angle and height; NaN where there is no cloth.
type Table = Vec<[f64; CHAINS]>;

/// A vertex below the hips.
struct Hanging {
    turn: f64,
    radius: f64,
    height: f64,
    own: f64,
}

impl Cloth {
    /// The cloth among the `layers` that hangs; `None` where none does.
    pub fn new(around: &Around, layers: &[RestedLayer<'_>]) -> Option<Self> {
        let closeness = Closeness::new(layers[0].mesh);
        let below: Vec<Vec<Hanging>> = layers
            .iter()
            .enumerate()
            .map(|(k, layer)| if k > 0 && layer.may_hang { below(around, layer, &closeness) } else { Vec::new() })
            .collect();
        let hangs: Vec<bool> = below.iter().map(|vertices| hangs(around, vertices)).collect();
        let all: Vec<&Hanging> = below.iter().zip(&hangs).filter(|(_, h)| **h).flat_map(|(v, _)| v).collect();
        let low = all.iter().map(|v| v.height).fold(around.top, f64::min).max(around.floor);
        if all.is_empty() {
            return None;
        }
        let table = |value: &dyn Fn(&Hanging) -> f64| filled(&means(&all, around.top, low, value));
        let own = smoothed(&smoothed(&table(&|v| v.own)));
        Some(Self { hangs, low, top: around.top, radius: smoothed(&table(&|v| v.radius)), own })
    }

    /// Mean distance of the cloth from the axis, metres.
    pub fn radius(&self, turn: f64, height: f64) -> f64 {
        self.look_up(&self.radius, turn, height)
    }

    /// Share of the cloth's motion that is its own, 0 to 1.
    pub fn own(&self, turn: f64, height: f64) -> f64 {
        self.look_up(&self.own, turn, height)
    }

    fn look_up(&self, table: &Table, turn: f64, height: f64) -> f64 {
        let row = (row(self.top, self.low, height) - 0.5).clamp(0.0, (ROWS - 1) as f64);
        let (upper, down) = (row.floor() as usize, row.fract());
        let ([a, b], beyond) = beside(turn);
        let across = |r: usize| table[r][a] * (1.0 - beyond) + table[r][b] * beyond;
        across(upper) * (1.0 - down) + across((upper + 1).min(ROWS - 1)) * down
    }
}

/// Rows from the top down, as a number from 0 to [`ROWS`].
fn row(top: f64, low: f64, height: f64) -> f64 {
    (top - height) / (top - low).max(1e-6) * ROWS as f64
}

/// The layer's vertices below the hips.
fn below(around: &Around, layer: &RestedLayer<'_>, closeness: &Closeness) -> Vec<Hanging> {
    let free = layer.mesh.attributes.get(FREE_PART);
    let hanging = |(v, p): (usize, &Point3<f32>)| {
        let place = p.cast::<f64>();
        if place.y >= around.top {
            return None;
        }
        let free = free.map_or(0.0, |f| f[v]);
        let distance = closeness.over(p, free).map_or(0.0, |over| f64::from(over.height.abs()));
        let (turn, radius) = around.polar(&place);
        Some(Hanging { turn, radius, height: place.y, own: own_share(frequency(distance, f64::from(free))) })
    };
    layer.mesh.positions.par_iter().enumerate().filter_map(hanging).collect()
}

/// Share of its motion in a stride that cloth on springs of this `frequency` (rad/s) does by itself: a mass on a spring follows what
/// holds it by ω² / (ω² + Ω²) where damping is about critical.
fn own_share(frequency: f64) -> f64 {
    STRIDE * STRIDE / (frequency * frequency + STRIDE * STRIDE)
}

/// True where the `vertices` of a layer reach around both legs, and swing.
fn hangs(around: &Around, vertices: &[Hanging]) -> bool {
    let mut swings = [false; CHAINS];
    for v in vertices.iter().filter(|v| v.height < around.top - LEAST_REACH && v.own > LEAST_OWN) {
        swings[v.turn.round() as usize % CHAINS] = true;
    }
    swings.iter().filter(|s| **s).count() >= LEAST_CHAINS
}

/// Means of a value over the vertices around each angle and height.
fn means(all: &[&Hanging], top: f64, low: f64, value: &dyn Fn(&Hanging) -> f64) -> Table {
    let mut sums = vec![[(0.0, 0.0); CHAINS]; ROWS];
    for v in all {
        let cell = &mut sums[(row(top, low, v.height) as usize).min(ROWS - 1)][v.turn.round() as usize % CHAINS];
        (cell.0, cell.1) = (cell.0 + value(v), cell.1 + 1.0);
    }
    sums.iter().map(|row| row.map(|(sum, count)| sum / count)).collect()
}

/// The table with values where there is no cloth: those of the row above, else of the mean of the row, else of the row below.
fn filled(table: &Table) -> Table {
    let mut filled = table.clone();
    for r in 0..ROWS {
        let known: Vec<f64> = table[r].iter().copied().filter(|x| x.is_finite()).collect();
        let mean = if known.is_empty() { f64::NAN } else { known.iter().sum::<f64>() / known.len() as f64 };
        let above = if r > 0 { filled[r - 1] } else { [f64::NAN; CHAINS] };
        for (value, above) in filled[r].iter_mut().zip(above) {
            *value = [*value, above, mean].into_iter().find(|x| x.is_finite()).unwrap_or(f64::NAN);
        }
    }
    for r in (0..ROWS - 1).rev() {
        let below = filled[r + 1];
        filled[r].iter_mut().zip(below).filter(|(value, _)| !value.is_finite()).for_each(|(value, b)| *value = b);
    }
    filled
}

/// Each value drawn half of the way to the mean of the four around it.
fn smoothed(table: &Table) -> Table {
    let mean = |r: usize, k: usize| {
        let (left, right) = (table[r][(k + CHAINS - 1) % CHAINS], table[r][(k + 1) % CHAINS]);
        let (up, down) = (table[r.saturating_sub(1)][k], table[(r + 1).min(ROWS - 1)][k]);
        0.5 * table[r][k] + 0.125 * (left + right + up + down)
    };
    (0..ROWS).map(|r| std::array::from_fn(|k| mean(r, k))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holes_take_the_values_around_them() {
        let mut table: Table = vec![[2.0; CHAINS]; ROWS];
        table[0] = [f64::NAN; CHAINS];
        table[4][3] = f64::NAN;
        table[3][3] = 7.0;
        let filled = filled(&table);
        assert_eq!((filled[0], filled[4][3]), ([2.0; CHAINS], 7.0));
        assert!(smoothed(&filled).iter().flatten().all(|x| (2.0..=7.0).contains(x)));
    }

    #[test]
    fn cloth_on_the_skin_has_no_motion_of_its_own() {
        assert!(own_share(frequency(0.0, 0.0)) < 0.002);
        assert!((0.55..0.7).contains(&own_share(frequency(0.2, 0.0))));
    }
}
