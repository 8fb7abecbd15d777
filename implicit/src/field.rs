//! The field of a posed body, and where rays leave it (paper 002 §1 and §2).

use nalgebra::{Matrix3, Point3, Vector3};
use toile_character::Pose;

use crate::{
    body::ImplicitBody,
    field_function::{FieldFunction, THRESHOLD},
    group::Group,
    primitive::{Kind, Primitive},
    surface::{Ray, Surface},
};

/// Steps along a ray are this long, metres: thinner things are not seen, and no part of a person's skin between wrist and
/// neck is thinner.
const STEP: f64 = 0.006;
/// A hit is this exact, metres.
const EXACT: f64 = 2e-5;
/// Influences of more primitives than these on one ray are cut to the first ones.
const MAX_ON_RAY: usize = 96;

/// A primitive in the frame of a pose.
#[derive(Debug, Clone, Copy)]
struct Placed {
    /// Maps offsets from the centre to units of the influence.
    unit_from_offset: Matrix3<f64>,
    center: Point3<f64>,
    /// Radius of the sphere that holds the influence.
    reach: f64,
    weight: f64,
    kind: Kind,
}

/// The field of a body in one pose, by group.
#[derive(Debug, Clone)]
pub struct Field {
    function: FieldFunction,
    /// Primitives of each group, by [`Group`]'s order.
    groups: Vec<Vec<Placed>>,
}

/// Squared distance along a ray in units of a primitive's influence: a t² + 2 b t + c.
#[derive(Debug, Clone, Copy, Default)]
struct OnRay {
    a: f64,
    b: f64,
    c: f64,
    weight: f64,
    /// Where the ray enters and leaves the influence.
    span: [f64; 2],
}

impl Field {
    /// The field of `body` in `pose`, muscles included.
    pub fn new(body: &ImplicitBody, pose: &Pose) -> Self {
        let frames = pose.joint_frames(&body.skeleton);
        let mut groups = vec![Vec::new(); Group::ALL.len()];
        for primitive in &body.primitives {
            let state = state_in(primitive, pose);
            let frame = &frames[primitive.joint.index()];
            let influence = body.field.influence() * state.axes;
            let rotation = frame.rotation * state.rotation();
            let scale = Matrix3::from_diagonal(&influence.map(|a| 1.0 / a));
            let placed = Placed {
                unit_from_offset: scale * rotation.inverse().to_rotation_matrix().matrix(),
                center: frame * Point3::from(state.center),
                reach: influence.max(),
                weight: primitive.weight,
                kind: primitive.kind,
            };
            primitive.groups.iter().for_each(|g| groups[g as usize].push(placed));
        }
        Self { function: body.field, groups }
    }

    /// The field of the metaballs of `group` at `p`.
    pub fn value(&self, group: Group, p: &Point3<f64>) -> f64 {
        let of = |q: &Placed| q.weight * self.function.value((q.unit_from_offset * (p - q.center)).norm_squared());
        self.groups[group as usize].iter().filter(|q| q.kind == Kind::Metaball).map(of).sum()
    }

    /// What `primitive` of `body` at rest gives at `p`.
    pub(crate) fn share(&self, primitive: &Primitive, body: &ImplicitBody, p: &Point3<f64>) -> f64 {
        let center = body.skeleton.position(primitive.joint) + primitive.state.center;
        let offset = primitive.state.rotation().inverse() * (p - center);
        let unit = offset.component_div(&(self.function.influence() * primitive.state.axes));
        primitive.weight * self.function.value(unit.norm_squared())
    }

    /// The last crossing of the threshold by the metaballs on `ray`, walking inward from the end of their influence.
    fn metaballs(&self, on_ray: &[OnRay], reach: f64) -> Option<f64> {
        let end = on_ray.iter().filter(|q| q.weight > 0.0).map(|q| q.span[1]).fold(0.0, f64::max).min(reach);
        let value = |t: f64| -> f64 {
            let of = |q: &OnRay| q.weight * self.function.value((q.a * t + 2.0 * q.b) * t + q.c);
            on_ray.iter().filter(|q| t > q.span[0] && t < q.span[1]).map(of).sum::<f64>() - THRESHOLD
        };
        let mut outside = (end, value(end));
        if outside.1 >= 0.0 {
            return Some(end);
        }
        while outside.0 > 0.0 {
            let t = (outside.0 - STEP).max(0.0);
            let inside = (t, value(t));
            if inside.1 >= 0.0 {
                return Some(between(inside, outside, value));
            }
            outside = inside;
        }
        None
    }
}

/// Size, place and turn of a primitive in a pose.
pub(crate) fn state_in(primitive: &Primitive, pose: &Pose) -> crate::state::State {
    match &primitive.deform {
        Some(deform) => deform.state(&primitive.state, deform.angle(pose)),
        None => primitive.state,
    }
}

/// The zero of `value` between two places of different sign (Illinois' false position).
fn between(mut a: (f64, f64), mut b: (f64, f64), value: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..30 {
        if (b.0 - a.0).abs() < EXACT {
            break;
        }
        let t = a.0 + (b.0 - a.0) * a.1 / (a.1 - b.1);
        let v = value(t);
        if v.abs() < 1e-7 {
            return t;
        }
        // The end that stays is weighed half, so that it moves as well.
        if (v >= 0.0) == (b.1 >= 0.0) {
            b = (t, v);
            a.1 *= 0.5;
        } else {
            a = (t, v);
            b.1 *= 0.5;
        }
    }
    0.5 * (a.0 + b.0)
}

impl Surface for Field {
    fn outermost(&self, ray: &Ray) -> Option<f64> {
        let mut on_ray = [OnRay::default(); MAX_ON_RAY];
        let mut count = 0;
        let mut best: Option<f64> = None;
        let direction: Vector3<f64> = ray.direction;
        for q in &self.groups[ray.group as usize] {
            let offset = ray.origin - q.center;
            let along = offset.dot(&direction);
            if offset.norm_squared() - along * along > q.reach * q.reach || count == MAX_ON_RAY {
                continue;
            }
            let (u, d) = (q.unit_from_offset * offset, q.unit_from_offset * direction);
            let (a, b, c) = (d.norm_squared(), d.dot(&u), u.norm_squared());
            let edge = match q.kind {
                Kind::Metaball => 1.0,
                Kind::Ellipsoid => self.function.influence().powi(-2),
            };
            let root = b * b - a * (c - edge);
            if root <= 0.0 {
                continue;
            }
            let half = root.sqrt();
            let span = [(-b - half) / a, (-b + half) / a];
            if span[1] <= 0.0 {
                continue;
            }
            match q.kind {
                Kind::Metaball => {
                    on_ray[count] = OnRay { a, b, c, weight: q.weight, span };
                    count += 1;
                }
                Kind::Ellipsoid if span[1] <= ray.reach => best = Some(best.map_or(span[1], |t| t.max(span[1]))),
                Kind::Ellipsoid => {}
            }
        }
        let soft = self.metaballs(&on_ray[..count], ray.reach);
        match (best, soft) {
            (Some(a), Some(b)) => Some(a.max(b)),
            (a, b) => a.or(b),
        }
    }
}

#[cfg(test)]
mod tests {
    use toile_character::{BodyModel, Joint};

    use super::*;
    use crate::state::State;

    fn body(primitives: Vec<Primitive>) -> ImplicitBody {
        let skeleton = BodyModel::load_default().unwrap().mean_skeleton;
        ImplicitBody {
            name: "balls".into(),
            field: FieldFunction::Wyvill,
            skeleton,
            beta: Vec::new(),
            scale: 1.0,
            primitives,
        }
    }

    fn ball(joint: Joint, x: f64, axes: [f64; 3]) -> Primitive {
        let state = State { axes: axes.into(), center: Vector3::new(x, 0.0, 0.0), turn: Vector3::zeros() };
        Primitive::metaball(joint, state)
    }

    fn from_hips(body: &ImplicitBody, group: Group, direction: Vector3<f64>) -> Ray {
        Ray { group, origin: body.skeleton.position(Joint::Hips), direction, reach: 0.5 }
    }

    #[test]
    fn a_primitive_alone_has_its_own_half_axes() {
        for function in FieldFunction::ALL {
            for kind in [Kind::Metaball, Kind::Ellipsoid] {
                let one = Primitive { kind, ..ball(Joint::Hips, 0.0, [0.1, 0.05, 0.08]) };
                let body = ImplicitBody { field: function, ..body(vec![one]) };
                let field = Field::new(&body, &Pose::identity());
                for (direction, axis) in [(Vector3::x(), 0.1), (-Vector3::y(), 0.05), (Vector3::z(), 0.08)] {
                    let t = field.outermost(&from_hips(&body, Group::Hip, direction)).unwrap();
                    assert!((t - axis).abs() < 1e-4, "{function} {kind:?}: {t}");
                }
            }
        }
    }

    #[test]
    fn rays_find_the_outermost_crossing_and_see_only_their_group() {
        let near = ball(Joint::Hips, 0.0, [0.05; 3]);
        let far = ball(Joint::Hips, 0.3, [0.04; 3]);
        let leg = ball(Joint::LeftUpperLeg, 0.1, [0.1; 3]);
        let body = body(vec![near, far, leg]);
        let field = Field::new(&body, &Pose::identity());
        let ray = from_hips(&body, Group::Hip, Vector3::x());
        assert!((field.outermost(&ray).unwrap() - 0.34).abs() < 1e-4);
        assert!((field.outermost(&Ray { reach: 0.2, ..ray }).unwrap() - 0.05).abs() < 1e-4, "nothing beyond the reach");
        let aside = Ray { direction: Vector3::z(), ..ray };
        assert!((field.outermost(&aside).unwrap() - 0.05).abs() < 1e-4, "the leg's primitive is not seen");
        assert_eq!(field.outermost(&Ray { group: Group::UpperTorso, ..ray }), None);
    }

    #[test]
    fn two_metaballs_blend_and_a_negative_one_presses_in() {
        let two = |weight: f64| {
            let other = Primitive { weight, ..ball(Joint::Hips, 0.06, [0.05; 3]) };
            let body = body(vec![ball(Joint::Hips, 0.0, [0.05; 3]), other]);
            let t = Field::new(&body, &Pose::identity()).outermost(&from_hips(&body, Group::Hip, Vector3::z()));
            let p = body.skeleton.position(Joint::Hips) + Vector3::z() * t.unwrap();
            assert!((Field::new(&body, &Pose::identity()).value(Group::Hip, &p) - THRESHOLD).abs() < 1e-3);
            t.unwrap()
        };
        assert!(two(1.0) > 0.055 && two(-0.5) < 0.048, "{} {}", two(1.0), two(-0.5));
    }
}
