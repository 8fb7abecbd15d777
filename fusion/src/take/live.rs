//! Following a subject while it is recorded.

use toile_capture::{Frame, Rig};
use toile_geometry::Mesh;

use super::{Fuser, Outcome};
use crate::{FusionError, FusionSettings, field::extract_surface, subject::SubjectVolume};

/// Measurements (in the unit of the field's weights) below which a place of the surface is not shown: one look may be a
/// flying pixel.
const LEAST_WEIGHT: u16 = 2;

/// A [`Fuser`] that is never finished: it tracks the same way, but keeps depth and colours of some thirty frames at most,
/// however long the take is. A frame that is forgotten costs a few hundred bytes: its pose.
pub struct LiveFuser(Fuser);

impl LiveFuser {
    /// As [`Fuser::new`].
    ///
    /// # Errors
    /// Those of [`Fuser::new`].
    pub fn new(rig: &Rig, volume: Option<SubjectVolume>, settings: FusionSettings) -> Result<Self, FusionError> {
        Fuser::new(rig, volume, settings).map(Self)
    }

    /// Tracks one frame and, where its pose can be trusted, fuses it.
    ///
    /// # Errors
    /// Those of [`Fuser::push`].
    pub fn push(&mut self, frame: &Frame) -> Result<Outcome, FusionError> {
        let outcome = self.0.push(frame)?;
        self.0.kept.forget();
        Ok(outcome)
    }

    /// The surface so far: model frame (the scan frame as far as the volume knows it), metres, without colours.
    pub fn surface(&self) -> Mesh {
        extract_surface(&self.0.model.field, LEAST_WEIGHT)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scene::{Scene, steps};

    #[test]
    fn a_long_turn_is_followed_with_few_frames_in_memory() {
        let scene = Scene { with_color: true, with_floor: false, with_wall: false, ..Scene::new() };
        let settings = FusionSettings { voxel_size: 0.012, truncation: 0.04, ..FusionSettings::default() };
        let frames = scene.frames(&steps(100, 6.0));
        let volume = crate::survey(&scene.rig(), &frames[..20], &settings).unwrap();
        let mut live = LiveFuser::new(&scene.rig(), Some(volume.clone()), settings.clone()).unwrap();
        let mut fuser = Fuser::new(&scene.rig(), Some(volume), settings).unwrap();
        for (i, frame) in frames.iter().enumerate() {
            let outcome = live.push(frame).unwrap();
            assert!(matches!(outcome, Outcome::Fused { .. }), "frame {i}: {outcome:?}");
            assert!(i > 30 || outcome == fuser.push(frame).unwrap(), "frame {i}");
        }
        assert_eq!(live.0.kept.len(), 100);
        assert_eq!(live.0.kept.frames.iter().filter(|k| !k.depth.values.is_empty()).count(), 1);
        let colored = live.0.kept.frames.iter().filter(|k| k.color.is_some()).count();
        assert!(colored > 12 && colored < 32, "{colored}");
    }
}
