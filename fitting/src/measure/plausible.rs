//! Whether measurements go together as they do among people.
//!
//! Each girth is predicted from all others by the log-normal distribution of ANSUR II (6,068 soldiers, `ansur2.json`, made by
//! `character/generator`), and doubted where it is too far away. A wrong value spoils the predictions of its neighbours, so the
//! least likely one is taken out first, and the rest judged without it.

use nalgebra::{DMatrix, DVector};
use serde::Deserialize;

use crate::measure::{definition::MeasureKind, taken::BodyMeasure};

/// Farthest from its prediction that a value is believed, standard deviations. Of the 6,068 soldiers three have one value
/// beyond 5, and none has one beyond 6.
const BELIEVED: f64 = 6.0;
/// The range that is told with a doubt, standard deviations: 95 of 100 people lie in it.
const USUAL: f64 = 2.0;
/// Fewest measurements from which one is predicted.
const FEWEST: usize = 4;

/// A column of ANSUR II and the measurements that stand for it.
struct Row {
    column: &'static str,
    names: &'static [&'static str],
    /// How much our definition gives less or more than ANSUR's, as a difference of logarithms: means of the model's mean man
    /// and mean woman, who have ANSUR's stature, chest, waist and hip.
    by_definition: f64,
}

const fn row(column: &'static str, names: &'static [&'static str], by_definition: f64) -> Row {
    Row { column, names, by_definition }
}

const ROWS: [Row; 18] = [
    row("stature", &["stature"], 0.001),
    row("cervicaleheight", &["back neck height"], -0.012),
    row("waistheightomphalion", &["waist height"], 0.037),
    row("crotchheight", &["crotch height (inside leg length)"], -0.012),
    row("kneeheightmidpatella", &["knee height"], -0.003),
    row("chestcircumference", &["bust girth", "chest girth"], 0.007),
    row("waistcircumference", &["waist girth"], -0.027),
    row("buttockcircumference", &["hip girth"], -0.000),
    row("thighcircumference", &["left thigh girth", "right thigh girth"], 0.002),
    row("calfcircumference", &["left calf girth", "right calf girth"], 0.055),
    row("anklecircumference", &["left ankle girth", "right ankle girth"], 0.027),
    row("neckcircumference", &["neck girth"], 0.021),
    row("headcircumference", &["head girth"], -0.035),
    row("bicepscircumferenceflexed", &["left upper arm girth", "right upper arm girth"], 0.035),
    row("forearmcircumferenceflexed", &["left forearm girth", "right forearm girth"], -0.011),
    row("wristcircumference", &["left wrist girth", "right wrist girth"], -0.003),
    row("footlength", &["left foot length", "right foot length"], -0.066),
    row("handlength", &["left hand length", "right hand length"], 0.031),
];

/// Moments of ANSUR II, of logarithms of metres.
#[derive(Deserialize)]
struct Moments {
    measures: Vec<String>,
    log_mean: Vec<f64>,
    log_covariance: Vec<Vec<f64>>,
}

impl Moments {
    /// The committed moments; `None` if they were not what they should be, which a test excludes.
    fn shipped() -> Option<Self> {
        let moments: Self = serde_json::from_str(include_str!("ansur2.json")).ok()?;
        let fits = moments.measures.iter().map(String::as_str).eq(ROWS.iter().map(|r| r.column));
        (fits && moments.log_covariance.len() == ROWS.len()).then_some(moments)
    }
}

/// What the others say of one value, in logarithms.
struct Prediction {
    mean: f64,
    deviation: f64,
}

impl Prediction {
    /// How far `log_value` is from it, standard deviations.
    fn distance(&self, log_value: f64) -> f64 {
        (log_value - self.mean).abs() / self.deviation
    }
}

/// Puts a doubt on each girth that does not go with the others. Lengths and heights serve to predict girths.
pub(crate) fn doubt(measures: &mut [BodyMeasure]) {
    let Some(moments) = Moments::shipped() else { return };
    let person = Person::new(&moments, measures);
    let mut believed: Vec<usize> = (0..ROWS.len()).filter(|&r| person.rows[r].is_some()).collect();
    while believed.len() > FEWEST {
        let distances =
            believed.iter().filter_map(|&r| Some((r, person.predicted(r, &believed)?.distance(person.rows[r]?))));
        let Some((worst, distance)) = distances.reduce(|a, b| if b.1 > a.1 { b } else { a }) else { return };
        if distance <= BELIEVED {
            break;
        }
        believed.retain(|&r| r != worst);
    }
    for (r, row) in ROWS.iter().enumerate() {
        let Some(prediction) = person.predicted(r, &believed) else { continue };
        for measure in
            measures.iter_mut().filter(|m| m.kind == MeasureKind::Girth && row.names.contains(&m.name.as_str()))
        {
            if prediction.distance(measure.value_m.ln() - row.by_definition) > BELIEVED {
                measure.doubt = Some(sentence(measure, row, &prediction));
            }
        }
    }
}

fn sentence(measure: &BodyMeasure, row: &Row, prediction: &Prediction) -> String {
    let cm = |deviations: f64| 100.0 * (prediction.mean + row.by_definition + deviations * prediction.deviation).exp();
    let (low, high) = (cm(-USUAL), cm(USUAL));
    format!(
        "{} of {:.1} cm does not go with the other measurements: people who share those have {low:.0} to {high:.0} cm; look \
         at its tape in the report",
        measure.name,
        100.0 * measure.value_m
    )
}

/// One person's values beside the moments.
struct Person<'a> {
    moments: &'a Moments,
    /// By row, the logarithm of the value (mean of both sides) by ANSUR's definition.
    rows: Vec<Option<f64>>,
}

impl<'a> Person<'a> {
    fn new(moments: &'a Moments, measures: &[BodyMeasure]) -> Self {
        let value = |row: &Row| {
            let named = |name: &&str| measures.iter().find(|m| m.name == **name && m.value_m > 0.0);
            let logs: Vec<f64> = row.names.iter().filter_map(named).map(|m| m.value_m.ln()).collect();
            (!logs.is_empty()).then(|| logs.iter().sum::<f64>() / logs.len() as f64 - row.by_definition)
        };
        Self { moments, rows: ROWS.iter().map(value).collect() }
    }

    /// Row `r` as the other `believed` rows predict it: the conditional normal distribution.
    fn predicted(&self, r: usize, believed: &[usize]) -> Option<Prediction> {
        let others: Vec<usize> = believed.iter().copied().filter(|&b| b != r).collect();
        let covariance = |a: usize, b: usize| self.moments.log_covariance[a][b];
        let among = DMatrix::from_fn(others.len(), others.len(), |a, b| covariance(others[a], others[b]));
        let with = DVector::from_fn(others.len(), |a, _| covariance(others[a], r));
        let weights = among.cholesky()?.solve(&with);
        let off = |k: usize| self.rows[others[k]].map_or(0.0, |value| value - self.moments.log_mean[others[k]]);
        let mean = self.moments.log_mean[r] + (0..others.len()).map(|k| weights[k] * off(k)).sum::<f64>();
        let variance = covariance(r, r) - weights.dot(&with);
        (variance > 0.0).then(|| Prediction { mean, deviation: variance.sqrt() })
    }
}

#[cfg(test)]
mod tests {
    use toile_character::BodyModel;

    use super::*;
    use crate::measure_table;

    fn measures(beta: &[f32]) -> Vec<BodyMeasure> {
        let model = BodyModel::load_default().unwrap();
        let beta: Vec<f64> = beta.iter().map(|&b| f64::from(b)).collect();
        measure_table(&model, &model.skinned(&beta)).unwrap().measures
    }

    fn doubted(measures: &mut [BodyMeasure]) -> Vec<String> {
        doubt(measures);
        measures.iter().filter(|m| m.doubt.is_some()).map(|m| m.name.clone()).collect()
    }

    #[test]
    fn definitions_differ_as_the_models_mean_people_have_it() {
        let model = BodyModel::load_default().unwrap();
        let moments = Moments::shipped().expect("the committed moments");
        let people = [&model.population.beta_male, &model.population.beta_female].map(|beta| measures(beta));
        for (r, row) in ROWS.iter().enumerate() {
            let values = people.iter().map(|of| {
                let named: Vec<f64> =
                    of.iter().filter(|m| row.names.contains(&m.name.as_str())).map(|m| m.value_m).collect();
                named[0].ln()
            });
            let off = values.sum::<f64>() / 2.0 - moments.log_mean[r];
            assert!((off - row.by_definition).abs() < 0.005, "{}: {off}", row.column);
        }
    }

    #[test]
    fn a_girth_that_takes_an_arm_in_is_doubted_and_its_neighbours_are_not() {
        let model = BodyModel::load_default().unwrap();
        for beta in [&model.population.beta_male, &model.population.beta_female] {
            let mut measures = measures(beta);
            assert_eq!(doubted(&mut measures), Vec::<String>::new());
            let chest = measures.iter_mut().find(|m| m.name == "chest girth").unwrap();
            chest.value_m *= 1.28;
            assert_eq!(doubted(&mut measures), ["chest girth"]);
            let calf = measures.iter_mut().find(|m| m.name == "left calf girth").unwrap();
            calf.value_m *= 1.5;
            assert_eq!(doubted(&mut measures), ["chest girth", "left calf girth"]);
        }
    }
}
