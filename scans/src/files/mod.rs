//! Mesh files of other programs, each as a [`Surface`].

mod gltf;
mod obj;
mod ply;
mod stl;
mod textures;

use std::path::Path;

use toile_geometry::{GeometryError, file::read_limited};

pub use gltf::decode_glb;
pub use obj::decode_obj;
pub use ply::decode_ply;
pub use stl::decode_stl;

use crate::Surface;

/// The largest mesh file that is read, bytes.
const MAX_BYTES: u64 = 2 << 30;

/// A format of mesh files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Stanford's polygon format.
    Ply,
    /// Wavefront's OBJ, with materials in MTL files.
    Obj,
    /// glTF 2.0 as one binary file.
    Glb,
    /// glTF 2.0 as JSON with files beside it.
    Gltf,
    /// Stereolithography, binary or text.
    Stl,
}

impl Kind {
    /// All formats.
    pub const ALL: [Self; 5] = [Self::Ply, Self::Obj, Self::Glb, Self::Gltf, Self::Stl];

    /// The extension of its files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ply => "ply",
            Self::Obj => "obj",
            Self::Glb => "glb",
            Self::Gltf => "gltf",
            Self::Stl => "stl",
        }
    }
}

/// The format of a file by its extension; `None` where it is not one of a mesh that can be read.
pub fn kind_of(path: &Path) -> Option<Kind> {
    let extension = extension(path)?;
    // A VRM file is a GLB file.
    let extension = if extension == "vrm" { "glb" } else { extension.as_str() };
    Kind::ALL.into_iter().find(|kind| kind.name() == extension)
}

/// What to do with a mesh file of a format that cannot be read, a sentence; `None` for any other file.
pub fn unreadable(path: &Path) -> Option<String> {
    let extension = extension(path)?;
    let name = match extension.as_str() {
        "fbx" => "FBX",
        "usd" | "usda" | "usdc" | "usdz" => "USD",
        "dae" => "COLLADA",
        "3mf" => "3MF",
        "wrl" | "vrml" | "x3d" => "VRML or X3D",
        "blend" => "a Blender project",
        "abc" => "Alembic",
        "xyz" | "pcd" | "las" | "laz" | "e57" => "a point cloud",
        _ => return None,
    };
    let cloud = if name == "a point cloud" { "make a surface of it (Poisson reconstruction) and " } else { "" };
    Some(format!("is {name}, which is not read; {cloud}export it as GLB or OBJ with its textures"))
}

fn extension(path: &Path) -> Option<String> {
    Some(path.extension()?.to_str()?.to_ascii_lowercase())
}

/// Reads a mesh file and the pictures that it refers to.
///
/// # Errors
/// [`GeometryError::Io`] where it cannot be read, [`GeometryError::Format`] where it is no mesh, with the reason. A picture
/// that is missing is no error, but a notice.
pub fn read(path: &Path) -> Result<Surface, GeometryError> {
    let wrong = |reason: String| GeometryError::format(path, reason);
    let kind = kind_of(path).ok_or_else(|| {
        let names = Kind::ALL.map(Kind::name).join(", ");
        wrong(unreadable(path).unwrap_or_else(|| format!("is not a mesh file that is read; these are: {names}")))
    })?;
    let bytes = read_limited(path, MAX_BYTES)?;
    let beside = Beside::new(path);
    let surface = match kind {
        Kind::Ply => ply::decode(&bytes, &beside),
        Kind::Obj => obj::decode(&bytes, &beside),
        Kind::Glb => gltf::decode_binary(&bytes, &beside),
        Kind::Gltf => gltf::decode_text(&bytes, &beside),
        Kind::Stl => decode_stl(&bytes),
    };
    surface.and_then(|surface| surface.validate().map(|()| surface)).map_err(wrong)
}

/// The files beside a mesh file that it refers to and that are there: their names relative to its folder, in the order in
/// which they are met, without repeats. References out of the folder are left out.
///
/// # Errors
/// As [`read`].
pub fn others(path: &Path) -> Result<Vec<String>, GeometryError> {
    let Some(kind) = kind_of(path).filter(|kind| matches!(kind, Kind::Obj | Kind::Ply | Kind::Gltf | Kind::Glb)) else {
        return Ok(Vec::new());
    };
    let bytes = read_limited(path, MAX_BYTES)?;
    let beside = Beside::new(path);
    let named = match kind {
        Kind::Obj => obj::named_files(&bytes, &beside),
        Kind::Ply => ply::named_files(&bytes),
        _ => gltf::named_files(&bytes).map_err(|reason| GeometryError::format(path, reason))?,
    };
    let mut found = Vec::new();
    for name in named.iter().filter_map(|name| beside.existing(name)) {
        if !found.contains(&name) {
            found.push(name);
        }
    }
    Ok(found)
}

/// The folder of a mesh file, from which the files that it names are read.
pub(crate) struct Beside<'a> {
    folder: Option<&'a Path>,
}

impl<'a> Beside<'a> {
    fn new(path: &'a Path) -> Self {
        Self { folder: path.parent() }
    }

    /// Bytes without a folder: nothing is found.
    fn nothing() -> Self {
        Self { folder: None }
    }

    /// The name of a file that a mesh file names, relative to its folder, where it is there: with the path as given, or
    /// alone (files that were moved keep the paths of another machine).
    fn existing(&self, name: &str) -> Option<String> {
        let folder = self.folder?;
        let name = name.trim().trim_matches('"').replace('\\', "/");
        let inside = |name: &str| {
            let safe = Path::new(name).components().all(|c| matches!(c, std::path::Component::Normal(_)));
            (safe && !name.is_empty() && folder.join(name).is_file()).then(|| name.to_string())
        };
        let relative = name.trim_start_matches("./");
        inside(relative).or_else(|| inside(relative.rsplit('/').next()?))
    }

    /// The bytes of a file of that name, at most `most`.
    fn read(&self, name: &str, most: u64) -> Result<Vec<u8>, String> {
        let (Some(folder), Some(found)) = (self.folder, self.existing(name)) else {
            return Err(format!("the file `{}` that it names is not beside it", printable(name)));
        };
        read_limited(&folder.join(found), most).map_err(|error| error.to_string())
    }
}

/// At most 100 characters of a name from a file, control characters left out.
pub(crate) fn printable(name: &str) -> String {
    name.chars().filter(|c| !c.is_control()).take(100).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_out_of_the_folder_are_never_read() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("scan");
        std::fs::create_dir_all(folder.join("tex")).unwrap();
        std::fs::write(dir.path().join("secret.png"), "x").unwrap();
        std::fs::write(folder.join("tex/a.png"), "x").unwrap();
        std::fs::write(folder.join("b c.png"), "x").unwrap();
        let path = folder.join("body.obj");
        let beside = Beside::new(&path);
        for name in ["../secret.png", "/etc/passwd", "", ".", "tex", "none.png"] {
            assert_eq!(beside.existing(name), None, "{name}");
        }
        assert_eq!(beside.existing("./tex/a.png").as_deref(), Some("tex/a.png"));
        assert_eq!(beside.existing("C:\\Users\\me\\b c.png").as_deref(), Some("b c.png"));
        assert!(beside.read("none.png", 10).unwrap_err().contains("none.png"));
    }

    #[test]
    fn what_is_not_read_is_answered_with_what_to_do() {
        assert_eq!(kind_of(Path::new("a/Body.OBJ")), Some(Kind::Obj));
        assert_eq!(kind_of(Path::new("a/body.vrm")), Some(Kind::Glb));
        for (name, word) in [("a.fbx", "GLB or OBJ"), ("a.usdz", "USD"), ("a.e57", "Poisson")] {
            assert!(unreadable(Path::new(name)).unwrap().contains(word), "{name}");
            assert!(read(Path::new(name)).unwrap_err().to_string().contains(word), "{name}");
        }
        assert_eq!(unreadable(Path::new("take.mcap")), None);
    }
}
