//! Pictures of a synthetic subject: `look OUT_DIR [SETTINGS.json]` draws every take from four sides, and frames.

use std::path::Path;

use toile_render::{Drawn, RgbImage, View, colormap::viridis, picture, png, sheet};
use toile_synthetic::{Subject, SyntheticSettings, Take};

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
        let frames = sheet::contact_sheet(&frames(&take)?, 3)?;
        std::fs::write(Path::new(&out).join(format!("{}-frames.png", take.name)), png::encode(&frames)?)?;
    }
    Ok(())
}

/// Colour and depth of three frames.
fn frames(take: &Take) -> Result<Vec<(String, RgbImage)>, Box<dyn std::error::Error>> {
    let (mut colors, mut depths) = (Vec::new(), Vec::new());
    for share in [0.0, 0.15, 0.5] {
        let frame = take.frame((take.moments.len() as f32 * share) as usize)?;
        if let Some(color) = &frame.color {
            let image = color.decode(frame.index)?;
            let bytes = image.pixels.iter().flatten().copied().collect();
            let image = RgbImage::from_raw(image.width, image.height, bytes).ok_or("no pixels")?;
            colors.push((format!("color {}", frame.index), image));
        }
        if let Some(depth) = &frame.depth {
            let color = |&d: &u16| if d == 0 { [0; 3] } else { viridis(f32::from(d), (1700.0, 2700.0)) };
            let bytes = depth.values.iter().flat_map(color).collect();
            let image = RgbImage::from_raw(depth.width, depth.height, bytes).ok_or("no pixels")?;
            depths.push((format!("depth {}", frame.index), image));
        }
    }
    colors.extend(depths);
    Ok(colors)
}
