//! Which sides and heights of the subject were not seen yet.

use serde::Serialize;

use super::outline::Outline;

/// Directions around the subject, 15° each, from the front to the subject's left.
pub const COLUMNS: usize = 24;
/// Heights, from the top of the head to the ground.
pub const ROWS: usize = 6;
/// What a picture shows it shows well so many directions to either side (30° against the surface's normal).
const REACH: usize = 2;
/// At most this share of a part may lack depth for it to count as seen.
const MOST_MISSING: f64 = 0.5;

/// How much was not seen, by direction and height.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Unseen {
    /// Row by row from the top: 1 not seen, 0 seen; between, seen with holes.
    pub directions: Vec<f64>,
    /// [`COLUMNS`].
    pub columns: usize,
    /// [`ROWS`].
    pub rows: usize,
    /// By part of the body, once one is known.
    pub parts: Option<()>,
}

impl Default for Unseen {
    fn default() -> Self {
        Self { directions: vec![1.0; COLUMNS * ROWS], columns: COLUMNS, rows: ROWS, parts: None }
    }
}

impl Unseen {
    /// The camera looks at the subject from `direction` (radians about +Y, 0 the front).
    pub fn see(&mut self, direction: f64, outline: &Outline) {
        let share = direction.rem_euclid(std::f64::consts::TAU) / std::f64::consts::TAU;
        let middle = (share * COLUMNS as f64) as usize % COLUMNS;
        for row in 0..ROWS {
            let high = 1.0 - row as f64 / ROWS as f64;
            let Some(missing) = outline.dropout(outline.rows(high - 1.0 / ROWS as f64, high)) else { continue };
            if missing > MOST_MISSING {
                continue;
            }
            for step in 0..=2 * REACH {
                let cell = &mut self.directions[row * COLUMNS + (middle + COLUMNS + step - REACH) % COLUMNS];
                *cell = cell.min((missing * 100.0).round() / 100.0);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{
        super::outline::drawn::{boxes, sensor, volume},
        *,
    };

    #[test]
    fn half_a_turn_leaves_the_other_half_and_a_hidden_head_its_row() {
        let depth = boxes(&[[-0.2, 0.2, 0.0, 1.7]]);
        let outline = Outline::new(&sensor(), &depth, &volume()).unwrap();
        let mut unseen = Unseen::default();
        (0..=12).for_each(|k| unseen.see(f64::from(k) * 15f64.to_radians(), &outline));
        let seen: Vec<bool> = unseen.directions[..COLUMNS].iter().map(|u| *u < 0.5).collect();
        let expected: Vec<bool> = (0..COLUMNS).map(|k| k <= 14 || k >= 22).collect();
        assert_eq!(seen, expected);
        // Nothing is measured above the shoulders.
        let mut hidden = depth;
        hidden
            .values
            .iter_mut()
            .enumerate()
            .filter(|(k, v)| k / 320 < 101 && k % 5 > 0 && **v == 2500)
            .for_each(|(_, v)| *v = 0);
        let outline = Outline::new(&sensor(), &hidden, &volume()).unwrap();
        let mut unseen = Unseen::default();
        unseen.see(0.0, &outline);
        assert!(unseen.directions[0] > 0.9 && unseen.directions[4 * COLUMNS] < 0.1, "{:?}", unseen.directions);
    }
}
