//! Convex hulls in the plane.

use nalgebra::Point2;

/// Corners of the convex hull, counter-clockwise from the leftmost (of equal ones the lowest); points inside and on the
/// sides are left out. Fewer than three points come back sorted, without repetitions. Source: Andrew 1979, O(n log n).
pub fn convex_hull(mut points: Vec<Point2<f64>>) -> Vec<Point2<f64>> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let mut hull: Vec<Point2<f64>> = Vec::new();
    let mut half = |points: &mut dyn Iterator<Item = &Point2<f64>>| {
        let base = hull.len();
        for p in points {
            while hull.len() >= base + 2 && turn(&hull[hull.len() - 2], &hull[hull.len() - 1], p) <= 0.0 {
                hull.pop();
            }
            hull.push(*p);
        }
        hull.pop();
    };
    half(&mut points.iter());
    half(&mut points.iter().rev());
    hull
}

/// Area and perimeter of a polygon with counter-clockwise corners.
pub fn area_and_perimeter(corners: &[Point2<f64>]) -> (f64, f64) {
    let sides = (0..corners.len()).map(|i| (corners[i], corners[(i + 1) % corners.len()]));
    let area = 0.5 * sides.clone().map(|(a, b)| a.coords.perp(&b.coords)).sum::<f64>();
    (area, sides.map(|(a, b)| (b - a).norm()).sum())
}

fn turn(a: &Point2<f64>, b: &Point2<f64>, c: &Point2<f64>) -> f64 {
    (b - a).perp(&(c - a))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dents_and_points_on_the_sides_are_left_out() {
        let points = [(0.0, 0.0), (1.0, 0.0), (0.5, 0.2), (1.0, 1.0), (0.0, 1.0), (0.5, 0.9), (0.5, 0.0)];
        let hull = convex_hull(points.map(|(x, y)| Point2::new(x, y)).to_vec());
        assert_eq!(hull.len(), 4);
        assert_eq!(area_and_perimeter(&hull), (1.0, 4.0));
    }

    #[test]
    fn the_hull_of_a_star_is_its_outline() {
        let star = |i: usize| {
            let (sin, cos) = (std::f64::consts::TAU * i as f64 / 16.0).sin_cos();
            let r = if i.is_multiple_of(2) { 2.0 } else { 0.7 };
            Point2::new(r * cos, r * sin)
        };
        let hull = convex_hull((0..16).map(star).collect());
        assert_eq!(hull.len(), 8);
        let (_, length) = area_and_perimeter(&hull);
        assert!((length - 8.0 * 4.0 * (std::f64::consts::PI / 8.0).sin()).abs() < 1e-9);
    }
}
