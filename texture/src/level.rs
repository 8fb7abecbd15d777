//! Each vertex's own colour over all pictures, and what brings every picture to it.
//!
//! Sharp pixels come from few pictures, the colour at large from all that show a place: so no picture's highlight, nor the border
//! between two pictures, is left to be seen (two bands, as in Baumberg 2002).

use rayon::prelude::*;

use crate::{
    light::{Light, Seen},
    photo::Shot,
    sight::{Neighbours, Sight, Surface},
};

/// Difference from the median of all pictures, in logarithms, at which one counts half: highlights and shadows are beyond.
const SCALE: f32 = 0.06;
/// Passes over neighbours that even out what brings a picture to the vertices' colours: about the blur of these colours.
const SMOOTHING: usize = 10;
/// The largest correction besides light and exposure, in logarithms.
const LARGEST: f32 = 0.7;

/// Colours at large, and corrections.
pub(crate) struct Levels {
    /// Each vertex's own colour, linear; where nothing was seen it is that of its surroundings.
    pub colors: Vec<[f32; 3]>,
    /// Whether any picture shows a vertex.
    pub is_seen: Vec<bool>,
    /// Factors by picture and vertex, besides the pictures' exposures.
    pub gains: Vec<Vec<f32>>,
    /// Factors of each picture's channels: one over its exposure.
    pub balance: Vec<[f32; 3]>,
    /// How far each vertex of a picture was off before, in logarithms.
    pub off: Vec<Vec<f32>>,
}

impl Levels {
    pub(crate) fn new(shots: &[Shot], sights: &[Sight], surface: &Surface, light: &Light) -> Self {
        let neighbours = &surface.neighbours;
        let shading: Vec<Vec<f32>> = shots
            .par_iter()
            .zip(sights)
            .map(|(shot, sight)| (0..sight.quality.len()).map(|v| shading(light, shot, sight, surface, v)).collect())
            .collect();
        let exposures = &light.exposures;
        let own: Vec<Option<[f32; 3]>> =
            (0..surface.normals.len()).into_par_iter().map(|v| own_color(sights, &shading, exposures, v)).collect();
        let is_seen: Vec<bool> = own.iter().map(Option::is_some).collect();
        let colors = spread(&own, neighbours);
        let both: Vec<(Vec<f32>, Vec<f32>)> = (0..shots.len())
            .into_par_iter()
            .map(|f| corrections(&sights[f], &shading[f], &exposures[f], &colors, neighbours))
            .collect();
        let (gains, off) = both.into_iter().unzip();
        Self { colors, is_seen, gains, balance: exposures.iter().map(|e| e.map(|e| (-e).exp())).collect(), off }
    }
}

/// Logarithm of what light and lens make of a vertex's colour; 0 far from where the picture shows the surface.
fn shading(light: &Light, shot: &Shot, sight: &Sight, surface: &Surface, v: usize) -> f32 {
    let is_near = sight.quality[v] > 0.0 || surface.neighbours.of(v).iter().any(|&n| sight.quality[n as usize] > 0.0);
    if is_near { light.shading(&Seen::new(shot, surface, v)) as f32 } else { 0.0 }
}

/// Logarithm of the colour that a picture shows of a vertex, without the light; `None` where it shows none.
fn unlit(sight: &Sight, shading: &[f32], exposure: &[f32; 3], v: usize) -> Option<[f32; 3]> {
    let color = sight.color[v];
    let is_known = sight.quality[v] > 0.0 && color.iter().sum::<f32>() > 0.0;
    is_known.then(|| std::array::from_fn(|k| color[k].max(1e-4).ln() - shading[v] - exposure[k]))
}

/// The colour of a vertex over all pictures, linear.
fn own_color(sights: &[Sight], shading: &[Vec<f32>], exposures: &[[f32; 3]], v: usize) -> Option<[f32; 3]> {
    let seen: Vec<(f32, [f32; 3])> = (0..sights.len())
        .filter_map(|f| Some((sights[f].quality[v], unlit(&sights[f], &shading[f], &exposures[f], v)?)))
        .collect();
    if seen.is_empty() {
        return None;
    }
    let brightness = |color: &[f32; 3]| color.iter().sum::<f32>() / 3.0;
    let mut sorted: Vec<f32> = seen.iter().map(|(_, color)| brightness(color)).collect();
    sorted.sort_by(f32::total_cmp);
    let middle = sorted[sorted.len() / 2];
    let (mut sum, mut total) = ([0.0f32; 3], 0.0f32);
    for (quality, color) in &seen {
        let weight = quality * quality / (1.0 + ((brightness(color) - middle) / SCALE).powi(2));
        (0..3).for_each(|k| sum[k] += weight * color[k]);
        total += weight;
    }
    Some(sum.map(|s| (s / total).exp()))
}

/// Fills what nobody saw from its surroundings: rings inwards, then smoothed.
fn spread(own: &[Option<[f32; 3]>], neighbours: &Neighbours) -> Vec<[f32; 3]> {
    const PASSES: usize = 60;
    let mut colors: Vec<Option<[f32; 3]>> = own.to_vec();
    let mut missing: Vec<usize> = (0..own.len()).filter(|&v| own[v].is_none()).collect();
    let unseen = missing.clone();
    while !missing.is_empty() {
        let found: Vec<(usize, Option<[f32; 3]>)> =
            missing.iter().map(|&v| (v, mean(neighbours.of(v).iter().filter_map(|&n| colors[n as usize])))).collect();
        let before = missing.len();
        found.into_iter().for_each(|(v, color)| colors[v] = color);
        missing.retain(|&v| colors[v].is_none());
        if missing.len() == before {
            break;
        }
    }
    // Parts of the surface that nobody saw at all take the mean.
    let whole = mean(own.iter().flatten().copied()).unwrap_or([0.5; 3]);
    let mut colors: Vec<[f32; 3]> = colors.into_iter().map(|c| c.unwrap_or(whole)).collect();
    for _ in 0..PASSES {
        for &v in &unseen {
            if let Some(color) = mean(neighbours.of(v).iter().map(|&n| colors[n as usize])) {
                colors[v] = color;
            }
        }
    }
    colors
}

fn mean(colors: impl Iterator<Item = [f32; 3]>) -> Option<[f32; 3]> {
    let (mut sum, mut count) = ([0.0f32; 3], 0.0f32);
    for color in colors {
        (0..3).for_each(|k| sum[k] += color[k]);
        count += 1.0;
    }
    (count > 0.0).then(|| sum.map(|s| s / count))
}

/// Factors that bring a picture to the vertices' colours, and how far it was off.
fn corrections(
    sight: &Sight,
    shading: &[f32],
    exposure: &[f32; 3],
    colors: &[[f32; 3]],
    neighbours: &Neighbours,
) -> (Vec<f32>, Vec<f32>) {
    let brightness = |color: [f32; 3]| color.iter().sum::<f32>() / 3.0;
    // What is not known is not a number.
    let rest = |v: usize| {
        let Some(unlit) = unlit(sight, shading, exposure, v) else { return f32::NAN };
        (brightness(colors[v].map(|c| c.max(1e-4).ln())) - brightness(unlit)).clamp(-LARGEST, LARGEST)
    };
    let mut known: Vec<f32> = (0..colors.len()).map(rest).collect();
    let off = known.iter().map(|rest| if rest.is_nan() { 0.0 } else { *rest }).collect();
    for _ in 0..SMOOTHING {
        let before = known.clone();
        for (v, value) in known.iter_mut().enumerate() {
            let own = if before[v].is_nan() { 0.0 } else { 2.0 };
            let (mut sum, mut count) = (if own > 0.0 { own * before[v] } else { 0.0 }, own);
            for &n in neighbours.of(v) {
                if !before[n as usize].is_nan() {
                    (sum, count) = (sum + before[n as usize], count + 1.0);
                }
            }
            if count > 0.0 {
                *value = sum / count;
            }
        }
    }
    let factor = |(rest, shading): (f32, &f32)| ((if rest.is_nan() { 0.0 } else { rest }) - shading).exp();
    (known.into_iter().zip(shading).map(factor).collect(), off)
}
