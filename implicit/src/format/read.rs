//! Reading a body's text; every error names its line.

use std::{collections::BTreeMap, ops::Range};

use nalgebra::{Point3, Vector3};
use serde::Deserialize;
use toile_character::{BodyModel, Joint, Skeleton, joint::JOINTS};
use toml::Spanned;

use super::FORMAT;
use crate::{
    ImplicitError,
    body::ImplicitBody,
    deform::Deform,
    group::{Group, Groups, ROOT},
    primitive::{Kind, Primitive},
    state::State,
};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BodyText {
    format: Spanned<u32>,
    name: String,
    field: Spanned<String>,
    beta: Spanned<Vec<f64>>,
    scale: Option<Spanned<f64>>,
    joints: BTreeMap<Spanned<String>, Spanned<[f64; 3]>>,
    #[serde(default, rename = "primitive")]
    primitives: Vec<Spanned<PrimitiveText>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PrimitiveText {
    #[serde(default)]
    name: String,
    joint: Spanned<String>,
    center: [f64; 3],
    axes: Spanned<[f64; 3]>,
    #[serde(default)]
    turn: [f64; 3],
    weight: Option<Spanned<f64>>,
    kind: Option<Spanned<String>>,
    groups: Option<Spanned<Vec<Spanned<String>>>>,
    muscle: Option<MuscleText>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StateText {
    center: Option<[f64; 3]>,
    axes: Spanned<[f64; 3]>,
    turn: Option<[f64; 3]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MuscleText {
    reference: Spanned<String>,
    axis: Spanned<[f64; 3]>,
    limits: Spanned<[f64; 3]>,
    min: StateText,
    max: StateText,
    blending: Option<Spanned<String>>,
}

/// Reads a body from its text. Joints that the text leaves out (fingers, as a rule) keep the offset from their parent that the model gives
/// them with the text's β.
///
/// # Errors
/// [`ImplicitError::Line`] names the line of the first problem; [`ImplicitError::Body`] a group without a primitive.
pub fn read(text: &str, model: &BodyModel) -> Result<ImplicitBody, ImplicitError> {
    let reader = Reader { text };
    let parsed: BodyText = toml::from_str(text)
        .map_err(|e| reader.wrong(&e.span().unwrap_or(0..0), e.message().trim().replace('\n', " ")))?;
    if *parsed.format.get_ref() != FORMAT {
        let reason = format!("format {} is not known; this program reads format {FORMAT}", parsed.format.get_ref());
        return Err(reader.wrong(&parsed.format.span(), reason));
    }
    let beta = parsed.beta.get_ref().clone();
    if beta.len() > model.component_count() || beta.iter().any(|b| !b.is_finite()) {
        let reason = format!("`beta` must be at most {} finite numbers", model.component_count());
        return Err(reader.wrong(&parsed.beta.span(), reason));
    }
    let field = parsed.field.get_ref().parse().map_err(|e| reader.wrong(&parsed.field.span(), e))?;
    let scale = parsed.scale.as_ref().map_or(1.0, |s| *s.get_ref());
    if let Some(given) = parsed.scale.as_ref().filter(|_| !(0.1..=10.0).contains(&scale)) {
        return Err(reader.wrong(&given.span(), "`scale` must be a number between 0.1 and 10"));
    }
    let skeleton = reader.skeleton(&parsed.joints, model, &beta)?;
    let primitives: Result<Vec<Primitive>, ImplicitError> =
        parsed.primitives.iter().map(|p| reader.primitive(p.get_ref())).collect();
    let body = ImplicitBody { name: parsed.name, field, skeleton, beta, scale, primitives: primitives? };
    body.validate()?;
    Ok(body)
}

/// Reads one primitive from the inside of a table: `joint = "hips", center = [0, 0, 0], axes = [100, 90, 80]`.
///
/// # Errors
/// [`ImplicitError::Body`] repeats the words and says what is wrong with them.
pub fn read_primitive(words: &str) -> Result<Primitive, ImplicitError> {
    #[derive(Deserialize)]
    struct Words {
        words: PrimitiveText,
    }
    let text = format!("words = {{ {words} }}");
    let reader = Reader { text: &text };
    let wrong = |reason: String| ImplicitError::Body(format!("`{words}`: {reason}"));
    let parsed: Words = toml::from_str(&text).map_err(|e| wrong(e.message().trim().replace('\n', " ")))?;
    reader.primitive(&parsed.words).map_err(|e| match e {
        ImplicitError::Line { reason, .. } => wrong(reason),
        other => other,
    })
}

struct Reader<'a> {
    text: &'a str,
}

impl Reader<'_> {
    fn wrong(&self, span: &Range<usize>, reason: impl Into<String>) -> ImplicitError {
        let before = self.text.get(..span.start.min(self.text.len())).unwrap_or(self.text);
        ImplicitError::Line { line: before.matches('\n').count() + 1, reason: reason.into() }
    }

    fn joint(&self, name: &Spanned<String>) -> Result<Joint, ImplicitError> {
        let unknown = || format!("`{}` is no joint; use a VRM bone name such as `leftUpperArm`", name.get_ref());
        Joint::from_name(name.get_ref()).ok_or_else(|| self.wrong(&name.span(), unknown()))
    }

    fn skeleton(
        &self,
        joints: &BTreeMap<Spanned<String>, Spanned<[f64; 3]>>,
        model: &BodyModel,
        beta: &[f64],
    ) -> Result<Skeleton, ImplicitError> {
        let usual = model.skeleton_at(beta);
        let mut given = BTreeMap::new();
        for (name, place) in joints {
            if place.get_ref().iter().any(|c| !c.is_finite()) {
                return Err(self.wrong(&place.span(), "the place of a joint must be three finite numbers, metres"));
            }
            given.insert(self.joint(name)?, Point3::from(*place.get_ref()));
        }
        let mut skeleton = usual.clone();
        for joint in JOINTS {
            let from_parent = joint.parent().map(|p| skeleton.position(p) + usual.offset(joint));
            let place = given.get(&joint).copied().or(from_parent);
            skeleton.rest[joint.index()] = place.unwrap_or_else(|| usual.position(joint));
        }
        Ok(skeleton)
    }

    fn primitive(&self, text: &PrimitiveText) -> Result<Primitive, ImplicitError> {
        let joint = self.joint(&text.joint)?;
        let kind = match text.kind.as_ref().map(|k| (k.get_ref().as_str(), k.span())) {
            None | Some(("metaball", _)) => Kind::Metaball,
            Some(("ellipsoid", _)) => Kind::Ellipsoid,
            Some((other, span)) => {
                return Err(self.wrong(&span, format!("`{other}` is no kind of primitive; use metaball or ellipsoid")));
            }
        };
        let weight = text.weight.as_ref().map_or(1.0, |w| *w.get_ref());
        if !weight.is_finite() || weight == 0.0 || (kind == Kind::Ellipsoid && weight < 0.0) {
            let span = text.weight.as_ref().map_or(0..0, Spanned::span);
            return Err(self.wrong(&span, "`weight` must be a number other than 0, and above 0 for an ellipsoid"));
        }
        let state = self.state(&text.center, &text.axes, &text.turn)?;
        let groups = self.groups(joint, text.groups.as_ref())?;
        let deform = text.muscle.as_ref().map(|m| self.muscle(m, text)).transpose()?;
        Ok(Primitive { name: text.name.clone(), joint, kind, weight, state, groups, deform })
    }

    fn state(&self, center: &[f64; 3], axes: &Spanned<[f64; 3]>, turn: &[f64; 3]) -> Result<State, ImplicitError> {
        let millimetres = |v: &[f64; 3]| Vector3::from(*v) * 1e-3;
        if axes.get_ref().iter().any(|a| !a.is_finite() || *a <= 0.0) {
            return Err(self.wrong(&axes.span(), "the half axes of a primitive must be above 0, in millimetres"));
        }
        if center.iter().chain(turn).any(|c| !c.is_finite()) {
            return Err(self.wrong(&axes.span(), "center and turn of a primitive must be finite numbers"));
        }
        let turn = Vector3::from(*turn).map(f64::to_radians);
        Ok(State { axes: millimetres(axes.get_ref()), center: millimetres(center), turn })
    }

    fn groups(&self, joint: Joint, names: Option<&Spanned<Vec<Spanned<String>>>>) -> Result<Groups, ImplicitError> {
        let Some(names) = names else { return Ok(Groups::default().with(Group::of_joint(joint))) };
        let mut groups = Groups::default();
        for name in names.get_ref() {
            groups = match Group::from_name(name.get_ref()) {
                Some(group) => groups.with(group),
                None if name.get_ref() == ROOT => Groups::ROOT,
                None => {
                    let all: Vec<&str> = Group::ALL.iter().map(|g| g.name()).collect();
                    let reason = format!("`{}` is no group; use root or one of {}", name.get_ref(), all.join(", "));
                    return Err(self.wrong(&name.span(), reason));
                }
            };
        }
        if groups.is_empty() {
            return Err(self.wrong(&names.span(), "`groups` is empty; leave it out for the group of the joint"));
        }
        Ok(groups)
    }

    fn muscle(&self, text: &MuscleText, relaxed: &PrimitiveText) -> Result<Deform, ImplicitError> {
        let reference = self.joint(&text.reference)?;
        let limits = text.limits.get_ref().map(f64::to_radians);
        let ascending = limits[0] <= limits[1] && limits[1] <= limits[2] && limits[0] < limits[2];
        if !ascending || limits.iter().any(|l| !l.is_finite()) {
            let reason = "`limits` must ascend: lowest angle, relaxed angle, highest angle, in degrees";
            return Err(self.wrong(&text.limits.span(), reason));
        }
        let axis = Vector3::from(*text.axis.get_ref()).try_normalize(1e-6);
        let axis = axis.filter(|a| a.iter().all(|c| c.is_finite()));
        let axis =
            axis.ok_or_else(|| self.wrong(&text.axis.span(), "`axis` must be a direction other than 0, 0, 0"))?;
        let state =
            |s: &StateText| self.state(&s.center.unwrap_or(relaxed.center), &s.axes, &s.turn.unwrap_or(relaxed.turn));
        let blending = match &text.blending {
            None => crate::deform::Blending::default(),
            Some(name) => name.get_ref().parse().map_err(|e| self.wrong(&name.span(), e))?,
        };
        Ok(Deform { reference, axis, limits, at_min: state(&text.min)?, at_max: state(&text.max)?, blending })
    }
}
