//! The bodies among which a shape is searched, and how their measures follow the coefficients.

use nalgebra::DMatrix;
use rayon::prelude::*;
use toile_character::{BodyModel, SkinnedMesh};

use super::names::Row;
use crate::{BodyMeasure, FittingError, MeasureTable, measure_table};

/// A step of a coefficient over which a slope is taken, standard deviations: tapes find their levels in steps of 2 mm, and half a deviation
/// moves most measures by several.
const STEP: f64 = 0.5;

/// A family of bodies: one of them, and what each coefficient changes.
pub(super) struct Shapes<'a> {
    model: &'a BodyModel,
    /// The body whose coefficients are `origin`.
    base: SkinnedMesh,
    origin: Vec<f64>,
    /// Where the search begins: the most likely coefficients without any measure.
    pub start: Vec<f64>,
}

/// A body's measures and how they follow the coefficients.
pub(super) struct Around {
    /// The measures.
    pub table: MeasureTable,
    /// Metres for a standard deviation: a row a measure of the table, a column a coefficient.
    slopes: DMatrix<f64>,
}

/// Means and slopes of measures over the model's population, to first order, as logarithms of metres.
pub(super) struct Population {
    pub log_mean: Vec<f64>,
    pub log_slopes: DMatrix<f64>,
}

impl<'a> Shapes<'a> {
    /// The model's bodies, around the mean man or the mean woman.
    pub fn of_sex(model: &'a BodyModel, is_woman: bool) -> Self {
        let mean = if is_woman { &model.population.beta_female } else { &model.population.beta_male };
        let mut start = vec![0.0; model.component_count()];
        start.iter_mut().zip(mean).for_each(|(to, from)| *to = f64::from(*from));
        Self { model, base: model.skinned(&[]), origin: vec![0.0; start.len()], start }
    }

    /// A person's own body and what the model's coefficients change of it.
    ///
    /// # Errors
    /// [`FittingError::Mesh`] where it is not of the model's topology.
    pub fn of_person(model: &'a BodyModel, body: &SkinnedMesh, beta: &[f64]) -> Result<Self, FittingError> {
        let (have, want) = (body.mesh.positions.len(), model.vertex_count());
        if have != want {
            return Err(FittingError::Mesh(format!("it has {have} vertices, but the template has {want}")));
        }
        let mut origin = beta.to_vec();
        origin.resize(model.component_count(), 0.0);
        Ok(Self { model, base: body.clone(), start: origin.clone(), origin })
    }

    /// The body with coefficients `beta`.
    pub fn body(&self, beta: &[f64]) -> SkinnedMesh {
        let mut body = self.base.clone();
        let change: Vec<f64> = beta.iter().zip(&self.origin).map(|(b, o)| b - o).collect();
        for (column, &c) in self.model.components.iter().zip(&change).filter(|(_, c)| **c != 0.0) {
            body.mesh.positions.iter_mut().zip(column).for_each(|(p, d)| *p += d * c as f32);
        }
        for (column, &c) in self.model.joint_components.iter().zip(&change) {
            body.skeleton.rest.iter_mut().zip(column).for_each(|(joint, d)| *joint += d * c);
        }
        body.mesh.recompute_normals();
        body
    }

    /// All measures of the body with coefficients `beta`.
    ///
    /// # Errors
    /// As [`measure_table`].
    pub fn measured(&self, beta: &[f64]) -> Result<MeasureTable, FittingError> {
        measure_table(self.model, &self.body(beta))
    }

    /// The start's measures and how they follow the coefficients.
    ///
    /// # Errors
    /// As [`measure_table`].
    pub fn around_start(&self) -> Result<Around, FittingError> {
        self.around(&self.start, self.measured(&self.start)?)
    }

    /// How measures follow the coefficients around `beta`, where they are those of `table`.
    ///
    /// # Errors
    /// As [`measure_table`].
    pub fn around(&self, beta: &[f64], table: MeasureTable) -> Result<Around, FittingError> {
        let moved = |c: usize| -> Result<Vec<f64>, FittingError> {
            let mut beta = beta.to_vec();
            beta[c] += STEP;
            let there = self.measured(&beta)?;
            let slope = |m: &BodyMeasure| there.value(&m.name).map_or(0.0, |value| (value - m.value_m) / STEP);
            Ok(table.measures.iter().map(slope).collect())
        };
        let columns: Result<Vec<Vec<f64>>, FittingError> = (0..beta.len()).into_par_iter().map(moved).collect();
        let columns = columns?;
        let slopes = DMatrix::from_fn(table.measures.len(), beta.len(), |r, c| columns[c][r]);
        Ok(Around { table, slopes })
    }
}

impl Around {
    /// Metres for a standard deviation: a row for each of `rows`.
    pub fn slopes(&self, rows: &[Row]) -> DMatrix<f64> {
        let place = |row: &Row| self.table.measures.iter().position(|m| m.name == row.name);
        let places: Vec<Option<usize>> = rows.iter().map(place).collect();
        let slope = |r: usize, c: usize| places[r].map_or(0.0, |place| self.slopes[(place, c)]);
        DMatrix::from_fn(rows.len(), self.slopes.ncols(), slope)
    }

    /// `rows` over the model's whole population, where this is around the coefficients `beta`.
    pub fn population(&self, rows: &[Row], beta: &[f64]) -> Population {
        let value = |r: usize| rows[r].of(&self.table);
        let mut log_slopes = self.slopes(rows);
        log_slopes.row_iter_mut().enumerate().for_each(|(r, mut row)| row /= value(r));
        // from here back to the mean of all people
        let back = |r: usize| -> f64 { log_slopes.row(r).iter().zip(beta).map(|(slope, b)| slope * b).sum() };
        let log_mean = (0..rows.len()).map(|r| value(r).ln() - back(r)).collect();
        Population { log_mean, log_slopes }
    }
}
