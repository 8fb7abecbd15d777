//! One run of the program: words in, answer out.

use std::{
    ffi::OsString,
    io::{self, IsTerminal, Write},
    sync::{Arc, atomic::AtomicBool},
};

use clap::{CommandFactory, Parser, error::ErrorKind};
use signal_hook::{consts::SIGXFSZ, flag};
use toile_capture::{printable, printable_lines};
use toile_pipeline::json;
use tracing_subscriber::{EnvFilter, fmt::MakeWriter};

use crate::{
    Outcome, StudioError,
    cli::{Cli, Command},
    outcome::{Answer, document},
    progress::Progress,
    session::{Globals, Session},
};

/// More threads than any machine that this runs on has processors.
const MAX_THREADS: usize = 1024;

/// Parses the command line, does what it says, and prints the answer.
pub fn run(words: impl IntoIterator<Item = OsString>) -> Outcome {
    let words: Vec<OsString> = words.into_iter().collect();
    let cli = match Cli::try_parse_from(&words) {
        Ok(cli) => cli,
        Err(error) => return not_understood(&error, words.iter().any(|w| w == "--json")),
    };
    heed_file_limits();
    let session = Session { progress: Arc::new(Progress::new(cli.globals.quiet)), globals: cli.globals };
    start_log(&session);
    let mut answer = start_threads(session.globals.threads).and_then(|()| cli.command.run(&session));
    session.progress.finish();
    if let Ok(answer) = &mut answer {
        answer.warnings.extend(session.progress.take_remarks());
    }
    print(cli.command.name(), &answer, &session.globals);
    Outcome::of(&answer)
}

/// A limit on the size of files ends the program unless the signal is caught: then writing fails, as on a full disk.
fn heed_file_limits() {
    // Where it cannot be caught, the system's own way stays.
    drop(flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false))));
}

impl Command {
    fn run(&self, session: &Session) -> Result<Answer, StudioError> {
        match self {
            Self::Import(c) => c.run(session),
            Self::Capture(c) => c.run(session),
            Self::Calibrate(c) => c.run(session),
            Self::Inspect(c) => c.run(session),
            Self::Reorder(c) => c.run(session),
            Self::Fuse(c) => c.run(session),
            Self::Fit(c) => c.run(session),
            Self::Measure(c) => c.run(session),
            Self::Extract(c) => c.run(session),
            Self::Edit(c) => c.run(session),
            Self::Export(c) => c.run(session),
            Self::Animate(c) => c.run(session),
            Self::Sculpt(c) => c.run(session),
            Self::Shape(c) => c.run(session),
            Self::Wear(c) => c.run(session),
            Self::Process(c) => c.run(session),
            Self::Batch(c) => c.run(session),
            Self::Catalog(c) => c.run(session),
            Self::Archive(c) => c.run(session),
            Self::Demo(c) => c.run(session),
            Self::Settings(c) => c.run(session),
            Self::Synthesize(c) => c.run(session),
            Self::Devices(c) => c.run(session),
            Self::Serve(c) => c.run(session),
            Self::Completions(c) => Ok(c.run(Cli::command())),
        }
    }

    fn name(&self) -> &'static str {
        match self {
            Self::Import(_) => "import",
            Self::Capture(_) => "capture",
            Self::Calibrate(_) => "calibrate",
            Self::Inspect(_) => "inspect",
            Self::Reorder(_) => "reorder",
            Self::Fuse(_) => "fuse",
            Self::Fit(_) => "fit",
            Self::Measure(_) => "measure",
            Self::Extract(_) => "extract",
            Self::Edit(_) => "edit",
            Self::Export(_) => "export",
            Self::Animate(_) => "animate",
            Self::Sculpt(_) => "sculpt",
            Self::Shape(_) => "shape",
            Self::Wear(_) => "wear",
            Self::Process(_) => "process",
            Self::Batch(_) => "batch",
            Self::Catalog(_) => "catalog",
            Self::Archive(_) => "archive",
            Self::Demo(_) => "demo",
            Self::Settings(_) => "settings",
            Self::Synthesize(_) => "synthesize",
            Self::Devices(_) => "devices",
            Self::Serve(_) => "serve",
            Self::Completions(_) => "completions",
        }
    }
}

/// Help and version are answers; everything else that clap refuses is a wrong command line.
fn not_understood(error: &clap::Error, json: bool) -> Outcome {
    if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) {
        drop(error.print());
        return Outcome::Done;
    }
    if json {
        let text = error.to_string();
        let message = text.trim().trim_start_matches("error: ").to_string();
        say(&document("", &Err(StudioError::Usage(message))));
    } else {
        drop(error.print());
    }
    Outcome::Usage
}

fn start_threads(threads: usize) -> Result<(), StudioError> {
    if threads > MAX_THREADS {
        return Err(StudioError::Usage(format!("--threads {threads} is more than {MAX_THREADS}")));
    }
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build_global()
        .map_err(|e| StudioError::Usage(format!("--threads {threads}: {e}")))
}

fn start_log(session: &Session) {
    let level = match (session.globals.quiet, session.globals.verbose) {
        (true, _) => "error",
        (_, 0) => "warn",
        (_, 1) => "info",
        (_, 2) => "debug",
        _ => "trace",
    };
    let filter = EnvFilter::try_from_env("TOILE_LOG").unwrap_or_else(|_| EnvFilter::new(level));
    let log = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(BesideTheBar(session.progress.clone()))
        .with_target(false)
        .with_ansi(io::stderr().is_terminal())
        .without_time();
    // A second run in the same process (tests) keeps the first one's log.
    drop(log.try_init());
}

fn print(command: &str, answer: &Result<Answer, StudioError>, globals: &Globals) {
    if globals.json {
        // After lines of events comes one line more.
        return if command == "batch" { say_line(&document(command, answer)) } else { say(&document(command, answer)) };
    }
    match answer {
        // Names of files and sensors come from outside: nothing in them may steer the terminal.
        Err(error) => eprintln!("error: {}", printable_lines(&error.to_string())),
        Ok(answer) => {
            let text = answer.text.trim_end();
            if !text.is_empty() {
                drop(writeln!(io::stdout(), "{}", printable_lines(text)));
            }
            if !globals.quiet {
                answer.warnings.iter().for_each(|w| eprintln!("warning: {}", printable(w)));
            }
            answer.lost.iter().for_each(|l| eprintln!("lost: {}", printable(l)));
            answer.failures.iter().for_each(|f| eprintln!("failed: {}", printable(f)));
        }
    }
}

fn say(document: &serde_json::Value) {
    let bytes = json::pretty(document).unwrap_or_default();
    // A reader that went away is not a failure of ours.
    drop(io::stdout().write_all(&bytes));
}

/// A document on one line of standard output.
pub(crate) fn say_line(document: &serde_json::Value) {
    let mut out = io::stdout().lock();
    drop(writeln!(out, "{document}").and_then(|()| out.flush()));
}

/// Log lines that do not tear the progress bar.
struct BesideTheBar(Arc<Progress>);

struct Line(Arc<Progress>);

impl<'a> MakeWriter<'a> for BesideTheBar {
    type Writer = Line;

    fn make_writer(&'a self) -> Line {
        Line(self.0.clone())
    }
}

impl Write for Line {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.say(String::from_utf8_lossy(bytes).trim_end());
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
