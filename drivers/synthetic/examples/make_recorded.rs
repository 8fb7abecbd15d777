//! Makes the session shipped in `recorded/`: `make_recorded FOLDER [TRUTH_FOLDER]`.

use std::path::Path;

use toile_synthetic::{GarmentKind, GarmentSettings, Pattern, Sex, Subject, SyntheticSettings, record::record_subject};

/// The person and the garments of the shipped session.
fn rowan() -> SyntheticSettings {
    let garment = |kind, pattern| GarmentSettings { kind, pattern };
    SyntheticSettings {
        name: "rowan".into(),
        seed: 33,
        sex: Sex::Female,
        variety: 0.45,
        garments: vec![
            garment(GarmentKind::Trousers, Pattern::Denim([44, 62, 112])),
            garment(GarmentKind::Tshirt, Pattern::Stripes([232, 196, 92], [46, 110, 108], 0.09)),
        ],
        frames: 72,
        degrees: 365.0,
        ..SyntheticSettings::default()
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().ok_or("usage: make_recorded FOLDER [TRUTH_FOLDER]")?;
    let truth = arguments.next();
    record_subject(&Subject::new(&rowan())?, Path::new(&folder), truth.as_ref().map(Path::new), &|_| ())?;
    Ok(())
}
