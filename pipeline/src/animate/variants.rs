//! One motion by each blend, side by side: Fig. 11 and Table 1 of Hu et al. 2017, with our own way beside theirs.

use std::time::Instant;

use toile_animation::blend::{Blend, Outfit};
use toile_geometry::statistics::{Rank, quantile_by};
use toile_render::{RgbImage, film, png, sheet};

use super::{
    caches::Cached,
    endless::LeadIn,
    inputs::Baking,
    mover::Mover,
    options::{AnimateOptions, Profile},
    pictures::{FILM_LIMIT, film_frames, portrait},
    report::{AnimationReport, Variant},
};
use crate::PipelineError;

/// Moments that `variants.png` shows.
const MOMENTS: usize = 4;

/// Files by name.
type Files = Vec<(&'static str, Vec<u8>)>;

/// Moves the outfit by each blend that the caches do not hold, and draws all of them: `variants.gif` and `variants.png`.
pub(super) fn compare(
    baking: &Baking,
    outfit: &Outfit,
    lead_in: Option<&LeadIn>,
    cached: &mut [Cached],
    report: &AnimationReport,
) -> Result<(Vec<Variant>, Files), PipelineError> {
    let (shown, milliseconds) = film_frames(baking.motion);
    let (mut variants, mut films) = (Vec::new(), Vec::new());
    for blend in Blend::ALL {
        let (variant, pictures) = if blend == report.blend {
            let frame = |&f: &usize| {
                let layers = cached.iter_mut().map(|layer| layer.frame(f)).collect::<Result<Vec<_>, _>>()?;
                portrait(baking, &layers, f)
            };
            let pictures = shown.iter().map(frame).collect::<Result<Vec<_>, _>>()?;
            let (ms_a_frame, crossing_mean) = (report.ms_a_frame, report.crossing_mean);
            (Variant { blend, ms_a_frame, crossing_mean }, pictures)
        } else {
            moved(baking, outfit, blend, lead_in, &shown)?
        };
        variants.push(variant);
        films.push((blend.name(), pictures));
    }
    let wrong = |e| PipelineError::stage(baking.folder, e);
    let beside = |k: usize| -> Vec<(String, RgbImage)> {
        films.iter().map(|(name, pictures)| ((*name).to_string(), pictures[k].clone())).collect()
    };
    let pictures: Result<Vec<RgbImage>, _> =
        (0..shown.len()).map(|k| sheet::contact_sheet(&beside(k), films.len())).collect();
    let gif = film::gif(&pictures.map_err(wrong)?, milliseconds, FILM_LIMIT).map_err(wrong)?;
    let columns = MOMENTS.min(shown.len());
    let moment = |m: usize| m * shown.len() / columns;
    let row = |(name, pictures): &(&str, Vec<RgbImage>)| -> Vec<(String, RgbImage)> {
        (0..columns).map(|m| ((*name).to_string(), pictures[moment(m)].clone())).collect()
    };
    let tiles: Vec<(String, RgbImage)> = films.iter().flat_map(row).collect();
    let stills = sheet::contact_sheet(&tiles, columns).map_err(wrong)?;
    Ok((variants, vec![("variants.gif", gif), ("variants.png", png::encode(&stills).map_err(wrong)?)]))
}

/// The outfit moved by one blend, and its pictures in the frames that are `shown`.
fn moved(
    baking: &Baking,
    outfit: &Outfit,
    blend: Blend,
    lead_in: Option<&LeadIn>,
    shown: &[usize],
) -> Result<(Variant, Vec<RgbImage>), PipelineError> {
    let wrong = |e: toile_animation::AnimationError| PipelineError::stage(baking.folder, e);
    let options = AnimateOptions { profile: Profile::Bake, blend, ..baking.options.clone() };
    let mut mover = Mover::new(outfit, &options).map_err(wrong)?;
    mover.start(&baking.avatar.pose0, baking.motion, lead_in).map_err(wrong)?;
    let (mut times, mut crossing, mut pictures) = (Vec::new(), 0, Vec::with_capacity(shown.len()));
    let poses = &baking.motion.poses;
    for (k, pose) in poses.iter().enumerate() {
        let begun = Instant::now();
        mover.frame(&poses[k.saturating_sub(1)], pose, baking.motion.frame_time).map_err(wrong)?;
        times.push(begun.elapsed().as_secs_f64() * 1e3);
        mover.look();
        crossing += mover.crossing();
        if shown.contains(&k) {
            pictures.push(portrait(baking, mover.layers(), k)?);
        }
        baking.observer.at((k + 1) as f32 / poses.len() as f32);
    }
    let ms_a_frame = [0.5, 0.95].map(|q| quantile_by(&mut times, q, Rank::Count).unwrap_or(0.0));
    Ok((Variant { blend, ms_a_frame, crossing_mean: crossing as f64 / poses.len().max(1) as f64 }, pictures))
}
