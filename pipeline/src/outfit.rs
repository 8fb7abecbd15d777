//! All garments of a subject in their order: those of its takes, and what was put on from elsewhere among them.

use toile_garments::ExtractionReport;

use crate::{
    Folders, PipelineError, Record, Run,
    garment::Garment,
    record,
    step::Step,
    steps::cut::Cut,
    worn::{Place, WornGarment, listed},
};

/// The garments that the last run stacked.
///
/// # Errors
/// [`PipelineError`] where a record cannot be read.
pub fn stacked(run: &Run) -> Result<Vec<Garment>, PipelineError> {
    let mut out = Vec::new();
    for number in run.first_garment()..run.layers.len() {
        let folder = run.folders.layer(&run.layers[number]);
        let cut: Option<Record<ExtractionReport>> = record::read(&folder, Cut::NAME)?;
        if let Some(cut) = cut.filter(|_| run.folders.garment(&run.layers[number]).is_file()) {
            out.push(Garment::new(run, number, &cut.result)?);
        }
    }
    with_worn(run, out)
}

/// The garments of all takes with those that were put on from elsewhere among them; alone where the run ends before the last take.
///
/// # Errors
/// [`PipelineError`] where one of those cannot be read, or its place is not there.
pub fn with_worn(run: &Run, takes: Vec<Garment>) -> Result<Vec<Garment>, PipelineError> {
    if run.is_whole() { among(takes, &listed(&run.folders)?, &run.folders) } else { Ok(takes) }
}

/// The layers of the takes with what is `worn` among them, inside to outside.
///
/// # Errors
/// [`PipelineError`] where something is worn over or under a layer that is not there.
fn among(takes: Vec<Garment>, worn: &[WornGarment], folders: &Folders) -> Result<Vec<Garment>, PipelineError> {
    let mut layers = takes;
    for garment in worn {
        let at = |name: &String| {
            let names = || layers.iter().map(|l| l.name.clone()).collect::<Vec<_>>().join(", ");
            let found = layers.iter().position(|l| l.name == *name || l.layer == *name);
            found.ok_or_else(|| {
                let reason = format!("there is no layer `{name}`; there are: {}", names());
                PipelineError::field(&folders.worn_json(&garment.label), "place", reason)
            })
        };
        let place = match &garment.file.place {
            Place::Outermost => layers.len(),
            Place::Over(name) => at(name)? + 1,
            Place::Under(name) => at(name)?,
        };
        if layers.iter().any(|l| l.name == garment.label) {
            let folder = folders.worn(&garment.label);
            return Err(PipelineError::refused(&folder, "a take has the same name now; rename this folder"));
        }
        layers.insert(place, garment.layer());
    }
    Ok(layers)
}

#[cfg(test)]
mod tests {
    use std::{collections::BTreeMap, path::Path};

    use toile_character::Pose;
    use toile_garments::GarmentType;

    use super::*;
    use crate::worn::WornFile;

    fn worn(label: &str, place: Place) -> WornGarment {
        let file = WornFile {
            version: 1,
            source: "alder/03-jacket".into(),
            garment: String::new(),
            garment_type: GarmentType::Jacket,
            thickness_mm: None,
            place,
            rest_joints: BTreeMap::new(),
            pose: Pose::identity(),
        };
        WornGarment { label: label.into(), file }
    }

    #[test]
    fn what_is_worn_stands_where_it_was_said_and_nowhere_else() {
        let folders = Folders::new(Path::new("/anna"));
        let takes = || vec![worn("01-skirt", Place::Outermost).layer(), worn("02-blouse", Place::Outermost).layer()];
        let order = |worn: &[WornGarment]| {
            Ok::<_, PipelineError>(among(takes(), worn, &folders)?.into_iter().map(|l| l.name).collect::<Vec<_>>())
        };
        let some = [
            worn("03-coat", Place::Outermost),
            worn("04-vest", Place::Under("02-blouse".into())),
            worn("05-cape", Place::Over("01-skirt".into())),
        ];
        assert_eq!(order(&some).unwrap(), ["01-skirt", "05-cape", "04-vest", "02-blouse", "03-coat"]);
        let lost = order(&[worn("03-coat", Place::Over("02-shirt".into()))]).unwrap_err().to_string();
        assert!(lost.contains("worn.json") && lost.contains("02-shirt") && lost.contains("02-blouse"), "{lost}");
        assert!(order(&[worn("02-blouse", Place::Outermost)]).unwrap_err().to_string().contains("rename"));
    }
}
