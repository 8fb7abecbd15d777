//! A first take that is dressed: cloth is told from bare skin, with nothing to compare it with.

use nalgebra::Point3;
use toile_character::Pose;
use toile_garments::{DressedTake, ExtractSettings, Warning, find_cloth};

use crate::column::{BLUE, RADIUS, SKIN, bare, dressed, extracted, inside, person, take};

#[test]
fn clothes_are_told_from_skin_and_a_print_of_its_colour_is_cloth() {
    let (person, pose) = (person(), Pose::identity());
    let mut scan = dressed(0.006, BLUE);
    let print = Point3::new(0.0, 0.6, RADIUS + 0.006);
    for v in 0..scan.positions.len() {
        if (scan.positions[v] - print).norm() < 0.04 {
            scan.colors[v] = SKIN;
        }
    }
    let take = DressedTake { is_first: true, ..take(&person, &scan, &person.body, &pose) };
    let is_cloth = find_cloth(&take, &ExtractSettings::default()).unwrap();
    let is_sure = |p: &&Point3<f32>| (p.y - 0.3).abs() > 0.02 && (p.y - 0.8).abs() > 0.02;
    let sure = scan.positions.iter().zip(&is_cloth).filter(|(p, _)| is_sure(p));
    let (wrong, all) =
        sure.fold((0, 0), |(wrong, all), (p, cloth)| (wrong + u32::from(*cloth != inside(p.y)), all + 1));
    assert!(100 * wrong < all, "{wrong} of {all} are labelled wrong");
    let found = extracted(&take);
    assert!(found.warnings.is_empty() && found.garment.area() > 0.3, "{:?} {}", found.warnings, found.garment.area());
}

#[test]
fn a_first_take_without_clothes_says_so() {
    let (person, pose, scan) = (person(), Pose::identity(), bare());
    let found = extracted(&DressedTake { is_first: true, ..take(&person, &scan, &person.body, &pose) });
    assert!(found.garment.is_empty() && found.warnings == [Warning::NoClothes], "{:?}", found.warnings);
}
