//! Pictures of a synthetic subject: `look OUT_DIR [SETTINGS.json]` draws every take from four sides, and frames.

use std::path::Path;

use toile_render::{Drawn, View, picture, png, sheet};
use toile_synthetic::{Subject, SyntheticSettings};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let out = arguments.next().ok_or("usage: look OUT_DIR [SETTINGS.json]")?;
    let settings: SyntheticSettings = match arguments.next() {
        Some(file) => serde_json::from_slice(&std::fs::read(file)?)?,
        None => SyntheticSettings::default(),
    };
    std::fs::create_dir_all(&out)?;
    let subject = Subject::new(&settings)?;
    for n in 0..subject.take_count() {
        let take = subject.take(n)?;
        let mut tiles = Vec::new();
        for degrees in [0.0, 45.0, 90.0, 180.0] {
            for drawn in [Drawn::colored(&take.surface.mesh), Drawn::clay(&take.surface.mesh)] {
                let image = picture(&[drawn], &View::around(f64::to_radians(degrees), 0.05), 360, 520)?;
                tiles.push((format!("{} {degrees}", take.name), image));
            }
        }
        let sheet = sheet::contact_sheet(&tiles, 4)?;
        std::fs::write(Path::new(&out).join(format!("{}.png", take.name)), png::encode(&sheet)?)?;
    }
    Ok(())
}
