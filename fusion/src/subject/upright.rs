//! Which way is up: towards the side of the image that lies away from the floor that the subject stands on.

use nalgebra::{Point3, Vector3};
use serde::{Deserialize, Serialize};
use toile_geometry::camera::PinholeCamera;

use super::{
    background::Resting,
    floor::{Floor, find_floor},
};

/// The subject stands on a floor when its lowest points lie within this height over it, metres: feet whose lower half
/// was not far enough before the floor to be seen moving.
const STANDS_WITHIN: f64 = 0.25;
/// Share of the subject's points below its lowest height: stray ones.
const STRAY: f64 = 0.02;

/// A side of the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ImageSide {
    /// The first row: the camera stands upright.
    #[default]
    Top,
    /// The camera hangs upside down.
    Bottom,
    /// The camera lies on its right side.
    Left,
    /// The camera lies on its left side.
    Right,
}

impl ImageSide {
    const ALL: [Self; 4] = [Self::Top, Self::Bottom, Self::Left, Self::Right];

    /// The unit vector towards it, camera frame (+X right, +Y down, +Z forward).
    pub(crate) fn direction(self) -> Vector3<f64> {
        match self {
            Self::Top => -Vector3::y(),
            Self::Bottom => Vector3::y(),
            Self::Left => -Vector3::x(),
            Self::Right => Vector3::x(),
        }
    }
}

/// The side of the image that is up, and the floor; the image's own top where no floor says otherwise.
pub(crate) fn find_up(
    camera: &PinholeCamera,
    resting: &Resting,
    subject: &[Point3<f32>],
) -> (ImageSide, Option<Floor>) {
    let floor = |side: ImageSide| find_floor(camera, resting, subject, &side.direction());
    let upright = floor(ImageSide::Top);
    if upright.as_ref().is_some_and(|f| stands_on(subject, f)) {
        return (ImageSide::Top, upright);
    }
    let others = ImageSide::ALL.into_iter().skip(1).filter_map(|side| Some((side, floor(side)?)));
    let turned = others.into_iter().find(|(_, f)| stands_on(subject, f));
    turned.map_or((ImageSide::Top, upright), |(side, f)| (side, Some(f)))
}

fn stands_on(subject: &[Point3<f32>], floor: &Floor) -> bool {
    let mut heights: Vec<f64> = subject.iter().map(|p| (p.cast() - floor.point).dot(&floor.normal)).collect();
    heights.sort_unstable_by(f64::total_cmp);
    heights.get((STRAY * heights.len() as f64) as usize).is_some_and(|lowest| *lowest < STANDS_WITHIN)
}
