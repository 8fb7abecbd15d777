//! Spring bones against the simulated cloth: garments of generated people in the shipped walk, in our own player of the format's
//! algorithm and in `@pixiv/three-vrm`.

#![allow(clippy::unwrap_used)] // all of it is test code

mod browser;
mod measure;
mod scene;

use toile_animation::springs::Swing;
use toile_synthetic::GarmentKind;

use measure::{hem, leg_outside, mean_distance};
use scene::{RATE, Scene};

/// Farthest that a leg may be outside a skirt, metres; how much farther from the simulated hem springs may be than skin alone.
const LEG: f64 = 0.020;
const FARTHER: f64 = 1.05;

/// Frames in which cloth and springs come from standing still into the walk, which are not compared: half a second.
const STARTING: usize = RATE / 2;

/// What springs do in a walk, against the cloth.
#[derive(Debug)]
struct Likeness {
    /// Mean distance of the hem from the cloth's, metres.
    hem: f64,
    /// The same of the hem on its skin alone.
    skin: f64,
    /// Farthest that a leg is outside, metres.
    leg: f64,
}

impl Scene {
    /// The likeness of a garment whose vertices in each frame of the bake are `played`.
    fn likeness(&self, played: &[Vec<nalgebra::Point3<f32>>]) -> Likeness {
        let hem = hem(&self.garment().mesh);
        let mut found = Likeness { hem: 0.0, skin: 0.0, leg: 0.0 };
        let frames = (self.baked.len() - STARTING) as f64;
        for (f, (baked, played)) in self.baked.iter().zip(played).enumerate().skip(STARTING) {
            let [body, skinned] = self.skinned(f);
            found.hem += mean_distance(played, baked, &hem) / frames;
            found.skin += mean_distance(&skinned, baked, &hem) / frames;
            let outside = leg_outside(&self.body().weights, &body, &self.garment().mesh, played);
            found.leg = found.leg.max(outside);
        }
        found
    }
}

#[test]
fn at_rest_the_scanned_shape_stays() {
    let scene = Scene::new(5, GarmentKind::Skirt, 0);
    let mut swing = Swing::new(&scene.springs);
    let still = vec![nalgebra::Isometry3::identity(); toile_character::JOINT_COUNT];
    (0..60).for_each(|_| swing.update(&still, 1.0 / 60.0));
    for moved in swing.moved() {
        assert!(moved.translation.vector.norm() < 1e-6 && moved.rotation.angle() < 1e-6, "{moved}");
    }
}

#[test]
fn three_vrm_swings_as_the_cloth_does() {
    let scene = Scene::new(7, GarmentKind::Skirt, 2 * STARTING);
    let own = scene.played();
    let likeness = scene.likeness(&own);
    eprintln!("our player: {likeness:?}");
    assert!(likeness.hem < FARTHER * likeness.skin && likeness.leg < LEG, "{likeness:?}");
    assert!(scene.own_motion(&own) > 0.01, "nothing swings: {} m", scene.own_motion(&own));
    let Some(played) = browser::play(&scene) else { return };
    let in_browser = scene.likeness(&played);
    eprintln!("three-vrm: {in_browser:?}");
    assert!(in_browser.hem < FARTHER * in_browser.skin && in_browser.leg < LEG, "{in_browser:?}");
    let all: Vec<u32> = (0..own[0].len() as u32).collect();
    let apart = own.iter().zip(&played).map(|(a, b)| mean_distance(a, b, &all)).fold(0.0, f64::max);
    assert!(apart < 0.001, "our player is {apart} m from three-vrm");
}

/// Prints how alike springs and cloth are over generated people; where constants come from.
#[test]
#[ignore = "takes minutes: cargo test --release -p toile-avatar --test springs -- --ignored --nocapture"]
fn figures() {
    for kind in [GarmentKind::Skirt, GarmentKind::Dress, GarmentKind::Coat] {
        for seed in [5, 7] {
            let mut scene = Scene::new(seed, kind, 2 * STARTING);
            let fitted = scene.springs.clone();
            for factor in [0.25, 0.5, 1.0, 2.0, 4.0, 16.0] {
                scene.springs = fitted.clone();
                for joint in scene.springs.chains.iter_mut().flat_map(|c| &mut c.joints) {
                    joint.stiffness *= factor;
                }
                let played = scene.played();
                let (likeness, own) = (scene.likeness(&played), scene.own_motion(&played));
                println!(
                    "{kind:?} {seed}: stiffness x {factor}: hem {:.1} mm (skin {:.1}), leg {:.1} mm, own motion {:.1} mm of {:.1}",
                    likeness.hem * 1e3,
                    likeness.skin * 1e3,
                    likeness.leg * 1e3,
                    own * 1e3,
                    scene.own_motion(&scene.baked) * 1e3,
                );
            }
        }
    }
}
