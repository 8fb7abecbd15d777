//! Which way up a scan of a person is, before anybody knows who it is.

use nalgebra::UnitQuaternion;
use toile_character::BodyModel;
use toile_geometry::{Mesh, bvh::Bvh};

use super::{
    choose::best_start,
    guides::Guides,
    placement::Extent,
    prepare::{Prepared, prepare},
    resolution::Resolutions,
    starts::starts,
};
use crate::{FitSettings, FittingError, HandLandmarks, surface::trust_of};

/// The rotation about the origin that stands a scan upright (+Y up).
///
/// `scan`: one standing person, dressed or not, metres, any axis up. Of the rotations that stand a long side of it upright,
/// either way round, the one by which a coarse fit of the body model agrees best; the scan as it lies counts first. A person
/// who lies, or a scan whose sides are not along axes, is not recognised.
///
/// # Errors
/// [`FittingError`] where the mesh cannot be a person.
pub fn find_upright(
    model: &BodyModel,
    scan: &Mesh,
    settings: &FitSettings,
) -> Result<UnitQuaternion<f64>, FittingError> {
    let Prepared { mesh, ups, .. } = prepare(scan)?;
    let trust = trust_of(&mesh);
    let by_hand = HandLandmarks::default();
    let guides = Guides::new(model, &by_hand);
    let resolutions = Resolutions::new(settings);
    let starts = starts(model, (&mesh, &trust), &ups, Extent::Whole, &guides, settings.headings, resolutions.coarse)?;
    let bvh = Bvh::new(&mesh.positions, &mesh.triangles);
    Ok(best_start(model, (&mesh, &trust, &bvh), &guides, settings, (starts, Extent::Whole), &resolutions)?.up)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Vector3};

    use super::*;

    #[test]
    fn a_person_is_stood_upright_from_all_six_sides() {
        let model = BodyModel::load_default().unwrap();
        let person = Mesh::new(model.mean.clone(), model.triangles.clone());
        for axis in 0..3 {
            for sign in [1.0, -1.0] {
                let side = Vector3::ith(axis, sign);
                let lie = UnitQuaternion::rotation_between(&Vector3::y(), &side)
                    .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI));
                let lying = Mesh {
                    positions: person.positions.iter().map(|p| (lie * p.cast::<f64>()).cast()).collect(),
                    ..person.clone()
                };
                let found = find_upright(&model, &lying, &FitSettings::default()).unwrap();
                assert!((found * side - Vector3::y()).norm() < 1e-9, "{side}");
            }
        }
        assert!(find_upright(&model, &Mesh::new(vec![Point3::origin(); 3], vec![]), &FitSettings::default()).is_err());
    }
}
