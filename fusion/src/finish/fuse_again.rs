//! Kept frames fused again, at better poses and with colour.

use rayon::prelude::*;
use toile_capture::Sensor;

use crate::{
    FusionError,
    field::{Tsdf, integrate},
    frame::{DepthView, decode_color},
    take::Fuser,
    tracking::KeptFrame,
};

/// Frames that are prepared together.
pub(crate) const GROUP: usize = 16;

/// The field of the scan: of all frames, with the colours of key frames. Where poses are as they were pushed and
/// there are no colours, that is the model already.
///
/// # Errors
/// [`FusionError::TooLarge`] where the field outgrows its index.
pub(crate) fn final_field(fuser: &mut Fuser) -> Result<Tsdf, FusionError> {
    let settings = &fuser.settings;
    let as_pushed = !fuser.finds_poses() || (settings.closing_rounds == 0 && settings.refine_rounds == 0);
    // At fine voxels memory decides: what is not needed any more goes before the next large thing comes.
    let nothing = fuser.model.empty_field(false);
    let pushed = std::mem::replace(&mut fuser.model.field, nothing);
    if as_pushed && !fuser.kept.has_color() {
        return Ok(pushed);
    }
    drop(pushed);
    let all: Vec<usize> = (0..fuser.kept.len()).collect();
    fuse_again(fuser, &all, true)
}

/// The field of some of the kept frames.
///
/// # Errors
/// [`FusionError::TooLarge`] where the field outgrows its index.
pub(crate) fn fuse_again(fuser: &mut Fuser, frames: &[usize], with_color: bool) -> Result<Tsdf, FusionError> {
    let with_color = with_color && fuser.kept.has_color();
    let mut field = fuser.model.empty_field(with_color);
    let colored = fuser.kept.colored_step();
    let (kept, sensors, clock) = (&fuser.kept.frames, &fuser.sensors, &mut fuser.clock);
    let step = if with_color { "integrate with colour" } else { "integrate again" };
    for group in frames.chunks(GROUP) {
        let view =
            |&i: &usize| colored_view(&kept[i], &sensors[kept[i].sensor], with_color && i.is_multiple_of(colored));
        let views: Vec<DepthView> = clock.time("prepare again", || group.par_iter().map(view).collect());
        for (&i, view) in group.iter().zip(&views) {
            clock.time(step, || integrate(&mut field, view, &kept[i].model_from_camera))?;
        }
    }
    Ok(field)
}

pub(crate) fn colored_view(kept: &KeptFrame, sensor: &Sensor, with_color: bool) -> DepthView {
    let mut view = kept.view();
    if let Some(image) = decode_color(kept.color.as_ref(), kept.index).filter(|_| with_color) {
        view.add_colors(&image, sensor);
    }
    view
}
