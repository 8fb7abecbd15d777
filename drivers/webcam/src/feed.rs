//! Pictures of a colour source with their host times: read by a thread as they come, or on demand.

use std::{
    sync::mpsc::{self, Receiver, TryRecvError, TrySendError},
    thread,
};

use toile_capture::{CaptureError, ColorImage, Frame, Source};

/// Pictures that may wait to be taken; while more come, depth has stalled, and they are of no use.
const ROOM: usize = 32;

/// A picture and its host time (nanoseconds since the Unix epoch), or the end, or what went wrong.
type Next = Result<Option<(i64, ColorImage)>, CaptureError>;

/// Where pictures come from.
pub(crate) enum Feed {
    /// A thread that reads a camera; it ends with the camera, or when its next picture finds nobody who takes it.
    Live(Receiver<Next>),
    /// A recording.
    OnDemand { source: Box<dyn Source>, is_host_time: bool },
    /// Nothing more comes.
    Ended,
}

impl Feed {
    /// Pictures of `source`; `is_host_time`: its device times are of the host's wall clock, nearer to the exposure than
    /// the time of arrival.
    pub(crate) fn new(source: Box<dyn Source>, is_host_time: bool, is_live: bool) -> Self {
        if !is_live {
            return Self::OnDemand { source, is_host_time };
        }
        let (sender, receiver) = mpsc::sync_channel(ROOM);
        let read = move || {
            let mut source = source;
            loop {
                let next = next_picture(&mut *source, is_host_time);
                let is_last = !matches!(next, Ok(Some(_)));
                // The end must arrive; a picture for which there is no room need not.
                let sent = if is_last { sender.send(next).map_err(drop) } else { offer(&sender, next) };
                if is_last || sent.is_err() {
                    return;
                }
            }
        };
        match thread::Builder::new().name("webcam".into()).spawn(read) {
            Ok(_) => Self::Live(receiver),
            Err(error) => {
                tracing::warn!(%error, "no thread for the webcam's pictures: depth is without colour");
                Self::Ended
            }
        }
    }

    /// The next picture that is here; on demand: where it is `wanted`. `Ok(None)` comes once, at the end.
    pub(crate) fn next(&mut self, wanted: bool) -> Option<Next> {
        let next = match self {
            Self::Live(receiver) => match receiver.try_recv() {
                Ok(next) => next,
                Err(TryRecvError::Empty) => return None,
                Err(TryRecvError::Disconnected) => Ok(None),
            },
            Self::OnDemand { source, is_host_time } if wanted => next_picture(&mut **source, *is_host_time),
            Self::OnDemand { .. } | Self::Ended => return None,
        };
        if !matches!(next, Ok(Some(_))) {
            *self = Self::Ended;
        }
        Some(next)
    }
}

fn offer(sender: &mpsc::SyncSender<Next>, next: Next) -> Result<(), ()> {
    match sender.try_send(next) {
        Ok(()) | Err(TrySendError::Full(_)) => Ok(()),
        Err(TrySendError::Disconnected(_)) => Err(()),
    }
}

/// The next frame of the first sensor that has colour. A frame that cannot be read is passed over.
fn next_picture(source: &mut dyn Source, is_host_time: bool) -> Next {
    loop {
        match source.next_frame() {
            Ok(Some(Frame { sensor: 0, color: Some(color), device_time_ns, host_time_ns, .. })) => {
                return Ok(Some((if is_host_time { device_time_ns } else { host_time_ns }, color)));
            }
            Ok(None) => return Ok(None),
            Ok(Some(_)) => {}
            Err(CaptureError::Frame { index, reason }) => tracing::warn!(index, reason, "a picture is passed over"),
            Err(error) => return Err(error),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::{sync::Arc, time::Duration};

    use toile_capture::{RgbImage, Rig};

    use super::*;

    /// Gives a hundred pictures at once, says so, and fails.
    struct Failing {
        rig: Rig,
        given: u64,
        failing: mpsc::Sender<()>,
    }

    impl Source for Failing {
        fn rig(&self) -> &Rig {
            &self.rig
        }

        fn next_frame(&mut self) -> Result<Option<Frame>, CaptureError> {
            if self.given == 100 {
                let _ = self.failing.send(());
                return Err(CaptureError::Device { device: "webcam".into(), reason: "unplugged".into() });
            }
            self.given += 1;
            let image = RgbImage { width: 1, height: 1, pixels: vec![[0; 3]] };
            Ok(Some(Frame {
                sensor: 0,
                index: self.given - 1,
                device_frame: self.given - 1,
                lost_before: 0,
                device_time_ns: 0,
                host_time_ns: 0,
                depth: None,
                color: Some(ColorImage::Rgb(Arc::new(image))),
            }))
        }
    }

    #[test]
    fn pictures_that_nobody_takes_are_dropped_but_a_failure_is_told() {
        let (failing, has_failed) = mpsc::channel();
        let mut feed = Feed::new(Box::new(Failing { rig: Rig::default(), given: 0, failing }), false, true);
        has_failed.recv().unwrap();
        thread::sleep(Duration::from_millis(20));
        let (mut pictures, mut told) = (0, None);
        while told.is_none() {
            match feed.next(false) {
                Some(Ok(Some(_))) => pictures += 1,
                Some(end) => told = Some(end),
                None => thread::sleep(Duration::from_millis(1)),
            }
        }
        assert_eq!(pictures, ROOM);
        assert!(told.is_some_and(|end| end.is_err_and(|error| error.to_string().contains("unplugged"))));
        assert!(feed.next(true).is_none());
    }
}
