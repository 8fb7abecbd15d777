//! The camera that is asked for, and what its firmware says it is.

use toile_driver_transport::{TransportError, video::Video};

use crate::{
    Camera, RealsenseError, find,
    monitor::{self, Details},
};

/// The first camera, or that with this serial number, and what it says it is.
pub(crate) fn choose(video: &dyn Video, serial: Option<&str>) -> Result<(Camera, Details), RealsenseError> {
    let mut why = None;
    for camera in find::list(video)? {
        let Some(nodes) = &camera.depth else {
            why = Some(find::refusal(video, &camera).map_or(RealsenseError::NoNode("depth"), RealsenseError::from));
            continue;
        };
        let asked = video.open(&nodes.pictures).map_err(RealsenseError::from);
        match asked.and_then(|mut node| monitor::ask_details(&mut *node)) {
            Ok(details) if serial.is_none_or(|s| s == details.serial || s == camera.serial) => {
                return Ok((camera, details));
            }
            Ok(_) => {}
            Err(error) => why = Some(error),
        }
    }
    let what =
        serial.map_or("a RealSense camera".to_string(), |s| format!("a RealSense camera with serial number {s}"));
    Err(why.unwrap_or(TransportError::NotFound { what }.into()))
}
