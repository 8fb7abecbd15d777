//! `toile reorder`: the takes of a subject in the order in which garments are put on.

use std::path::PathBuf;

use serde_json::json;
use toile_capture::{
    CaptureError, LockedSubject, Subject,
    subject::{Layer, NewName, Reordered},
};
use toile_character::GarmentType;

use crate::{StudioError, commands::reach::must_exist, outcome::Answer, session::Session};

const AFTER: &str = "\
Take 0 has to be the body, and each later take has to show one garment more. A session in which garments were taken off
one by one is brought in as it was recorded, each take called by the outermost garment that is worn in it and the last one
`body`, and then reversed. Takes and edits by hand are renamed, never changed.

--names says what the layers are called in their new order, from the body outward. A name that a layer has already brings
its type and other facts with it, so that takes can also be exchanged below names that stay where they are.

Examples:
  toile reorder anna --reverse
  toile reorder anna --order body,trousers,shirt
  toile reorder anna --reverse --names body,trousers,shirt    # the takes were called the wrong way round";

/// Put the takes in the order in which garments are put on: reversed, in any order, under other names
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER)]
pub struct Reorder {
    /// The subject
    subject: PathBuf,
    /// The last take becomes the first: garments were taken off instead of put on
    #[arg(long, required_unless_present_any = ["order", "names"])]
    reverse: bool,
    /// The takes in their new order, each by the name of its layer now
    #[arg(long, value_name = "LAYERS", value_delimiter = ',', conflicts_with = "reverse")]
    order: Option<Vec<String>>,
    /// What the layers are called in the new order, from the body outward
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    names: Option<Vec<String>>,
}

impl Reorder {
    /// Runs the command.
    ///
    /// # Errors
    /// [`StudioError`] where the order or a name cannot be used (nothing is changed then), or a file cannot be renamed.
    pub fn run(&self, _: &Session) -> Result<Answer, StudioError> {
        must_exist(&self.subject)?;
        let mut subject = LockedSubject::open(&self.subject)?;
        let order = self.order(&subject)?;
        let new_name = |name: &String| {
            let garment = GarmentType::from_layer_name(name).map(|garment| garment.name().to_string());
            NewName { name: name.clone(), garment }
        };
        let names: Option<Vec<NewName>> = self.names.as_ref().map(|names| names.iter().map(new_name).collect());
        let Reordered { takes, remarks } = subject.reorder(&order, names.as_deref())?;
        let text = takes.iter().map(|(was, is)| format!("{is}  was {was}\n")).collect();
        let results = takes.iter().map(|(was, is)| json!({ "was": was, "is": is })).collect();
        let warnings = remarks.into_iter().chain(subject.remarks()).collect();
        Ok(Answer { text, results, warnings, ..Answer::default() })
    }

    /// The old number of each take in the new order.
    fn order(&self, subject: &Subject) -> Result<Vec<usize>, StudioError> {
        let count = subject.layers().len();
        let Some(order) = &self.order else {
            return Ok(if self.reverse { (0..count).rev().collect() } else { (0..count).collect() });
        };
        let number = |name: &String| {
            let names: Vec<String> = subject.layers().iter().map(Layer::label).collect();
            let missing = format!("--order: there is no layer `{name}`; there are: {}", names.join(", "));
            Ok(subject.layer(name).ok_or_else(|| CaptureError::format(&self.subject, missing))?.number)
        };
        order.iter().map(number).collect()
    }
}
