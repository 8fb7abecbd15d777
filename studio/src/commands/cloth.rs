//! `--generic` and `--part`: what garments are made of, and what gives way.

use clap::ValueEnum;

/// Generic garments on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum GenericChoice {
    /// A generic garment in its shape stands for each that was cut out of a take
    On,
    /// Garments as they were cut
    Off,
}

/// What gives way, on the command line.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum PartChoice {
    /// The cloth is moved outwards
    Cloth,
    /// The body is moved inwards first
    Body,
}

// Options that `extract` and `process` share; a doc comment here would become the help of both.
#[derive(Debug, Clone, Copy, clap::Args)]
pub struct ClothOptions {
    /// Generic garments, the same vertices and triangles for every subject, take on the shapes of those that were cut (kept in
    /// edits/avatar.json)
    #[arg(long, value_enum, num_args = 0..=1, require_equals = true, default_missing_value = "on")]
    generic: Option<GenericChoice>,
    /// What gives way where a garment is too tight for the body (kept in edits/avatar.json)
    #[arg(long, value_enum)]
    part: Option<PartChoice>,
}

impl ClothOptions {
    /// Whether generic garments were asked for, where anything was said.
    pub fn generic(self) -> Option<bool> {
        self.generic.map(|choice| choice == GenericChoice::On)
    }

    /// What is to give way, where anything was said.
    pub fn part(self) -> Option<toile_garments::Part> {
        self.part.map(|choice| match choice {
            PartChoice::Cloth => toile_garments::Part::Cloth,
            PartChoice::Body => toile_garments::Part::Body,
        })
    }
}
