//! `toile batch`: a whole archive.

use toile_archive::{
    batch::Outlook,
    compare::{self, compare, keep},
};
use toile_capture::printable_path;
use toile_pipeline::json::plain;

pub use super::batch_options::Batch;
use super::{
    batch_remote, batch_report,
    batch_work::{Work, limits},
    reach::must_exist,
};
use crate::{StudioError, outcome::Answer, session::Session};

impl Batch {
    /// Runs the command.
    ///
    /// # Errors
    /// [`StudioError`] where the archive cannot be read or written; a subject that fails is named in the answer.
    pub fn run(&self, session: &Session) -> Result<Answer, StudioError> {
        if batch_remote::is_url(&self.archive) {
            return batch_remote::run(self, session);
        }
        must_exist(&self.archive)?;
        let outlook = Outlook::new(&self.archive, &self.options(), &self.choice())?;
        if self.dry_run {
            return batch_report::outlook(&outlook, &limits(self, &outlook, session.globals.threads).0);
        }
        if let Some(old) = &self.keep {
            outlook.due().try_for_each(|(subject, _)| keep(&self.archive.join(subject), &old.join(subject)))?;
        }
        let mut work = Work::begin(self, session, outlook.due().count(), outlook.seconds())?;
        let totals = work.run(&self.archive, &outlook, &mut |_| {})?;
        let mut answer = batch_report::totals(&outlook, &totals)?;
        answer.warnings.extend(work.unnoted.first().map(ToString::to_string));
        if let Some(old) = &self.compare {
            let changes = compare(&self.archive, old)?;
            let page = compare::write(&changes, &self.archive, old, &self.archive.join(".toile/compare"))?;
            let same = changes.iter().filter(|change| change.is_none()).count();
            let (all, page) = (changes.len(), printable_path(&page));
            answer.text.push_str(&format!("{all} subjects compared, {same} of them the same: look at {page}\n"));
            answer.results["compared"] = plain(&changes)?;
        }
        Ok(answer)
    }
}
