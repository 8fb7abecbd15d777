//! One subject in a process of its own: the program itself, as `toile process`.

use std::{
    fs::{self, File},
    io::Read,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    sync::Mutex,
    time::Instant,
};

use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use wait4::Wait4;

use crate::{ArchiveError, state};

/// How much of what a process said on standard error is kept, bytes: its end.
const KEPT: u64 = 4000;

/// How a process is called.
#[derive(Debug, Clone)]
pub struct Program {
    /// The program: this one.
    pub path: PathBuf,
    /// Threads of each process.
    pub threads: usize,
    /// A file of settings for all subjects.
    pub settings: Option<PathBuf>,
}

/// How a process ended.
#[derive(Debug)]
pub(crate) struct Outcome {
    /// The exit code; `None` where a signal ended it.
    pub(crate) code: Option<i32>,
    /// The signal that ended it.
    pub(crate) signal: Option<i32>,
    /// What it answered.
    pub(crate) answer: Value,
    /// The end of what it said on standard error.
    pub(crate) said: String,
    /// From its start to its end, seconds.
    pub(crate) seconds: f64,
    /// Processor time, seconds.
    pub(crate) cpu_seconds: f64,
    /// The most resident memory that it had, bytes.
    pub(crate) peak_memory_bytes: u64,
}

/// The processes that run, so that they can be ended.
#[derive(Debug, Default)]
pub(crate) struct Running(Mutex<Vec<Pid>>);

impl Running {
    /// Asks all of them to end.
    pub(crate) fn end_all(&self) {
        for pid in &*self.list() {
            // One that has just ended by itself is no failure.
            let _ = kill_process(*pid, Signal::TERM);
        }
    }

    fn list(&self) -> std::sync::MutexGuard<'_, Vec<Pid>> {
        self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}

/// Processes one subject and waits until that has ended.
pub(crate) fn process(
    program: &Program,
    archive: &Path,
    subject: &Path,
    running: &Running,
) -> Result<Outcome, ArchiveError> {
    use std::os::unix::process::ExitStatusExt;
    let wrong = |error| ArchiveError::io(&program.path, error);
    let log = state::folder(archive).join("logs").join(format!("{}.log", state::file_name(subject)));
    let errors = create(&log)?;
    let started = Instant::now();
    let mut command = Command::new(&program.path);
    command.arg("process").arg(archive.join(subject));
    command.args(["--json", "--quiet", "--threads", &program.threads.to_string()]);
    command.args(["--with-parent", &std::process::id().to_string()]);
    command.args(program.settings.iter().flat_map(|file| [Path::new("--settings"), file.as_path()]));
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(errors);
    let mut child = command.spawn().map_err(wrong)?;
    let pid = Pid::from_child(&child);
    running.list().push(pid);
    let mut text = String::new();
    if let Some(mut out) = child.stdout.take() {
        drop(out.read_to_string(&mut text));
    }
    let used = child.wait4();
    running.list().retain(|other| *other != pid);
    let used = used.map_err(wrong)?;
    let said = end_of(&log);
    if said.is_empty() {
        drop(fs::remove_file(&log));
    }
    Ok(Outcome {
        code: used.status.code(),
        signal: used.status.signal(),
        answer: serde_json::from_str(&text).unwrap_or_default(),
        said,
        seconds: started.elapsed().as_secs_f64(),
        cpu_seconds: (used.rusage.utime + used.rusage.stime).as_secs_f64(),
        peak_memory_bytes: used.rusage.maxrss,
    })
}

impl Outcome {
    /// The kind of the error that it answered, such as `busy`.
    pub(crate) fn kind(&self) -> &str {
        self.answer["results"][0]["error"]["kind"].as_str().or(self.answer["error"]["kind"].as_str()).unwrap_or("")
    }

    /// True where there is a result: perhaps with losses, or without a garment that nobody wears.
    pub(crate) fn has_result(&self) -> bool {
        let outcome = self.answer["results"][0]["outcome"].as_str();
        matches!(self.code, Some(0 | 3))
            || (self.code == Some(1) && self.kind().is_empty() && outcome == Some("failed"))
    }

    /// What went wrong, in a clause.
    pub(crate) fn why(&self) -> String {
        if let Some(signal) = self.signal {
            let memory = self.peak_memory_bytes >> 20;
            let who = if signal == 9 { "; the system does that where memory runs out" } else { "" };
            return format!("its process was ended by signal {signal} with {memory} MiB in use{who}");
        }
        let told = self.answer["results"][0]["error"]["message"].as_str().or(self.answer["error"]["message"].as_str());
        told.map_or_else(
            || format!("its process ended with code {:?}: {}", self.code.unwrap_or(-1), self.said.trim()),
            String::from,
        )
    }
}

fn create(path: &Path) -> Result<File, ArchiveError> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).map_err(|error| ArchiveError::io(folder, error))?;
    }
    File::create(path).map_err(|error| ArchiveError::io(path, error))
}

/// The last of a file, as text.
fn end_of(path: &Path) -> String {
    use std::io::{Seek, SeekFrom};
    let mut bytes = Vec::new();
    let read = File::open(path).and_then(|mut file| {
        let length = file.metadata()?.len();
        file.seek(SeekFrom::Start(length.saturating_sub(KEPT)))?;
        file.take(KEPT).read_to_end(&mut bytes)
    });
    read.map_or_else(|_| String::new(), |_| String::from_utf8_lossy(&bytes).into_owned())
}
