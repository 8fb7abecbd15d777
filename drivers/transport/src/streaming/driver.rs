//! How a camera that streams is driven, whatever its kind: step by step; after a silence its streams are switched off and
//! on once; at the end all frames that came are given, then one error, then nothing.

use std::{mem, time::Duration};

/// The streams of an open camera, as [`Streaming`] drives them.
pub trait Streams {
    /// The frames that they give.
    type Frame;
    /// The error that ends them.
    type Error;

    /// The next frame that is ready; an error costs that frame alone.
    fn pop(&mut self) -> Option<Result<Self::Frame, Self::Error>>;

    /// Takes what comes next, and returns in a bounded time where nothing comes.
    ///
    /// # Errors
    /// The error that ends the streams, such as an unplug.
    fn step(&mut self) -> Result<Progress, Self::Error>;

    /// Switches the streams off and on; frames of which a part came are given up.
    ///
    /// # Errors
    /// The error that ends the streams.
    fn restart(&mut self) -> Result<(), Self::Error>;

    /// Nothing more comes: what waits for a partner goes on alone.
    fn finish(&mut self);

    /// Switches the streams off for good; `answers`: whether the camera is thought to hear it. By default nothing is done,
    /// for streams that end when they are dropped.
    fn stop(&mut self, answers: bool) {
        let _ = answers;
    }

    /// The error where no frame came for `limit`, and again for `limit` after a restart.
    fn silent(limit: Duration) -> Self::Error;
}

/// The result of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    /// A whole picture of a stream.
    Picture,
    /// No whole picture in this time.
    Silence(Duration),
    /// No whole picture in the time limit.
    TimedOut,
}

/// A camera that streams; its streams are stopped when this is dropped.
#[derive(Debug)]
pub struct Streaming<S: Streams> {
    streams: S,
    limit: Duration,
    /// Time without a whole picture.
    silence: Duration,
    given: u64,
    /// Frames given when the streams were last switched off and on.
    given_at_restart: Option<u64>,
    restarts: u32,
    course: Course<S::Error>,
}

#[derive(Debug)]
enum Course<E> {
    Running,
    /// To be reported after the frames that came.
    Failed(E),
    Over,
}

impl<S: Streams> Streaming<S> {
    /// Drives streams that are switched on; `limit`: the longest time without a whole picture.
    pub fn new(streams: S, limit: Duration) -> Self {
        let (silence, course) = (Duration::ZERO, Course::Running);
        Self { streams, limit, silence, given: 0, given_at_restart: None, restarts: 0, course }
    }

    /// Switches streams on by `start` and drives them. Where `start` fails half-way, what is on already is stopped.
    ///
    /// # Errors
    /// The error of `start`.
    pub fn start(
        streams: S,
        limit: Duration,
        start: impl FnOnce(&mut S) -> Result<(), S::Error>,
    ) -> Result<Self, S::Error> {
        let mut streaming = Self::new(streams, limit);
        start(&mut streaming.streams)?;
        Ok(streaming)
    }

    /// The next frame; `None` at the end.
    ///
    /// # Errors
    /// The report of [`Streams::pop`] for one frame; after the last frame, once, what ended the streams.
    pub fn next_frame(&mut self) -> Result<Option<S::Frame>, S::Error> {
        loop {
            if let Some(frame) = self.streams.pop() {
                self.given += 1;
                return frame.map(Some);
            }
            match mem::replace(&mut self.course, Course::Over) {
                Course::Running => self.course = Course::Running,
                Course::Failed(error) => return Err(error),
                Course::Over => return Ok(None),
            }
            if let Err(error) = self.step() {
                self.streams.finish();
                self.course = Course::Failed(error);
            }
        }
    }

    /// The streams.
    pub fn streams(&self) -> &S {
        &self.streams
    }

    /// The streams, to set their controls.
    pub fn streams_mut(&mut self) -> &mut S {
        &mut self.streams
    }

    /// How often they were switched off and on.
    pub fn restarts(&self) -> u32 {
        self.restarts
    }

    /// True while nothing has ended them.
    pub fn is_running(&self) -> bool {
        matches!(self.course, Course::Running)
    }

    fn step(&mut self) -> Result<(), S::Error> {
        self.silence = match self.streams.step()? {
            Progress::Picture => Duration::ZERO,
            Progress::Silence(time) => self.silence.saturating_add(time),
            Progress::TimedOut => Duration::MAX,
        };
        if self.silence > self.limit { self.restart() } else { Ok(()) }
    }

    /// A second silence without a frame since the restart is an error: the camera would be switched off and on for ever.
    fn restart(&mut self) -> Result<(), S::Error> {
        if self.given_at_restart == Some(self.given) {
            return Err(S::silent(self.limit));
        }
        tracing::warn!(limit = ?self.limit, "no frame in time; the camera's streams are switched off and on");
        self.restarts += 1;
        self.given_at_restart = Some(self.given);
        self.silence = Duration::ZERO;
        self.streams.restart()
    }
}

impl<S: Streams> Drop for Streaming<S> {
    fn drop(&mut self) {
        self.streams.stop(self.is_running());
    }
}

#[cfg(test)]
mod tests {
    use std::{cell::Cell, rc::Rc};

    use super::*;

    /// Steps that are written down: what each brings, and whether a frame is ready after it.
    struct Script {
        steps: std::vec::IntoIter<Result<(Progress, bool), &'static str>>,
        ready: Vec<u32>,
        next: u32,
        waits: bool,
        stopped: Rc<Cell<Option<bool>>>,
    }

    impl Streams for Script {
        type Frame = u32;
        type Error = &'static str;

        fn pop(&mut self) -> Option<Result<u32, &'static str>> {
            self.ready.pop().map(Ok)
        }

        fn step(&mut self) -> Result<Progress, &'static str> {
            let (progress, is_ready) = self.steps.next().unwrap_or(Err("unplugged"))?;
            if is_ready {
                self.ready.push(self.next);
            }
            self.next += 1;
            Ok(progress)
        }

        fn restart(&mut self) -> Result<(), &'static str> {
            Ok(())
        }

        fn finish(&mut self) {
            if mem::take(&mut self.waits) {
                self.ready.push(99);
            }
        }

        fn stop(&mut self, answers: bool) {
            self.stopped.set(Some(answers));
        }

        fn silent(_limit: Duration) -> &'static str {
            "silent"
        }
    }

    fn script(steps: &[(Progress, bool)], waits: bool) -> Script {
        let steps: Vec<_> = steps.iter().copied().map(Ok).collect();
        Script { steps: steps.into_iter(), ready: Vec::new(), next: 0, waits, stopped: Rc::default() }
    }

    const QUARTER: Progress = Progress::Silence(Duration::from_millis(25));

    /// Frames and errors of a script with a limit of 100 ms, up to its end, and the restarts.
    fn run(steps: &[(Progress, bool)], waits: bool) -> (Vec<Result<u32, &'static str>>, u32) {
        let mut streaming = Streaming::new(script(steps, waits), Duration::from_millis(100));
        let results = std::iter::from_fn(|| streaming.next_frame().transpose()).collect();
        (results, streaming.restarts())
    }

    #[test]
    fn a_silence_is_tried_once_more_and_the_second_one_in_a_row_ends_the_streams() {
        let frame = (Progress::Picture, true);
        let silence = [(QUARTER, false); 5];
        let woken = [&[frame][..], &silence, &[frame], &silence, &[frame]].concat();
        assert_eq!(run(&woken, false), (vec![Ok(0), Ok(6), Ok(12), Err("unplugged")], 2));
        let dead = [&[frame][..], &silence, &silence, &[frame]].concat();
        assert_eq!(run(&dead, false), (vec![Ok(0), Err("silent")], 1));
        // Pictures that never make a frame do not keep the camera going for ever.
        let useless = [&silence[..], &[(Progress::Picture, false)], &silence, &[frame]].concat();
        assert_eq!(run(&useless, false), (vec![Err("silent")], 1));
        let stuck = [(Progress::TimedOut, false), (Progress::TimedOut, false)];
        assert_eq!(run(&stuck, false), (vec![Err("silent")], 1));
    }

    #[test]
    fn a_picture_ends_the_silence_before_the_limit() {
        let almost = [(QUARTER, false); 4];
        let steps = [&almost[..], &[(Progress::Picture, false)], &almost].concat();
        assert_eq!(run(&steps, false), (vec![Err("unplugged")], 0));
    }

    #[test]
    fn streams_are_stopped_at_the_end_and_after_a_failed_start() {
        let limit = Duration::from_millis(100);
        let running = script(&[(Progress::Picture, true)], false);
        let stopped = Rc::clone(&running.stopped);
        let mut streaming = Streaming::start(running, limit, |_| Ok(())).expect("nothing fails");
        assert_eq!((streaming.next_frame(), stopped.get()), (Ok(Some(0)), None));
        drop(streaming);
        assert_eq!(stopped.get(), Some(true));

        let failing = script(&[], false);
        let stopped = Rc::clone(&failing.stopped);
        assert_eq!(Streaming::start(failing, limit, |_| Err("refused")).err(), Some("refused"));
        assert_eq!(stopped.get(), Some(true));

        // A camera that is gone gets no command.
        let gone = script(&[], false);
        let stopped = Rc::clone(&gone.stopped);
        assert_eq!(Streaming::new(gone, limit).next_frame(), Err("unplugged"));
        assert_eq!(stopped.get(), Some(false));
    }

    #[test]
    fn what_waits_is_given_before_the_one_error_and_then_the_end() {
        assert_eq!(run(&[(Progress::Picture, true)], true).0, [Ok(0), Ok(99), Err("unplugged")]);
    }
}
