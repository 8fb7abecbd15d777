//! Skin weights of hanging cloth: on chains as far as its motion is its own, on legs as far as it follows them.

use toile_character::{JOINT_COUNT, Joint, SkinWeights, SpringChain, skin::INFLUENCES};

use super::{
    around::{Around, beside},
    cloth::Cloth,
    layer::RestedLayer,
};

/// Weights of the `layer` on legs and `chains`. Above the hips they stay as they are.
pub(super) fn bind(around: &Around, cloth: &Cloth, chains: &[SpringChain], layer: &RestedLayer<'_>) -> SkinWeights {
    let mut out = SkinWeights::default();
    let bones = chains[0].joints.len() - 1;
    let bone_length = (around.top - cloth.low) / bones as f64;
    for (v, p) in layer.mesh.positions.iter().enumerate() {
        let place = p.cast::<f64>();
        let depth = around.top - place.y;
        if depth <= 0.0 {
            out.joints.push(layer.weights.joints[v]);
            out.weights.push(layer.weights.weights[v]);
            continue;
        }
        let (turn, _) = around.polar(&place);
        let hung = smooth_step(depth / bone_length);
        let own = cloth.own(turn, place.y) * hung;
        let mut influences: Vec<(u8, f32)> = Vec::with_capacity(2 * INFLUENCES);
        let (mut legs, mut rest) = (0.0, Vec::new());
        for (joint, weight) in layer.weights.of(v) {
            if is_leg(joint) {
                legs += f64::from(weight);
                influences.push((joint, weight * (1.0 - own) as f32));
            } else {
                rest.push((joint, weight));
            }
        }
        // What hangs on the hips hangs on the chains, which are the hips' own.
        let of_hips = (1.0 - legs).max(0.0);
        let on_chains = own + (1.0 - own) * of_hips * hung;
        influences.extend(rest.iter().map(|(j, w)| (*j, *w * ((1.0 - own) * (1.0 - hung)) as f32)));
        let bone = ((depth / bone_length) as usize).min(bones - 1);
        let (pair, second) = beside(turn);
        for (chain, share) in pair.into_iter().zip([1.0 - second, second]) {
            let joint = JOINT_COUNT + chain * (bones + 1) + bone;
            influences.push((joint as u8, (on_chains * share) as f32));
        }
        out.push(&without_least(influences));
    }
    out
}

/// From 0 to 1 without a corner.
fn smooth_step(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

fn is_leg(joint: u8) -> bool {
    use Joint::*;
    [LeftUpperLeg, RightUpperLeg, LeftLowerLeg, RightLowerLeg].iter().any(|j| j.index() == usize::from(joint))
}

/// The largest influences, each less the largest of those that are left out: neighbours' weights are alike where their fourth and
/// fifth change places.
fn without_least(mut influences: Vec<(u8, f32)>) -> Vec<(u8, f32)> {
    influences.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let Some(&(_, fifth)) = influences.get(INFLUENCES) else { return influences };
    if influences[0].1 - fifth > 0.1 {
        influences.iter_mut().for_each(|i| i.1 = (i.1 - fifth).max(0.0));
    }
    influences
}
