//! Where the meshes of a scene stand.

use nalgebra::{Matrix4, Quaternion, Translation3, UnitQuaternion, Vector3};

use super::json::{Node, Root};

/// A mesh where it stands.
pub(super) struct Placed {
    pub mesh: usize,
    /// The scene's frame from the mesh's.
    pub transform: Matrix4<f64>,
    /// The joints in the scene's frame and the index of the skin, where the mesh has one: then `transform` does not count.
    pub skin: Option<(usize, Vec<Matrix4<f64>>)>,
}

/// All meshes of the scene, in the order of its nodes. Where there is no scene, of all nodes.
///
/// # Errors
/// A sentence where nodes name what is not there or contain themselves.
pub(super) fn placed_meshes(root: &Root) -> Result<Vec<Placed>, String> {
    let globals = globals(root)?;
    let in_scene = in_scene(root);
    let mut placed = Vec::new();
    for (n, node) in root.nodes.iter().enumerate().filter(|(n, _)| in_scene[*n]) {
        let Some(mesh) = node.mesh else { continue };
        let skin = node.skin.map(|index| -> Result<_, String> {
            let skin =
                root.skins.get(index).ok_or_else(|| format!("node {n} names the skin {index}, which is missing"))?;
            let joint = |&j: &usize| {
                globals.get(j).copied().ok_or_else(|| format!("skin {index} names a joint that is missing"))
            };
            Ok((index, skin.joints.iter().map(joint).collect::<Result<Vec<_>, String>>()?))
        });
        placed.push(Placed { mesh, transform: globals[n], skin: skin.transpose()? });
    }
    Ok(placed)
}

/// The transform of every node into the scene's frame.
fn globals(root: &Root) -> Result<Vec<Matrix4<f64>>, String> {
    let mut parent = vec![None; root.nodes.len()];
    for (n, node) in root.nodes.iter().enumerate() {
        for &child in &node.children {
            let slot =
                parent.get_mut(child).ok_or_else(|| format!("node {n} names the child {child}, which is missing"))?;
            if slot.replace(n).is_some() {
                return Err(format!("node {child} has two parents"));
            }
        }
    }
    let global = |n: usize| {
        let (mut matrix, mut now) = (local(&root.nodes[n]), n);
        // Longer than all nodes together, a way up is a circle.
        for _ in 0..root.nodes.len() {
            let Some(above) = parent[now] else { return Ok(matrix) };
            matrix = local(&root.nodes[above]) * matrix;
            now = above;
        }
        Err(format!("node {n} contains itself"))
    };
    (0..root.nodes.len()).map(global).collect()
}

/// Which nodes belong to the scene that is shown.
fn in_scene(root: &Root) -> Vec<bool> {
    let scene = root.scenes.get(root.scene.unwrap_or(0));
    let Some(scene) = scene else { return vec![true; root.nodes.len()] };
    let mut is_in = vec![false; root.nodes.len()];
    let mut open = scene.nodes.clone();
    while let Some(n) = open.pop() {
        if is_in.get(n) == Some(&false) {
            is_in[n] = true;
            open.extend(&root.nodes[n].children);
        }
    }
    is_in
}

fn local(node: &Node) -> Matrix4<f64> {
    if let Some(matrix) = &node.matrix {
        return Matrix4::from_column_slice(matrix);
    }
    let [x, y, z, w] = node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let rotation = UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-12).unwrap_or_default();
    Translation3::from(Vector3::from(node.translation.unwrap_or_default())).to_homogeneous()
        * rotation.to_homogeneous()
        * Matrix4::new_nonuniform_scaling(&Vector3::from(node.scale.unwrap_or([1.0; 3])))
}
