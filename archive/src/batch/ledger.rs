//! What a batch keeps: how each subject ended, what is left, and who is in quarantine.

use std::{path::Path, time::Instant};

use serde::Serialize;
use toile_pipeline::Options;

use super::{
    event::{Ended, Event, Fate},
    outlook::Outlook,
    quarantine::Quarantine,
};
use crate::ArchiveError;

/// How a batch went.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Totals {
    /// How each subject that was due ended, in the order of their names.
    pub ended: Vec<Ended>,
    /// From the first process to the last, seconds.
    pub seconds: f64,
    /// Processor time of the subjects' processes, seconds.
    pub cpu_seconds: f64,
    /// Most subjects that ran side by side.
    pub most_at_once: usize,
    /// True where the batch was asked to stop before its end.
    pub stopped: bool,
    /// True where it stopped because the disk is full.
    pub disk_full: bool,
}

/// What is known while a batch runs.
pub(crate) struct Ledger<'a> {
    pub(crate) archive: &'a Path,
    pub(crate) options: &'a Options,
    pub(crate) hear: &'a mut dyn FnMut(&Event),
    pub(crate) totals: Totals,
    of: usize,
    /// Expected seconds of what is still to be done, and of what is done.
    ahead: f64,
    behind: f64,
    started: Instant,
}

impl<'a> Ledger<'a> {
    /// Of a batch that begins now.
    pub(crate) fn new(
        archive: &'a Path,
        outlook: &Outlook,
        options: &'a Options,
        hear: &'a mut dyn FnMut(&Event),
    ) -> Self {
        let (of, ahead) = (outlook.due().count(), outlook.seconds());
        Self { archive, options, hear, totals: Totals::default(), of, ahead, behind: 0.0, started: Instant::now() }
    }

    /// A subject that was expected to take `expected` seconds is finished.
    pub(crate) fn end(&mut self, expected: f64, ended: Ended) -> Result<(), ArchiveError> {
        match ended.outcome {
            Fate::Failed if !self.totals.disk_full && ended.attempts > 1 => {
                let why = ended.why.as_deref().unwrap_or("nobody knows why");
                Quarantine::new(self.archive, &ended.subject, self.options, why)?.write(self.archive)?;
            }
            Fate::Done | Fate::Lost | Fate::FailedInPart => Quarantine::lift(self.archive, &ended.subject),
            Fate::Failed | Fate::Busy | Fate::Elsewhere => {}
        }
        self.ahead = (self.ahead - expected).max(0.0);
        self.behind += expected;
        let pace = self.started.elapsed().as_secs_f64() / self.behind.max(1e-9);
        let event = Event::Ends {
            ended: &ended,
            done: self.totals.ended.len() + 1,
            of: self.of,
            expected_seconds: expected,
            seconds_left: pace * self.ahead,
        };
        (self.hear)(&event);
        self.totals.ended.push(ended);
        Ok(())
    }

    /// The end of the batch.
    pub(crate) fn close(mut self) -> Totals {
        self.totals.ended.sort_by(|a, b| a.subject.cmp(&b.subject));
        self.totals.seconds = self.started.elapsed().as_secs_f64();
        self.totals
    }
}
