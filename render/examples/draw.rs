//! Draws PLY meshes from four sides: `draw OUT.png MESH.ply... [--clay | --attribute NAME LOW HIGH]`.

use std::path::Path;

use toile_geometry::{Mesh, ply};
use toile_render::{Drawn, Paint, View, picture, png, sheet};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    let paint = take_paint(&mut arguments)?;
    let (out, files) =
        arguments.split_first().ok_or("usage: draw OUT.png MESH.ply... [--clay | --attribute NAME LOW HIGH]")?;
    let meshes: Vec<Mesh> = files.iter().map(|f| ply::read(Path::new(f))).collect::<Result<_, _>>()?;
    let drawn: Vec<Drawn> = meshes.iter().map(|mesh| Drawn { mesh, paint: paint.clone(), opacity: 1.0 }).collect();
    let mut tiles = Vec::new();
    for (name, degrees) in [("front", 0.0), ("left", 90.0), ("back", 180.0), ("right", 270.0)] {
        let view = View::around(f64::to_radians(degrees), 0.05);
        tiles.push((name.to_string(), picture(&drawn, &view, 420, 560)?));
    }
    let mut image = sheet::contact_sheet(&tiles, 4)?;
    if let Paint::Attribute(name, range) = &paint {
        image = sheet::scale_bar(&image, *range, name);
    }
    Ok(std::fs::write(out, png::encode(&image)?)?)
}

fn take_paint(arguments: &mut Vec<String>) -> Result<Paint, Box<dyn std::error::Error>> {
    let Some(at) = arguments.iter().position(|a| a.starts_with("--")) else { return Ok(Paint::Vertices) };
    let flags: Vec<String> = arguments.drain(at..).collect();
    match flags.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["--clay"] => Ok(Paint::Clay),
        ["--attribute", name, low, high] => Ok(Paint::Attribute(name.into(), (low.parse()?, high.parse()?))),
        _ => Err("the last argument is --clay or --attribute NAME LOW HIGH".into()),
    }
}
