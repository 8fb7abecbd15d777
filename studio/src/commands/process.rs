//! `toile process`: everything from recorded takes to avatar and report.

use std::{
    any::Any,
    panic::{AssertUnwindSafe, catch_unwind},
    path::{Path, PathBuf},
    time::Instant,
};

use rustix::process::{Pid, Signal, getpid, getppid, kill_process, set_parent_process_death_signal};
use serde_json::{Value, json};
use toile_capture::printable_path;
use toile_pipeline::{FusionChoice, Goal, Options, Summary, process as process_subject};

use crate::{
    StudioError,
    commands::{
        cloth::ClothOptions, prior::PriorChoice, reach::motion_choice, springs::SpringsChoice,
        texture_size::TextureSize,
    },
    outcome::{Answer, error_document},
    session::Session,
};

const AFTER: &str = "\
What is up to date is not done again; a run that was interrupted goes on where it was.
A subject that fails does not stop the others.

Examples:
  toile process anna
  toile process archive/* --motion dance.bvh
  toile process ben --dressed
  toile process anna --json | jq .results";

/// Everything from recorded takes to avatar and report: runs whatever is missing
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER)]
pub struct Process {
    /// Subject folders
    #[arg(required = true, value_name = "SUBJECT")]
    subjects: Vec<PathBuf>,
    /// Motion for the avatar (BVH, or GLB or VRMA with an animation), or `walk` for the one that ships with Toile (without: as the avatar was made last)
    #[arg(long, value_name = "FILE")]
    motion: Option<PathBuf>,
    /// turntable (usual): the person turns evenly before a resting camera; none: a camera held by hand
    #[arg(long, value_enum)]
    prior: Option<PriorChoice>,
    /// Largest edge of the scans' textures (usually 4096, smaller where the pictures show less)
    #[arg(long, value_enum, value_name = "SIZE")]
    texture: Option<TextureSize>,
    /// The first take shows the person dressed: the body is estimated under the clothes, which become a layer (kept in edits/body.json)
    #[arg(long)]
    dressed: bool,
    /// Whether skirts, dresses and coats swing by spring bones in avatar.vrm (without: as the avatar was made last; on the first time)
    #[arg(long, value_enum)]
    springs: Option<SpringsChoice>,
    #[command(flatten)]
    cloth: ClothOptions,
    /// Settings of the stages; they win over those of SUBJECT/toile.toml
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// End when the process that started this one ends, however it does (a batch gives its own number)
    #[arg(long, hide = true, value_name = "PROCESS")]
    with_parent: Option<i32>,
}

impl Process {
    /// Runs the command.
    ///
    /// # Errors
    /// [`StudioError`] where the motion cannot be read; a subject that fails is named in the answer.
    pub fn run(&self, session: &Session) -> Result<Answer, StudioError> {
        if let Some(parent) = self.with_parent {
            end_with(parent);
        }
        let options = Options {
            motion: motion_choice(self.motion.as_deref()),
            fusion: FusionChoice { prior: self.prior.map(Into::into), ..FusionChoice::default() },
            settings: self.settings.clone(),
            dressed: self.dressed,
            springs: self.springs.map(Into::into),
            texture: self.texture.map(Into::into),
            generic: self.cloth.generic(),
            part: self.cloth.part(),
            ..Options::default()
        };
        process(&self.subjects, &options, session)
    }
}

/// Has the system end this process when its parent does, so that nobody works on for a batch that is gone.
fn end_with(parent: i32) {
    // Where the system cannot, the process ends when its subject is done.
    let _ = set_parent_process_death_signal(Some(Signal::KILL));
    if Pid::as_raw(getppid()) != parent {
        // It ended before it could be watched.
        let _ = kill_process(getpid(), Signal::KILL);
    }
}

/// Processes subjects one after the other, past failed ones, and lists all of them in a table.
///
/// # Errors
/// [`StudioError`] where the options are wrong for every subject.
pub fn process(subjects: &[PathBuf], options: &Options, session: &Session) -> Result<Answer, StudioError> {
    options.check()?;
    let mut answer = Answer::default();
    let (mut rows, mut results) = (Vec::new(), Vec::new());
    for subject in subjects {
        let started = Instant::now();
        let done = guarded(subject, || {
            process_subject(subject, Goal::Report, options, session.progress.as_ref()).map_err(StudioError::from)
        });
        let seconds = started.elapsed().as_secs_f64();
        let name = printable_path(subject);
        match done {
            Ok(summary) => {
                rows.push(row(&name, &summary, seconds));
                results.push(result(&name, &summary, seconds));
                collect(&mut answer, subjects.len(), &name, summary);
            }
            Err(error) => {
                rows.push([name.clone(), "failed".into(), "-".into(), "-".into(), format!("{seconds:.1}")]);
                let error_told = error_document(&error);
                results.push(json!({ "subject": name, "outcome": "failed", "error": error_told, "seconds": seconds }));
                answer.failures.push(prefixed(subjects.len(), &name, &error.to_string()));
            }
        }
    }
    answer.text = table(&["subject", "result", "layers", "warnings", "seconds"], &rows);
    if let [only] = subjects
        && answer.failures.is_empty()
    {
        let at = |file: &str| printable_path(&only.join(file));
        answer.text.push_str(&format!("\nlook at {} and {}\n", at("report.html"), at("avatar.glb")));
    }
    answer.results = Value::Array(results);
    Ok(answer)
}

/// Runs `work`; a panic, which would be our own mistake, fails this subject alone.
fn guarded<T>(subject: &Path, work: impl FnOnce() -> Result<T, StudioError>) -> Result<T, StudioError> {
    let said = |panic: Box<dyn Any + Send>| {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        text.or(panic.downcast_ref::<&str>().copied()).unwrap_or("unknown").to_string()
    };
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| {
        let reason = format!("a mistake inside Toile ({}); please report it", said(panic));
        Err(StudioError::refused(subject, reason))
    })
}

fn collect(answer: &mut Answer, subjects: usize, name: &str, summary: Summary) {
    let all = |sentences: Vec<String>| sentences.into_iter().map(|s| prefixed(subjects, name, &s)).collect::<Vec<_>>();
    answer.warnings.extend(all(summary.remarks.warnings));
    answer.warnings.extend(all(summary.notes));
    answer.lost.extend(all(summary.remarks.lost));
    answer.failures.extend(all(summary.remarks.failures));
}

fn prefixed(subjects: usize, name: &str, sentence: &str) -> String {
    if subjects > 1 { format!("{name}: {sentence}") } else { sentence.to_string() }
}

fn outcome(summary: &Summary) -> &'static str {
    match (summary.remarks.failures.is_empty(), summary.remarks.lost.is_empty()) {
        (false, _) => "failed",
        (true, false) => "lost",
        (true, true) => "done",
    }
}

fn row(name: &str, summary: &Summary, seconds: f64) -> [String; 5] {
    let result = match outcome(summary) {
        "failed" => "failed in part",
        "lost" => "done, data lost",
        done => done,
    };
    let count = |n: usize| n.to_string();
    [
        name.into(),
        result.into(),
        count(summary.layers.len()),
        count(summary.remarks.warnings.len()),
        format!("{seconds:.1}"),
    ]
}

fn result(name: &str, summary: &Summary, seconds: f64) -> Value {
    json!({
        "subject": name,
        "outcome": outcome(summary),
        "layers": summary.layers,
        "measurements": summary.measurements,
        "files": summary.files.iter().map(|f| printable_path(f)).collect::<Vec<_>>(),
        "warnings": summary.remarks.warnings,
        "lost": summary.remarks.lost,
        "failures": summary.remarks.failures,
        "seconds": seconds,
    })
}

/// Columns as wide as they need to be; the first two left, the others right.
pub fn table<const N: usize>(head: &[&str; N], rows: &[[String; N]]) -> String {
    let lines: Vec<[String; N]> = std::iter::once(head.map(String::from)).chain(rows.iter().cloned()).collect();
    let width = |k: usize| lines.iter().map(|l| l[k].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..N).map(width).collect();
    let mut text = String::new();
    for line in &lines {
        let cells = line.iter().enumerate().map(|(k, cell)| match k {
            0 | 1 => format!("{cell:<w$}", w = widths[k]),
            _ => format!("{cell:>w$}", w = widths[k]),
        });
        text.push_str(cells.collect::<Vec<_>>().join("  ").trim_end());
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_fails_one_subject() {
        let error = guarded::<()>(Path::new("anna"), || panic!("index {}", 7)).unwrap_err();
        assert!(error.to_string().starts_with("anna: ") && error.to_string().contains("index 7"));
    }

    #[test]
    fn columns_line_up() {
        let rows = [["a".to_string(), "done".into(), "12".into()], ["longer".into(), "x".into(), "3".into()]];
        let text = table(&["who", "what", "n"], &rows);
        assert_eq!(text, "who     what   n\na       done  12\nlonger  x      3\n");
    }
}
