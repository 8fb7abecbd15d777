//! Boundary-driven contours: from the rim of one piece of skin to that of its neighbour (paper 002 §2.2).

use nalgebra::Point3;

/// Where on a closed contour a point lies: on the edge after a corner, at a share of its length.
pub type OnContour = (u32, f64);

/// Places of `count` points along a closed contour, evenly by the length of its perimeter, the first at its first corner.
pub fn resample(contour: &[Point3<f64>], count: usize) -> Vec<OnContour> {
    let corner = |k: usize| contour[k % contour.len()];
    let lengths: Vec<f64> = (0..contour.len()).map(|k| (corner(k + 1) - corner(k)).norm()).collect();
    let total: f64 = lengths.iter().sum();
    let mut out = Vec::with_capacity(count);
    let (mut edge, mut before) = (0, 0.0);
    for k in 0..count {
        let wanted = total * k as f64 / count as f64;
        while edge + 1 < contour.len() && before + lengths[edge] <= wanted {
            before += lengths[edge];
            edge += 1;
        }
        let share = if lengths[edge] > 0.0 { ((wanted - before) / lengths[edge]).clamp(0.0, 1.0) } else { 0.0 };
        out.push((edge as u32, share));
    }
    out
}

/// The point at a place of a closed contour.
pub fn at(contour: &[Point3<f64>], (edge, share): OnContour) -> Point3<f64> {
    let (a, b) = (contour[edge as usize], contour[(edge as usize + 1) % contour.len()]);
    a + (b - a) * share
}

/// The corners of `goal` in the order that runs as `start` does, beginning with the one that is nearest to the first point of
/// `start`: the matching that the paper presupposes. Contours run alike where the areas that they enclose face the same way.
pub fn matched(start: &[Point3<f64>], goal: &[Point3<f64>]) -> Vec<u32> {
    let count = goal.len();
    let alike = area(start).dot(&area(goal)) >= 0.0;
    let distance = |k: &usize| start.first().map_or(0.0, |s| (goal[*k] - s).norm_squared());
    let first = (0..count).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0);
    let corner = |k: usize| if alike { (first + k) % count } else { (first + count - k) % count };
    (0..count).map(|k| corner(k) as u32).collect()
}

/// Vector area of a closed contour.
fn area(contour: &[Point3<f64>]) -> nalgebra::Vector3<f64> {
    let Some(&middle) = contour.first() else { return nalgebra::Vector3::zeros() };
    let pairs = contour.iter().zip(contour.iter().cycle().skip(1));
    pairs.map(|(a, b)| (a - middle).cross(&(b - middle))).sum()
}

/// The ray of point j of intermediate contour i, as origin O and the point P that it passes: P = S + i/(k+1) (G − S), `share` being
/// i/(k+1), and O the foot of P on the line through the link.
///
/// The paper prints the direction as D = O − P, which leads away from the contour; the ray here runs from O through P.
pub fn ray(
    start: &Point3<f64>,
    goal: &Point3<f64>,
    share: f64,
    link: (Point3<f64>, Point3<f64>),
) -> (Point3<f64>, Point3<f64>) {
    let passed = start + (goal - start) * share;
    let along = link.1 - link.0;
    let foot = (passed - link.0).dot(&along) / along.norm_squared().max(1e-12);
    (link.0 + along * foot, passed)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn circle(count: usize, radius: f64, height: f64, offset: f64) -> Vec<Point3<f64>> {
        let angle = |k: usize| std::f64::consts::TAU * (k as f64 / count as f64) + offset;
        (0..count).map(|k| Point3::new(radius * angle(k).cos(), height, radius * angle(k).sin())).collect()
    }

    #[test]
    fn a_square_is_resampled_evenly_by_its_perimeter() {
        let square = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]].map(|[x, z]| Point3::new(x, 0.0, z));
        let places = resample(&square, 8);
        let expected = [[0.0, 0.0], [2.0, 0.0], [4.0, 0.0], [4.0, 2.0], [4.0, 4.0], [2.0, 4.0], [0.0, 4.0], [0.0, 2.0]];
        for (place, [x, z]) in places.into_iter().zip(expected) {
            assert!((at(&square, place) - Point3::new(x, 0.0, z)).norm() < 1e-12);
        }
    }

    #[test]
    fn the_goal_runs_as_the_start_does_from_the_nearest_corner() {
        let start = circle(12, 1.0, 0.0, 0.0);
        let mut goal = circle(12, 0.5, 1.0, std::f64::consts::TAU * 5.0 / 12.0);
        goal.reverse();
        let order = matched(&start, &goal);
        for (s, k) in start.iter().zip(order) {
            let g = goal[k as usize];
            assert!((g - Point3::new(0.5 * s.x, 1.0, 0.5 * s.z)).norm() < 1e-9);
        }
    }

    #[test]
    fn contours_between_two_circles_lie_on_the_cone_between_them() {
        let (start, goal) = (circle(12, 1.0, 0.0, 0.0), circle(12, 0.4, 3.0, 0.0));
        let link = (Point3::new(0.0, -1.0, 0.0), Point3::new(0.0, 5.0, 0.0));
        let count = 2.0;
        for i in 1..=2 {
            let share = f64::from(i) / (count + 1.0);
            for (s, g) in start.iter().zip(&goal) {
                let (origin, passed) = ray(s, g, share, link);
                assert!((origin - Point3::new(0.0, 3.0 * share, 0.0)).norm() < 1e-12);
                assert!(((passed - origin).norm() - (1.0 - 0.6 * share)).abs() < 1e-12);
                assert!((passed - origin).dot(&s.coords) > 0.0, "it points outward");
            }
        }
    }
}
