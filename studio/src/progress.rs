//! How far a run is and how long it will take: a bar on a terminal, lines in a log.

use std::{
    io::IsTerminal,
    sync::{Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use indicatif::{ProgressBar, ProgressStyle};
use toile_capture::printable;
use toile_live::Status;
use toile_pipeline::Observer;

/// Without a terminal a running step says a line at most this often.
const LINE_EVERY: Duration = Duration::from_secs(5);

/// Progress of one run. Costs are expected seconds; only their proportions matter.
pub struct Progress {
    display: Display,
    state: Mutex<State>,
}

enum Display {
    Nothing,
    Bar(ProgressBar),
    Lines,
}

struct State {
    remarks: Vec<String>,
    label: String,
    /// Cost of what is still to be done, the running step included.
    ahead: f64,
    /// Cost of what this run has done itself.
    done: f64,
    step: f64,
    fraction: f64,
    started: Instant,
    said: Instant,
}

impl Progress {
    /// Shows nothing where `quiet`, a bar where standard error is a terminal, lines elsewhere.
    pub fn new(quiet: bool) -> Self {
        let display = match (quiet, std::io::stderr().is_terminal()) {
            (true, _) => Display::Nothing,
            (false, true) => Display::Bar(bar()),
            (false, false) => Display::Lines,
        };
        let now = Instant::now();
        let state = State {
            remarks: Vec::new(),
            label: String::new(),
            ahead: 0.0,
            done: 0.0,
            step: 0.0,
            fraction: 0.0,
            started: now,
            said: now,
        };
        Self { display, state: Mutex::new(state) }
    }

    /// Shows how the take that is being recorded stands.
    pub fn show_take(&self, status: &Status) {
        let mut state = self.state();
        state.label = status.to_string();
        state.fraction = status.share.clamp(state.fraction, 1.0);
        self.show(&mut state, false);
    }

    /// The remarks of the steps, each once.
    pub fn take_remarks(&self) -> Vec<String> {
        std::mem::take(&mut self.state().remarks)
    }

    /// Says a line without disturbing the bar.
    pub fn say(&self, line: &str) {
        match &self.display {
            Display::Nothing => {}
            Display::Bar(bar) => bar.suspend(|| eprintln!("{line}")),
            Display::Lines => eprintln!("{line}"),
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        if let Display::Bar(bar) = &self.display {
            bar.finish_and_clear();
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn show(&self, state: &mut State, begins: bool) {
        let whole = state.done + state.ahead;
        let done = state.done + state.fraction * state.step;
        let left = time_left(state.started.elapsed().as_secs_f64(), done, whole);
        match &self.display {
            Display::Nothing => {}
            Display::Bar(bar) => {
                bar.set_position((1000.0 * done / whole.max(1e-9)) as u64);
                bar.set_message(format!("{}  {left}", state.label));
            }
            Display::Lines => {
                if begins || state.said.elapsed() >= LINE_EVERY {
                    state.said = Instant::now();
                    let percent = (100.0 * done / whole.max(1e-9)) as u32;
                    eprintln!("[{percent:3} %] {}{}{left}", state.label, if left.is_empty() { "" } else { ", " });
                }
            }
        }
    }
}

impl Observer for Progress {
    fn plan(&self, cost: f64) {
        self.state().ahead += cost;
    }

    fn skip(&self, cost: f64) {
        let mut state = self.state();
        state.ahead = (state.ahead - cost).max(0.0);
    }

    fn begin(&self, label: &str, cost: f64) {
        let mut state = self.state();
        (state.label, state.step, state.fraction) = (printable(label).into_owned(), cost, 0.0);
        state.ahead = state.ahead.max(cost);
        self.show(&mut state, true);
    }

    fn at(&self, fraction: f32) {
        let mut state = self.state();
        state.fraction = f64::from(fraction).clamp(state.fraction, 1.0);
        self.show(&mut state, false);
    }

    fn end(&self) {
        let mut state = self.state();
        state.ahead = (state.ahead - state.step).max(0.0);
        state.done += state.step;
        (state.step, state.fraction) = (0.0, 0.0);
    }

    fn remark(&self, sentence: &str) {
        self.state().remarks.push(sentence.to_string());
    }
}

fn bar() -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:30} {percent:>3} %  {elapsed}  {msg}")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::new(1000).with_style(style);
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}

/// "about 12 s left", or nothing while too little is done for an estimate.
fn time_left(elapsed: f64, done: f64, whole: f64) -> String {
    if done < 0.02 * whole || elapsed < 1.0 || done <= 0.0 {
        return String::new();
    }
    let seconds = (elapsed * (whole - done) / done).max(0.0);
    match seconds {
        s if s < 90.0 => format!("about {:.0} s left", s.ceil()),
        s => format!("about {:.0} min left", (s / 60.0).ceil()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_left_scales_with_what_is_left() {
        assert_eq!(time_left(10.0, 1.0, 2.0), "about 10 s left");
        assert_eq!(time_left(100.0, 1.0, 4.0), "about 5 min left");
        assert_eq!(time_left(0.5, 1.0, 4.0), "");
        assert_eq!(time_left(10.0, 0.0, 4.0), "");
    }

    #[test]
    fn a_label_cannot_steer_the_terminal() {
        let progress = Progress::new(true);
        progress.begin("a\u{1b}[2J\nb\u{202e}: fuse", 1.0);
        assert_eq!(progress.state().label, "a\\u{1b}[2J\\u{a}b\\u{202e}: fuse");
    }

    #[test]
    fn skipped_steps_do_not_count_as_done() {
        let progress = Progress::new(true);
        progress.plan(10.0);
        progress.skip(4.0);
        progress.begin("fuse", 6.0);
        progress.at(0.5);
        progress.end();
        let state = progress.state();
        assert_eq!((state.ahead, state.done), (0.0, 6.0));
    }
}
