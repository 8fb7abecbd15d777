//! A batch on a Ray cluster: the same tasks, handed to the bridge in `batch/` (a Python package).

use std::{
    io::{BufRead, BufReader, Write},
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::Duration,
};

use rustix::process::{Pid, Signal, kill_process};
use serde_json::json;
use toile_pipeline::Options;

use super::{
    event::{Ended, Event},
    ledger::{Ledger, Totals},
    outlook::Outlook,
    task::memory_of,
    worker::Program,
};
use crate::ArchiveError;

/// Where the cluster is, and how to reach it.
#[derive(Debug, Clone)]
pub struct Ray {
    /// A Python with the package `toile-batch`.
    pub python: PathBuf,
    /// Its address, or `auto`; without, one is started on this machine.
    pub address: Option<String>,
    /// How long to wait for a subject that another program writes.
    pub patience: Duration,
}

/// Processes what is due in `outlook` on a Ray cluster, as [`run`](super::run) does here. Ray decides what runs where, by the processors
/// and the memory that each subject needs.
///
/// # Errors
/// [`ArchiveError`] where the bridge cannot be started, or it ended before all subjects had.
pub fn run_on_ray(
    archive: &Path,
    outlook: &Outlook,
    program: &Program,
    options: &Options,
    ray: &Ray,
    stop: &Arc<AtomicBool>,
    hear: &mut dyn FnMut(&Event),
) -> Result<Totals, ArchiveError> {
    let mut ledger = Ledger::new(archive, outlook, options, hear);
    if outlook.due().next().is_none() {
        return Ok(ledger.close());
    }
    let mut bridge = start(archive, program, ray)?;
    let asked = ask(&mut bridge, outlook);
    let pid = Pid::from_child(&bridge);
    let (ended, watched) = (Arc::new(AtomicBool::new(false)), stop.clone());
    let over = ended.clone();
    let watch = thread::spawn(move || {
        while !over.load(Ordering::Relaxed) {
            if watched.load(Ordering::Relaxed) {
                // Ray ends its workers with it, and they their processes.
                let _ = kill_process(pid, Signal::TERM);
                return;
            }
            thread::sleep(Duration::from_millis(200));
        }
    });
    let heard = asked.and_then(|()| listen(&mut bridge, outlook, &mut ledger));
    ended.store(true, Ordering::Relaxed);
    drop(watch.join());
    let status = bridge.wait().map_err(|error| ArchiveError::io(&ray.python, error))?;
    heard?;
    ledger.totals.stopped = stop.load(Ordering::Relaxed);
    if !status.success() && !ledger.totals.stopped {
        let reason = format!(
            "the bridge to Ray ended with {status}; is the package there (pip install batch/), and the cluster?"
        );
        return Err(ArchiveError::refused(&ray.python, reason));
    }
    Ok(ledger.close())
}

fn start(archive: &Path, program: &Program, ray: &Ray) -> Result<Child, ArchiveError> {
    let absolute = |path: &Path| std::path::absolute(path).map_err(|error| ArchiveError::io(path, error));
    let mut command = Command::new(&ray.python);
    command.args(["-m", "toile_batch"]).arg(absolute(archive)?).arg("--program").arg(absolute(&program.path)?);
    command.args(["--threads", &program.threads.to_string(), "--patience", &ray.patience.as_secs().to_string()]);
    command.args(ray.address.iter().flat_map(|address| ["--address", address]));
    if let Some(file) = &program.settings {
        command.arg("--settings").arg(absolute(file)?);
    }
    command.stdin(Stdio::piped()).stdout(Stdio::piped());
    command.spawn().map_err(|error| ArchiveError::io(&ray.python, error))
}

/// Hands the bridge every subject that is due.
fn ask(bridge: &mut Child, outlook: &Outlook) -> Result<(), ArchiveError> {
    let seen = outlook.prospects.iter().filter_map(|p| p.plan.as_ref()?.peak_memory_bytes).max();
    // Dropped at the end, which closes it.
    let Some(mut to) = bridge.stdin.take() else { return Ok(()) };
    for (subject, plan) in outlook.due() {
        let line = json!({ "subject": subject, "memory": memory_of(plan.peak_memory_bytes, seen) });
        writeln!(to, "{line}").map_err(|error| ArchiveError::io(Path::new("toile_batch"), error))?;
    }
    Ok(())
}

/// Takes in how each subject ended.
fn listen(bridge: &mut Child, outlook: &Outlook, ledger: &mut Ledger) -> Result<(), ArchiveError> {
    let Some(from) = bridge.stdout.take() else { return Ok(()) };
    let expected: std::collections::BTreeMap<&Path, f64> =
        outlook.due().map(|(name, plan)| (name, plan.seconds)).collect();
    for line in BufReader::new(from).lines() {
        let line = line.map_err(|error| ArchiveError::io(Path::new("toile_batch"), error))?;
        // What else Python prints is not for us.
        let Ok(ended) = serde_json::from_str::<Ended>(&line) else { continue };
        ledger.totals.cpu_seconds += ended.cpu_seconds;
        let seconds = expected.get(ended.subject.as_path()).copied().unwrap_or(0.0);
        ledger.end(seconds, ended)?;
    }
    Ok(())
}
