//! How far a run is and how long it will take: a bar on a terminal, lines in a log.

use std::{
    io::IsTerminal,
    sync::{Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use indicatif::{ProgressBar, ProgressStyle};
use toile_live::Status;
use toile_pipeline::{Account, Observer};

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
    account: Account,
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
        let state = State { remarks: Vec::new(), account: Account::default(), said: Instant::now() };
        Self { display, state: Mutex::new(state) }
    }

    /// Shows how the take that is being recorded stands.
    pub fn show_take(&self, status: &Status) {
        let mut state = self.state();
        state.account.tell(&status.to_string(), status.share);
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
        let (label, share) = (state.account.label(), state.account.share());
        let left = state.account.seconds_left().map(time_left).unwrap_or_default();
        match &self.display {
            Display::Nothing => {}
            Display::Bar(bar) => {
                bar.set_position((1000.0 * share) as u64);
                bar.set_message(format!("{label}  {left}"));
            }
            Display::Lines => {
                if begins || state.said.elapsed() >= LINE_EVERY {
                    state.said = Instant::now();
                    let percent = (100.0 * share) as u32;
                    eprintln!("[{percent:3} %] {label}{}{left}", if left.is_empty() { "" } else { ", " });
                }
            }
        }
    }
}

impl Observer for Progress {
    fn plan(&self, cost: f64) {
        self.state().account.plan(cost);
    }

    fn skip(&self, cost: f64) {
        self.state().account.skip(cost);
    }

    fn begin(&self, label: &str, cost: f64) {
        let mut state = self.state();
        state.account.begin(label, cost);
        self.show(&mut state, true);
    }

    fn at(&self, fraction: f32) {
        let mut state = self.state();
        state.account.at(f64::from(fraction));
        self.show(&mut state, false);
    }

    fn end(&self) {
        self.state().account.end();
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

/// "about 12 s left".
fn time_left(seconds: f64) -> String {
    match seconds {
        s if s < 90.0 => format!("about {:.0} s left", s.ceil()),
        s => format!("about {:.0} min left", (s / 60.0).ceil()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_left_is_told_in_words() {
        assert_eq!(time_left(9.2), "about 10 s left");
        assert_eq!(time_left(300.0), "about 5 min left");
    }
}
