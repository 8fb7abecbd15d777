//! Whether garments were taken off from take to take instead of put on.

use toile_geometry::{Mesh, volume::closed_volume};

/// How far the surfaces of two takes may lie off each other where nothing was put on or taken off, metres: three times the
/// bias of the noisiest sensor that is fused (stereo, −0.4 mm), rounded down. Times a scan's area it is the error of the
/// difference of two volumes.
const SURFACE_ERROR_M: f64 = 0.001;
/// Scans of a person whose height differs by more than this factor show different parts of the person. Arms that are raised
/// in one of them add less than a third.
const HEIGHTS: f64 = 0.7;

/// What a scan takes up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bulk {
    /// Volume, cubic metres.
    pub volume_m3: f64,
    /// Area, square metres.
    pub area_m2: f64,
    /// Height, metres.
    pub height_m: f64,
}

impl Bulk {
    /// Of a scan; holes are closed as if by a fan around the middle of their rim. An empty mesh has none.
    pub fn of(scan: &Mesh) -> Self {
        let height_m = scan.bounds().map_or(0.0, |(low, high)| f64::from(high.y - low.y));
        Self { volume_m3: closed_volume(scan), area_m2: scan.area(), height_m }
    }
}

/// True where the takes, in their order, show ever less on the person: no scan is larger than the one before by more than
/// scanning errs, and the last is smaller than the first by more than twice that. Volume does not depend on the pose.
///
/// One that takes off thin, tight clothes only (leggings) is not told from one that changes nothing.
pub fn are_taken_off(takes: &[Bulk]) -> bool {
    let (Some(first), Some(last)) = (takes.first(), takes.last()) else { return false };
    let heights = || takes.iter().map(|take| take.height_m);
    let is_whole = heights().fold(f64::INFINITY, f64::min) >= HEIGHTS * heights().fold(0.0, f64::max);
    let error = SURFACE_ERROR_M * takes.iter().map(|take| take.area_m2).fold(0.0, f64::max);
    let never_grows = takes.windows(2).all(|pair| pair[1].volume_m3 < pair[0].volume_m3 + error);
    is_whole && never_grows && first.volume_m3 - last.volume_m3 > 2.0 * error
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Takes of these litres.
    fn takes(litres: &[f64]) -> Vec<Bulk> {
        litres.iter().map(|l| Bulk { volume_m3: 1e-3 * l, area_m2: 1.9, height_m: 1.7 }).collect()
    }

    #[test]
    fn the_order_shows_in_the_volumes() {
        // A man of 84 litres in shorts and a T-shirt.
        assert!(are_taken_off(&takes(&[107.7, 92.4, 84.0])));
        assert!(!are_taken_off(&takes(&[84.0, 92.4, 107.7])));
        // The same without the shorts' take; something taken off in between; a hat; one take; none.
        assert!(are_taken_off(&takes(&[107.7, 84.0])));
        assert!(!are_taken_off(&takes(&[84.0, 107.7, 92.4])) && !are_taken_off(&takes(&[107.7, 84.0, 92.4])));
        assert!(!are_taken_off(&takes(&[84.5, 84.0])) && !are_taken_off(&takes(&[84.0])) && !are_taken_off(&[]));
        // A bust is not a person who took clothes off.
        let mut parts = takes(&[84.0, 30.0]);
        parts[1].height_m = 0.6;
        assert!(!are_taken_off(&parts));
    }
}
