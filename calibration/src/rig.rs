//! From corners to cameras: each alone first, then where they stand, then all together.

use nalgebra::{Matrix3, Point2, Point3};
use toile_geometry::{Rigid, camera::PinholeCamera};

use crate::{
    board::{Board, Corner},
    bundle::{Bundle, Seen, Unknown},
    closed_form::{camera_from_plane, intrinsics},
    error::CalibrationError,
    homography::homography,
};

/// Pictures from which a lens is found at least.
const LEAST_VIEWS: usize = 4;
/// Corners that a view has at least.
const LEAST_CORNERS: usize = 6;

/// The board as one camera saw it.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// Which camera.
    pub camera: usize,
    /// Views of one moment show the board in one place.
    pub moment: usize,
    /// The corners that it saw, each once.
    pub corners: Vec<Corner>,
}

/// Cameras that were calibrated.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibratedRig {
    /// Their lenses.
    pub cameras: Vec<PinholeCamera>,
    /// Where the first camera's frame is in each camera's, metres.
    pub camera_from_first: Vec<Rigid>,
    /// Root mean square distance of each camera's corners from where they were seen, pixels.
    pub rms_px: Vec<f64>,
    /// Views of each camera.
    pub views: Vec<usize>,
    /// Views that each camera shares with another one.
    pub shared: Vec<usize>,
}

/// Calibrates cameras from views of a board. `names` are the cameras'; a lens that is told stays, one that is not
/// (`Err` of width and height) is found.
///
/// Views of fewer than six corners, or of corners in one row, are left out: they do not tell where the board is.
///
/// # Errors
/// [`CalibrationError`] names the camera that sees too little.
pub fn calibrate(
    names: &[String],
    lenses: &[Result<PinholeCamera, (u32, u32)>],
    views: &[View],
    board: &Board,
) -> Result<CalibratedRig, CalibrationError> {
    let points = board.points();
    let plane = board.corners();
    let views: Vec<View> = views.iter().filter(|view| tells_a_place(view, board)).cloned().collect();
    let views = &views[..];
    let mut cameras = Vec::new();
    for (c, lens) in lenses.iter().enumerate() {
        let of: Vec<&View> = views.iter().filter(|v| v.camera == c).collect();
        cameras.push(alone(&names[c], *lens, &of, &plane, &points)?);
    }
    let moments = views.iter().map(|v| v.moment + 1).max().unwrap_or(0);
    let camera_from_board: Vec<Option<Rigid>> =
        views.iter().map(|v| pose(&cameras[v.camera].lens, &v.corners, &plane)).collect();
    place(names, &mut cameras, views, &camera_from_board)?;
    let of_moment = |m: usize| {
        let seen = (0..views.len()).find(|&i| views[i].moment == m && camera_from_board[i].is_some());
        seen.and_then(|i| Some(cameras[views[i].camera].camera_from_rig.inverse() * camera_from_board[i]?))
    };
    let boards: Vec<Option<Rigid>> = (0..moments).map(of_moment).collect();
    let seen: Vec<Seen> = views.iter().filter(|v| boards[v.moment].is_some()).map(seen_of).collect();
    let boards = boards.into_iter().map(|b| b.unwrap_or_else(Rigid::identity)).collect();
    let mut bundle = Bundle { cameras, boards, seen: &seen, points: &points };
    bundle.refine();
    let shared = |c: usize, v: &&View| v.camera == c && views.iter().any(|o| o.moment == v.moment && o.camera != c);
    Ok(CalibratedRig {
        rms_px: (0..lenses.len()).map(|c| bundle.rms(c)).collect(),
        views: (0..lenses.len()).map(|c| seen.iter().filter(|s| s.camera == c).count()).collect(),
        shared: (0..lenses.len()).map(|c| views.iter().filter(|v| shared(c, v)).count()).collect(),
        camera_from_first: bundle.cameras.iter().map(|c| c.camera_from_rig).collect(),
        cameras: bundle.cameras.iter().map(|c| c.lens).collect(),
    })
}

/// True where a view has enough corners, in two rows and columns at least.
fn tells_a_place(view: &View, board: &Board) -> bool {
    let differ = |of: fn(usize, usize) -> usize| {
        let mut all = view.corners.iter().map(|corner| of(corner.id, board.columns));
        let first = all.next();
        all.any(|other| Some(other) != first)
    };
    let is_known = view.corners.iter().all(|corner| corner.id < board.count());
    view.corners.len() >= LEAST_CORNERS && is_known && differ(|id, w| id / w) && differ(|id, w| id % w)
}

fn seen_of(view: &View) -> Seen {
    Seen { camera: view.camera, moment: view.moment, corners: view.corners.clone() }
}

/// The lens of a camera from its own views, unless it is told.
fn alone(
    name: &str,
    lens: Result<PinholeCamera, (u32, u32)>,
    views: &[&View],
    plane: &[Point2<f64>],
    points: &[Point3<f64>],
) -> Result<Unknown, CalibrationError> {
    let least = if lens.is_ok() { 1 } else { LEAST_VIEWS };
    if views.len() < least {
        return Err(CalibrationError::TooFewViews { camera: name.into(), views: views.len(), least });
    }
    let unknown = |lens| Unknown { lens, is_told: false, camera_from_rig: Rigid::identity() };
    let (width, height) = match lens {
        Ok(lens) => return Ok(Unknown { is_told: true, ..unknown(lens) }),
        Err(size) => size,
    };
    let degenerate = || CalibrationError::Degenerate { camera: name.into() };
    let maps: Vec<Matrix3<f64>> = views.iter().filter_map(|v| map_of(&v.corners, plane, Some)).collect();
    let first = intrinsics(&maps, width, height).ok_or_else(degenerate)?;
    let (mut seen, mut boards) = (Vec::new(), Vec::new());
    for view in views {
        if let Some(board) = pose(&first, &view.corners, plane) {
            seen.push(Seen { camera: 0, moment: boards.len(), corners: view.corners.clone() });
            boards.push(board);
        }
    }
    let mut bundle = Bundle { cameras: vec![unknown(first)], boards, seen: &seen, points };
    bundle.refine();
    let found = bundle.cameras[0];
    if found.lens.is_valid() { Ok(found) } else { Err(degenerate()) }
}

/// Where the board is before a camera.
fn pose(lens: &PinholeCamera, corners: &[Corner], plane: &[Point2<f64>]) -> Option<Rigid> {
    let ideal = lens.undistorted();
    let straight = |p: Point2<f64>| ideal.project(&lens.unproject(p.x, p.y, 1.0));
    camera_from_plane(&map_of(corners, plane, straight)?, &ideal)
}

/// The map of the board's plane to corners, each as `pixel` changes it.
fn map_of(
    corners: &[Corner],
    plane: &[Point2<f64>],
    pixel: impl Fn(Point2<f64>) -> Option<Point2<f64>>,
) -> Option<Matrix3<f64>> {
    let pairs = corners.iter().filter_map(|corner| Some((plane[corner.id], pixel(corner.at)?)));
    let (plane, pixels): (Vec<_>, Vec<_>) = pairs.unzip();
    homography(&plane, &pixels)
}

/// Places all cameras from boards that two of them see, beginning with the first one.
fn place(
    names: &[String],
    cameras: &mut [Unknown],
    views: &[View],
    camera_from_board: &[Option<Rigid>],
) -> Result<(), CalibrationError> {
    let mut placed = vec![false; cameras.len()];
    placed[0] = true;
    while let Some(next) = (0..cameras.len()).filter(|&c| !placed[c]).max_by_key(|&c| shared(views, c, &placed).len()) {
        let pairs = shared(views, next, &placed);
        let candidate = |&(own, other): &(usize, usize)| {
            let board_from_rig = camera_from_board[other]?.inverse() * cameras[views[other].camera].camera_from_rig;
            Some(camera_from_board[own]? * board_from_rig)
        };
        let places: Vec<Rigid> = pairs.iter().filter_map(candidate).collect();
        let far = |a: &Rigid| -> f64 { places.iter().map(|b| distance(a, b).min(1.0)).sum() };
        let best = places.iter().min_by(|a, b| far(a).total_cmp(&far(b)));
        let Some(best) = best else {
            return Err(CalibrationError::NotConnected { camera: names[next].clone() });
        };
        cameras[next].camera_from_rig = *best;
        placed[next] = true;
    }
    Ok(())
}

/// Pairs of views of a camera and of one that is placed, of the same moment.
fn shared(views: &[View], camera: usize, placed: &[bool]) -> Vec<(usize, usize)> {
    let of = |c: bool, i: usize| if c { views[i].camera == camera } else { placed[views[i].camera] };
    let own = (0..views.len()).filter(|&i| of(true, i));
    own.flat_map(|i| (0..views.len()).filter(move |&j| views[j].moment == views[i].moment).map(move |j| (i, j)))
        .filter(|&(_, j)| of(false, j))
        .collect()
}

/// How far apart two poses are at two metres.
fn distance(a: &Rigid, b: &Rigid) -> f64 {
    let off = a.inverse() * b;
    off.translation.vector.norm() + 2.0 * off.rotation.angle()
}
