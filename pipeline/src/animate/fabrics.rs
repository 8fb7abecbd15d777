//! What garments are made of: by their type, or as a file says.

use std::{collections::BTreeMap, path::Path};

use toile_avatar::AvatarLayer;
use toile_capture::{files::read_text, printable_path};
use toile_cloth::{ClothError, Fabric, fabric::read_fabrics};
use toile_garments::GarmentType;
use toml::{Spanned, Table};

use crate::PipelineError;

/// The table of a file that says what garments are made of; the others are fabrics.
const GARMENTS: &str = "garments";

/// Fabrics, and which garment is made of which.
#[derive(Debug, Default)]
pub(super) struct Fabrics {
    /// Of the file, by name.
    own: BTreeMap<String, Fabric>,
    /// The fabric of a garment, by the garment's name, and the line that says so.
    worn: BTreeMap<String, (String, usize)>,
    file: Option<std::path::PathBuf>,
}

/// `[garments.NAME]`.
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Worn {
    fabric: Spanned<String>,
}

/// The part of the file beside the fabrics.
#[derive(serde::Deserialize)]
struct File {
    #[serde(default)]
    garments: BTreeMap<String, Worn>,
    #[serde(flatten)]
    _fabrics: Table,
}

impl Fabrics {
    /// Those of a file, or none of its own.
    ///
    /// # Errors
    /// [`PipelineError`] with file and line where it cannot be read or is wrong.
    pub fn read(path: Option<&Path>) -> Result<Self, PipelineError> {
        let Some(path) = path else { return Ok(Self::default()) };
        let text = read_text(path)?;
        let own = read_fabrics(&text, &printable_path(path), &[GARMENTS]).map_err(|e| wrong(path, &e))?;
        let line = |at: usize| 1 + text[..at.min(text.len())].matches('\n').count();
        let file: File = toml::from_str(&text).map_err(|e| {
            let at = e.span().map_or(0, |span| span.start);
            PipelineError::format(path, format!("line {}: {}", line(at), e.message().replace('\n', "; ")))
        })?;
        let place =
            |(name, worn): (String, Worn)| (name, (worn.fabric.get_ref().clone(), line(worn.fabric.span().start)));
        Ok(Self { own, worn: file.garments.into_iter().map(place).collect(), file: Some(path.to_path_buf()) })
    }

    /// The fabric of each of the `layers`: as the file says, else as its type is usually made of.
    ///
    /// # Errors
    /// [`PipelineError`] with the line where the file names a garment or a fabric that there is not.
    pub fn of(&self, layers: &[AvatarLayer]) -> Result<Vec<Fabric>, PipelineError> {
        let file = self.file.as_deref().unwrap_or(Path::new("fabrics"));
        let names: Vec<&str> = layers.iter().skip(1).map(|l| garment_name(&l.name)).collect();
        for (garment, (_, line)) in &self.worn {
            if !layers.iter().skip(1).any(|l| is_called(l, garment)) {
                let has = if names.is_empty() { "none".into() } else { names.join(", ") };
                let reason = format!("line {line}: there is no garment `{garment}`; the subject has {has}");
                return Err(PipelineError::format(file, reason));
            }
        }
        let of_layer = |layer: &AvatarLayer| match self.worn.iter().find(|(garment, _)| is_called(layer, garment)) {
            None => usual(layer.garment.as_deref()).map_err(|e| wrong(file, &e)),
            Some((_, (fabric, line))) => match self.own.get(fabric) {
                Some(own) => Ok(*own),
                None => Fabric::named(fabric).map_err(|e| PipelineError::format(file, format!("line {line}: {e}"))),
            },
        };
        layers.iter().map(of_layer).collect()
    }
}

/// `jacket` of the layer `03-jacket`.
fn garment_name(layer: &str) -> &str {
    layer.split_once('-').map_or(layer, |(_, name)| name)
}

fn is_called(layer: &AvatarLayer, garment: &str) -> bool {
    layer.name == garment || garment_name(&layer.name) == garment
}

/// The cloth that a garment of a type is usually made of.
fn usual(garment: Option<&str>) -> Result<Fabric, ClothError> {
    let kind = garment.and_then(|g| g.parse::<GarmentType>().ok());
    Fabric::named(match kind {
        Some(GarmentType::Top) => "jersey",
        Some(GarmentType::Trousers) => "denim",
        Some(GarmentType::Jacket) => "coating",
        Some(GarmentType::Shoes | GarmentType::Hat) => "leather",
        _ => "shirting",
    })
}

fn wrong(path: &Path, error: &ClothError) -> PipelineError {
    PipelineError::refused(path, error.to_string())
}

#[cfg(test)]
mod tests {
    use toile_character::SkinWeights;
    use toile_geometry::Mesh;

    use super::*;

    fn layer(name: &str, garment: Option<&str>) -> AvatarLayer {
        let (mesh, weights, garment) = (Mesh::default(), SkinWeights::default(), garment.map(str::to_string));
        AvatarLayer { name: name.into(), mesh, weights, order: 0, garment, thickness: None, texture: None }
    }

    fn of(text: &str) -> Result<Vec<Fabric>, PipelineError> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("mine.toml");
        std::fs::write(&path, text).unwrap();
        let layers = [layer("body", None), layer("01-skirt", Some("skirt")), layer("02-coat", Some("jacket"))];
        Fabrics::read(Some(&path))?.of(&layers)
    }

    #[test]
    fn garments_are_made_of_what_the_file_says_and_else_of_what_is_usual() {
        let named = |name| Fabric::named(name).unwrap();
        let text = "[felt]\nlike = \"coating\"\nbending = 9e-5\n[garments.coat]\nfabric = \"felt\"\n";
        let felt = Fabric { bending: 9e-5, ..named("coating") };
        assert_eq!(of(text).unwrap(), [named("shirting"), named("shirting"), felt]);
        let text = "[garments.01-skirt]\nfabric = \"denim\"\n";
        assert_eq!(of(text).unwrap()[1..], [named("denim"), named("coating")]);
    }

    #[test]
    fn what_is_wrong_is_named_by_line() {
        for (text, words) in [
            ("[felt]\nlike = \"coating\"\nstretch = -4.0\n", "line 3: stretch is -4; it must be a positive number"),
            ("\n[garments.hat]\nfabric = \"felt\"\n", "line 3: there is no garment `hat`; the subject has skirt, coat"),
            ("[garments.coat]\nfabric = \"felt\"\n", "line 2: fabric felt: not in the table"),
            ("[garments.coat]\ncloth = \"felt\"\n", "line 2: unknown field `cloth`"),
            ("[garments.coat]\n", "line 1: missing field `fabric`"),
        ] {
            let error = of(text).unwrap_err().to_string();
            assert!(error.contains("mine.toml") && error.contains(words), "{text}: {error}");
        }
    }
}
