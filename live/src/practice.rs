//! The virtual person as a live camera: frames come when a camera's would, whether or not anybody is ready for them.

use std::{
    thread::sleep,
    time::{Duration, Instant},
};

use rayon::prelude::*;
use toile_capture::{CaptureError, ColorImage, Frame, Rig, Source, depth_codec, host_now_ns};
use toile_synthetic::{SyntheticError, SyntheticSettings, Take};

/// Frames a second.
const FPS: f64 = 30.0;
/// One turn of the disk: 24° a second.
const TURN: Duration = Duration::from_secs(15);
/// Views that are rendered of a turn, 2.4° apart; each is shown for three frames, so that the camera is open after seconds.
const VIEWS: usize = 150;
/// Frames that wait in a camera's buffers before it overwrites them.
const BUFFERS: u64 = 10;

/// A virtual person who turns for ever before a camera that does not wait.
pub struct Practice {
    rig: Rig,
    /// One turn, packed.
    turn: Vec<(Vec<u8>, ColorImage)>,
    next: u64,
    given: u64,
    began: Option<Instant>,
}

impl Practice {
    /// Puts the person of `settings` on the disk as for take `take`; renders one whole turn, which takes a few seconds.
    ///
    /// # Errors
    /// [`SyntheticError`] where a setting is out of range or the person has no such take.
    pub fn open(settings: &SyntheticSettings, take: usize) -> Result<Self, SyntheticError> {
        let degrees = 360.0 * (VIEWS - 1) as f64 / VIEWS as f64;
        let settings = SyntheticSettings { frames: VIEWS, degrees, fps: FPS, ..settings.clone() };
        let scene = toile_synthetic::Subject::new(&settings)?.take(take)?;
        let turn: Vec<_> = (0..VIEWS).into_par_iter().map(|k| packed(&scene, k)).collect::<Result<_, _>>()?;
        Ok(Self { rig: scene.rig(), turn, next: 0, given: 0, began: None })
    }

    /// Waits for the next frame; frames that nobody took for longer than the buffers hold are lost.
    fn wait(&mut self) -> u32 {
        let began = *self.began.get_or_insert_with(Instant::now);
        let due = began + Duration::from_secs_f64(self.next as f64 / FPS);
        sleep(due.saturating_duration_since(Instant::now()));
        let behind = (began.elapsed().as_secs_f64() * FPS) as u64;
        let lost = behind.saturating_sub(self.next).saturating_sub(BUFFERS);
        self.next += lost;
        lost as u32
    }
}

fn packed(scene: &Take, k: usize) -> Result<(Vec<u8>, ColorImage), SyntheticError> {
    let frame = scene.frame(k)?;
    let wrong = |reason: String| SyntheticError::Encode { index: k, reason };
    let depth = frame.depth.as_deref().ok_or_else(|| wrong("there is no depth".into()))?;
    let color = frame.color.ok_or_else(|| wrong("there is no colour".into()))?;
    Ok((depth_codec::encode(depth).map_err(|error| wrong(error.to_string()))?, color))
}

impl Source for Practice {
    fn rig(&self) -> &Rig {
        &self.rig
    }

    fn next_frame(&mut self) -> Result<Option<Frame>, CaptureError> {
        let lost_before = self.wait();
        let number = self.next;
        let shown = number as f64 / (TURN.as_secs_f64() * FPS) * self.turn.len() as f64;
        let (depth, color) = &self.turn[shown as usize % self.turn.len()];
        let wrong = |reason: String| CaptureError::Frame { index: number, reason };
        let depth = depth_codec::decode(depth).map_err(|error| wrong(error.to_string()))?;
        let index = self.given;
        (self.next, self.given) = (number + 1, index + 1);
        Ok(Some(Frame {
            sensor: 0,
            index,
            device_frame: number,
            lost_before,
            device_time_ns: 1_000_000_000 + (number as f64 * 1e9 / FPS) as i64,
            host_time_ns: host_now_ns(),
            depth: Some(depth.into()),
            color: Some(color.clone()),
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_come_at_their_time_and_are_lost_where_nobody_takes_them() {
        let settings = SyntheticSettings { frames: 4, garments: Vec::new(), ..SyntheticSettings::default() };
        let scene = toile_synthetic::Subject::new(&settings).unwrap().take(0).unwrap();
        let turn: Vec<_> = (0..4).map(|k| packed(&scene, k).unwrap()).collect();
        let mut practice = Practice { rig: scene.rig(), turn, next: 0, given: 0, began: None };
        let began = Instant::now();
        let numbers: Vec<u64> = (0..6).map(|_| practice.next_frame().unwrap().unwrap().device_frame).collect();
        assert_eq!(numbers, [0, 1, 2, 3, 4, 5]);
        assert!(began.elapsed() >= Duration::from_millis(160), "a sixth frame comes after five periods");
        sleep(Duration::from_millis(800));
        let late = practice.next_frame().unwrap().unwrap();
        assert!(late.lost_before >= 8 && late.device_frame == 6 + u64::from(late.lost_before), "{}", late.lost_before);
        assert_eq!(late.index, 6);
    }
}
