//! The seed's own way (Hu et al. 2017, §6.2 and eq. 7) beside the default one.

use toile_character::Pose;
use toile_garments::{
    DressedTake, ExtractSettings, GarmentError, GarmentType, Labelling, Reason, StackMethod, StackSettings, extract,
    stack,
};

use crate::{column::*, stacking::crossing_layers};

fn seed_settings() -> ExtractSettings {
    ExtractSettings { labelling: Labelling::NearestBodyVertex, ..ExtractSettings::default() }
}

#[test]
fn labels_are_those_of_the_template_at_the_nearest_body_vertex() {
    let (person, pose, before, scan) = (person(), Pose::identity(), bare(), dressed(0.01, BLUE));
    let take = DressedTake { garment_type: Some(GarmentType::Top), ..take(&person, &scan, &before, &pose) };
    let found = extract(&take, &seed_settings(), &|_| ()).unwrap();
    assert!(found.labels.reasons.iter().all(|r| *r == Reason::Template));
    // A top covers pelvis and torso: all below the head, which starts at 0.8, whatever the scan shows.
    for (p, &is_garment) in scan.positions.iter().zip(&found.labels.garment) {
        assert!((p.y - 0.8).abs() < 0.01 || is_garment == (p.y < 0.8), "{p}");
    }
    // The rough border is not where the cloth ends, and the default way finds that.
    let by_evidence = extracted(&take).labels.garment;
    assert!(iou(&scan, &found.labels.garment) < 0.7 && iou(&scan, &by_evidence) > 0.97);
}

#[test]
fn a_type_without_a_template_is_refused_by_name() {
    let (person, pose, before, scan) = (person(), Pose::identity(), bare(), dressed(0.01, BLUE));
    let refused = extract(&take(&person, &scan, &before, &pose), &seed_settings(), &|_| ()).unwrap_err();
    assert_eq!(refused, GarmentError::NoTemplate(GarmentType::Other));
    assert!(refused.to_string().contains("type other"), "{refused}");
}

#[test]
fn pushing_along_normals_parts_most_but_not_all() {
    let run = |method: StackMethod| {
        let (body, mut layers) = crossing_layers();
        let settings = StackSettings { method, ..StackSettings::default() };
        stack(&body, &mut layers, &[0.001; 2], &settings, &|_| ()).unwrap().layers
    };
    let (seed, default) = (run(StackMethod::PushAlongNormal), run(StackMethod::Regions));
    let crossing = |layers: &[toile_garments::LayerReport]| layers.iter().map(|l| l.crossing_pairs).sum::<usize>();
    assert!(seed.iter().all(|l| l.moved_max_m > 0.001 && l.cut_triangles == 0), "{seed:?}");
    assert!(crossing(&seed) > 0 && !seed.iter().all(|l| l.settled), "{seed:?}");
    assert_eq!(crossing(&default), 0);
}
