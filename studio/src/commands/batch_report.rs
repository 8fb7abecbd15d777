//! What `toile batch` answers: the outlook, and how it went.

use serde_json::json;
use toile_archive::batch::{Ended, Fate, Limits, Outlook, Prospect, Totals};
use toile_capture::printable_path;
use toile_pipeline::{Standing, json::plain};

use super::process::table;
use crate::{StudioError, outcome::Answer};

/// Lines of a table for people; the rest is counted.
const LINES: usize = 40;

/// What would be done, and how long it takes.
pub(super) fn outlook(outlook: &Outlook, limits: &Limits) -> Result<Answer, StudioError> {
    let rows: Vec<[String; 4]> = outlook.prospects.iter().filter(|p| is_told(p)).map(row).collect();
    let mut text = table_of(&["subject", "standing", "about", "why"], &rows);
    let seconds = outlook.seconds();
    let (elapsed, at_once) = outlook.side_by_side(limits.workers, limits.memory.bytes);
    let guessed = outlook.due().filter(|(_, plan)| plan.guessed).count();
    text.push_str(&counts(outlook));
    text.push_str(&format!(
        "{} of work: {} with at most {} side by side ({} MiB of memory, by {}){}\n",
        duration(seconds),
        duration(elapsed),
        at_once,
        limits.memory.bytes >> 20,
        limits.memory.by,
        if guessed > 0 {
            format!("; {guessed} were never measured, and count with usual times")
        } else {
            String::new()
        },
    ));
    let results = json!({
        "subjects": plain(&outlook.prospects)?,
        "due": outlook.due().count(),
        "up_to_date": outlook.count(Standing::UpToDate),
        "seconds": seconds,
        "elapsed_seconds": elapsed,
        "most_at_once": at_once,
        "limits": { "workers": limits.workers, "memory_bytes": limits.memory.bytes, "memory_by": limits.memory.by },
    });
    Ok(Answer { text, results, failures: broken(outlook), ..Answer::default() })
}

/// How it went.
pub(super) fn totals(outlook: &Outlook, totals: &Totals) -> Result<Answer, StudioError> {
    let rows: Vec<[String; 5]> = totals.ended.iter().map(ended_row).collect();
    let mut text = table_of(&["subject", "result", "seconds", "MiB", "warnings"], &rows);
    text.push_str(&counts(outlook));
    let count = |outcome: &[Fate]| totals.ended.iter().filter(|e| outcome.contains(&e.outcome)).count();
    text.push_str(&format!(
        "{} done, {} done by another batch, {} failed, in {} ({:.1} s of processor time, at most {} side by side)\n",
        count(&[Fate::Done, Fate::Lost, Fate::FailedInPart]),
        count(&[Fate::Elsewhere]),
        count(&[Fate::Failed, Fate::Busy]),
        duration(totals.seconds),
        totals.cpu_seconds,
        totals.most_at_once,
    ));
    let mut answer = Answer { text, results: plain(totals)?, failures: broken(outlook), ..Answer::default() };
    answer.results["up_to_date"] = outlook.count(Standing::UpToDate).into();
    answer.results["left_out"] = outlook.prospects.iter().filter(|p| p.left.is_some()).count().into();
    for ended in &totals.ended {
        let named = |sentence: &String| format!("{}: {sentence}", printable_path(&ended.subject));
        answer.warnings.extend(ended.warnings.iter().map(named));
        answer.lost.extend(ended.lost.iter().map(named));
        answer.failures.extend(ended.failures.iter().map(named));
        let left = if ended.outcome == Fate::Failed && ended.attempts > 1 {
            "; it is left out until it changes (--again tries it)"
        } else {
            ""
        };
        answer.failures.extend(ended.why.iter().map(|why| format!("{}{left}", named(why))));
    }
    // The subject that met the full disk says so, with the file.
    if totals.disk_full && !answer.failures.iter().any(|failure| failure.contains("the disk is full")) {
        answer
            .failures
            .push("the disk is full: free some space and run the batch again; nothing half-written is left".into());
    }
    if totals.stopped {
        answer.failures.push("the batch was stopped; the same command goes on where it was".into());
    }
    for prospect in outlook.prospects.iter().filter(|p| !p.broken) {
        let subject = printable_path(&prospect.subject);
        let failed = prospect.left.iter().filter(|left| left.starts_with("it failed"));
        answer.warnings.extend(failed.map(|left| format!("{subject} is left out: {left}")));
    }
    Ok(answer)
}

fn is_told(prospect: &Prospect) -> bool {
    prospect.left.is_some() || prospect.plan.as_ref().is_some_and(|plan| plan.standing != Standing::UpToDate)
}

fn row(prospect: &Prospect) -> [String; 4] {
    let subject = printable_path(&prospect.subject);
    let Some(plan) = &prospect.plan else {
        return [subject, "unreadable".into(), "-".into(), prospect.left.clone().unwrap_or_default()];
    };
    let standing = match (&prospect.left, plan.standing) {
        (Some(_), _) => "left out",
        (None, Standing::Stale) => "stale",
        (None, Standing::Unsure) => "to be checked",
        (None, Standing::UpToDate) => "up to date",
        (None, Standing::Withheld) => "withheld",
    };
    let first = plan.steps.first().map_or(String::new(), |step| format!(" (from {step})"));
    let why = prospect.left.clone().unwrap_or_else(|| format!("{}{first}", plan.why.join("; ")));
    [subject, standing.into(), duration(plan.seconds), why]
}

fn ended_row(ended: &Ended) -> [String; 5] {
    [
        printable_path(&ended.subject),
        if ended.attempts > 1 {
            format!("{} (tried {} times)", ended.word(), ended.attempts)
        } else {
            ended.word().into()
        },
        format!("{:.1}", ended.seconds),
        (ended.peak_memory_bytes >> 20).to_string(),
        ended.warnings.len().to_string(),
    ]
}

fn table_of<const N: usize>(head: &[&str; N], rows: &[[String; N]]) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let mut text = table(head, &rows[..rows.len().min(LINES)]);
    if rows.len() > LINES {
        text.push_str(&format!("... and {} more (--json lists all)\n", rows.len() - LINES));
    }
    text + "\n"
}

fn counts(outlook: &Outlook) -> String {
    let count = |standing| outlook.count(standing);
    format!(
        "{} subjects: {} up to date, {} stale, {} to be checked, {} left out\n",
        outlook.prospects.len(),
        count(Standing::UpToDate),
        count(Standing::Stale),
        count(Standing::Unsure),
        outlook.prospects.iter().filter(|p| p.left.is_some()).count(),
    )
}

fn broken(outlook: &Outlook) -> Vec<String> {
    outlook.prospects.iter().filter(|p| p.broken).filter_map(|p| p.left.clone()).collect()
}

/// Seconds, minutes or hours, as people say them.
fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 100.0 => format!("{s:.0} s"),
        s if s < 6000.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}
