//! A body by its measures, without a scan: the shape that has them and is most like people (Thalmann et al.'s sizes typed in, here
//! on the statistical body and with the tapes of ISO 8559-1).
//!
//! - `names`: which measures may be given, by the names of the measure table;
//! - `shapes`: the bodies among which is searched, and their measures;
//! - `likely`: whether anybody has such measures;
//! - `solve`: Levenberg–Marquardt on the coefficients, measures and the shape prior together;
//! - `conflict`: which two measures cannot be had together.

mod conflict;
mod likely;
mod names;
mod shapes;
mod solve;

use toile_character::{BodyModel, SkinnedMesh};

pub use self::{
    conflict::Conflict,
    names::{ALIASES, Wanted},
};
use self::{
    names::Row,
    shapes::{Around, Shapes},
};
use crate::{FittingError, MeasureTable};

/// Whom the body shall be like, where measures leave it open.
#[derive(Debug, Clone, Copy)]
pub enum Start<'a> {
    /// The mean man.
    Man,
    /// The mean woman.
    Woman,
    /// A person: the own surface stays as it is beyond what measures ask for, and the bones stay where only girths are asked for.
    Person {
        /// The body at rest, template topology.
        body: &'a SkinnedMesh,
        /// Its coefficients, standard deviations.
        beta: &'a [f64],
    },
}

/// A measure that was asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Reached {
    /// Its name in the measure table.
    pub name: String,
    /// What was asked for, metres.
    pub wanted_m: f64,
    /// What the body has, metres.
    pub reached_m: f64,
    /// How far the two may differ (ISO 20685-1), metres.
    pub allowed_m: f64,
}

impl Reached {
    /// Whether the body has it, within what the standard allows.
    pub fn is_met(&self) -> bool {
        (self.reached_m - self.wanted_m).abs() <= self.allowed_m
    }
}

/// A body by measures.
#[derive(Debug, Clone)]
pub struct Shaped {
    /// Its coefficients, standard deviations.
    pub beta: Vec<f64>,
    /// At rest in the A-pose.
    pub body: SkinnedMesh,
    /// All its measures.
    pub table: MeasureTable,
    /// What was asked for.
    pub reached: Vec<Reached>,
    /// The two measures that cannot be had together, where one was not met.
    pub conflict: Option<Conflict>,
    /// How far the shape is from where it began: the length of the coefficients' change, standard deviations.
    pub distance: f64,
    /// True where it began at the mean woman, false at the mean man; `None` with a person.
    pub is_woman: Option<bool>,
    /// Steps taken.
    pub iterations: usize,
}

/// Bodies by measures, one after the other: what is the same for all of them is found once.
pub struct ShapeSearch<'a> {
    shapes: Shapes<'a>,
    around: Around,
    is_woman: Option<bool>,
}

impl<'a> ShapeSearch<'a> {
    /// Measures the body of `start`, and how each coefficient of `model` changes its measures.
    ///
    /// # Errors
    /// [`FittingError::Mesh`] where a person's body is not of the model's topology.
    pub fn new(model: &'a BodyModel, start: Start) -> Result<Self, FittingError> {
        let (shapes, is_woman) = match start {
            Start::Man => (Shapes::of_sex(model, false), Some(false)),
            Start::Woman => (Shapes::of_sex(model, true), Some(true)),
            Start::Person { body, beta } => (Shapes::of_person(model, body, beta)?, None),
        };
        let around = shapes.around_start()?;
        Ok(Self { shapes, around, is_woman })
    }

    /// The body that has the measures `wanted` and is otherwise as the start, or as people with such measures are.
    ///
    /// Measures are taken as [`crate::measure_table`] takes them. Without any the body is that of the start.
    ///
    /// # Errors
    /// [`FittingError::Measure`] where a measure has no such name, is given twice, or nobody has it, alone or beside another one.
    /// Measures that people might have, but that the model cannot have together, are no error: [`Shaped::conflict`] names them.
    pub fn shape(&self, wanted: &[Wanted]) -> Result<Shaped, FittingError> {
        let asked = names::rows(wanted, &self.around.table)?;
        likely::check(&asked, &self.around.population(&asked, &self.shapes.start))?;
        let held = if self.is_woman.is_none() { names::held(&asked, &self.around.table) } else { Vec::new() };
        let rows: Vec<Row> = asked.iter().cloned().chain(held).collect();
        let solved = solve::solve(&self.shapes, &rows, &self.around)?;
        let reached: Vec<Reached> = asked
            .iter()
            .map(|row| Reached {
                name: row.name.clone(),
                wanted_m: row.wanted,
                reached_m: row.of(&solved.table),
                allowed_m: row.allowed(),
            })
            .collect();
        let conflict = conflict::find(&reached, &solved.slopes);
        let body = self.shapes.body(&solved.beta);
        let change = solved.beta.iter().zip(&self.shapes.start).map(|(a, b)| (a - b).powi(2));
        let distance = change.sum::<f64>().sqrt();
        let (beta, table, iterations) = (solved.beta, solved.table, solved.iterations);
        Ok(Shaped { beta, body, table, reached, conflict, distance, is_woman: self.is_woman, iterations })
    }
}

/// Of the bodies that two searches find, the one with the more common shape.
///
/// # Errors
/// As [`ShapeSearch::shape`], where neither has an answer.
pub fn shape_either(searches: [&ShapeSearch; 2], wanted: &[Wanted]) -> Result<Shaped, FittingError> {
    match searches.map(|search| search.shape(wanted)) {
        [Ok(a), Ok(b)] => Ok(if cost(&a) <= cost(&b) { a } else { b }),
        [Ok(one), Err(_)] | [Err(_), Ok(one)] => Ok(one),
        [Err(error), Err(_)] => Err(error),
    }
}

/// How much a body is worse than another: misses count in half allowances, shapes in standard deviations.
fn cost(shaped: &Shaped) -> f64 {
    let misses = shaped.reached.iter().map(|r| ((r.reached_m - r.wanted_m) / (0.5 * r.allowed_m)).powi(2));
    shaped.distance.powi(2) + misses.sum::<f64>()
}
