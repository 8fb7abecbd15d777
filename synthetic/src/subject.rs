//! A virtual subject: the person, the garments and the takes.

use toile_character::BodyModel;

use crate::{
    SyntheticError,
    garment::{self, Garment},
    person::Person,
    settings::SyntheticSettings,
};

/// A person with a wardrobe, ready to be recorded.
#[derive(Debug, Clone)]
pub struct Subject {
    /// Its settings.
    pub settings: SyntheticSettings,
    /// The person at rest.
    pub person: Person,
    /// The addition of take 1, 2, ....
    pub garments: Vec<Garment>,
}

impl Subject {
    /// Makes the subject that `settings` describe, from the body model that ships with the program.
    ///
    /// # Errors
    /// [`SyntheticError`] where a setting is out of range or a garment cannot be made.
    pub fn new(settings: &SyntheticSettings) -> Result<Self, SyntheticError> {
        settings.validate()?;
        let model = BodyModel::load_default()?;
        let person = Person::new(&model, settings)?;
        let garments = garment::make_all(&model, &person, settings)?;
        Ok(Self { settings: settings.clone(), person, garments })
    }

    /// How many takes there are: the body and one a garment.
    pub fn take_count(&self) -> usize {
        self.garments.len() + 1
    }
}
