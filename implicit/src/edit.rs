//! Primitives added, taken away and moved, by words that a command line can give.
//!
//! The words are those of the file, as the inside of a TOML table: `joint = "leftUpperArm", center = [60, -70, 20], axes = [22, 60, 24]`.

use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use serde::Deserialize;
use toml::Spanned;

use crate::{ImplicitError, body::ImplicitBody, format, state::State};

/// A change of a body.
#[derive(Debug, Clone, PartialEq)]
pub enum Edit {
    /// A new primitive, by the entries of the file; `turn` may be left out.
    Add(String),
    /// The primitive with this number (from 1, in the file's order) or name goes.
    Delete(String),
    /// The primitive with this number or name moves: `by` (millimetres), `turn` (degrees about x, then y, then z, about its centre),
    /// `scale` (factors of its half axes).
    Move(String, String),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MoveText {
    by: Option<[f64; 3]>,
    turn: Option<[f64; 3]>,
    scale: Option<Spanned<[f64; 3]>>,
}

#[derive(Deserialize)]
struct Words {
    words: MoveText,
}

impl Edit {
    /// Changes `body`; muscles change in all their states alike.
    ///
    /// # Errors
    /// [`ImplicitError::Body`] says which words cannot be read, that there is no such primitive, or that the body would lack one
    /// in a group; `body` is as it was then.
    pub fn apply(&self, body: &mut ImplicitBody) -> Result<(), ImplicitError> {
        let mut changed = body.clone();
        match self {
            Self::Add(words) => changed.primitives.push(format::read_primitive(words)?),
            Self::Delete(which) => drop(changed.primitives.remove(find(body, which)?)),
            Self::Move(which, words) => {
                let way = Way::read(words)?;
                let moved = &mut changed.primitives[find(body, which)?];
                moved.state = way.of(&moved.state);
                if let Some(deform) = &mut moved.deform {
                    (deform.at_min, deform.at_max) = (way.of(&deform.at_min), way.of(&deform.at_max));
                }
            }
        }
        changed.validate()?;
        *body = changed;
        Ok(())
    }
}

/// The index of the primitive with a number or a name.
fn find(body: &ImplicitBody, which: &str) -> Result<usize, ImplicitError> {
    let count = body.primitives.len();
    if let Ok(number) = which.trim().trim_start_matches('#').parse::<usize>() {
        let found = number.checked_sub(1).filter(|k| *k < count);
        let none = || format!("there is no primitive {number}; they are numbered from 1 to {count}");
        return found.ok_or_else(|| ImplicitError::Body(none()));
    }
    let called: Vec<usize> = (0..count).filter(|&k| body.primitives[k].name == which).collect();
    match called[..] {
        [one] => Ok(one),
        [] => {
            Err(ImplicitError::Body(format!("no primitive is called `{which}`; give a name or a number, 1 to {count}")))
        }
        _ => {
            let numbers: Vec<String> = called.iter().map(|k| (k + 1).to_string()).collect();
            let reason =
                format!("several primitives are called `{which}`; give one of the numbers {}", numbers.join(", "));
            Err(ImplicitError::Body(reason))
        }
    }
}

/// A change of a state.
struct Way {
    by: Vector3<f64>,
    turn: UnitQuaternion<f64>,
    scale: Vector3<f64>,
}

impl Way {
    fn read(words: &str) -> Result<Self, ImplicitError> {
        let wrong = |reason: &str| ImplicitError::Body(format!("`{words}`: {reason}"));
        let parsed: Words =
            toml::from_str(&format!("words = {{ {words} }}")).map_err(|e| wrong(&e.message().replace('\n', " ")))?;
        let MoveText { by, turn, scale } = parsed.words;
        let scale = scale.map_or(Vector3::repeat(1.0), |s| Vector3::from(*s.get_ref()));
        let (by, turn) = (Vector3::from(by.unwrap_or_default()), Vector3::from(turn.unwrap_or_default()));
        if !scale.iter().all(|s| s.is_finite() && *s > 0.0) {
            return Err(wrong("`scale` must be three factors above 0"));
        }
        if by.iter().chain(turn.iter()).any(|c| !c.is_finite()) {
            return Err(wrong("`by` and `turn` must be three finite numbers each"));
        }
        let turn = turn.map(f64::to_radians);
        let turn = Rotation3::from_euler_angles(turn.x, turn.y, turn.z);
        Ok(Self { by: by * 1e-3, turn: UnitQuaternion::from_rotation_matrix(&turn), scale })
    }

    fn of(&self, state: &State) -> State {
        let moved = State { axes: state.axes.component_mul(&self.scale), center: state.center + self.by, ..*state };
        moved.turned(&(self.turn * state.rotation()))
    }
}

#[cfg(test)]
mod tests {
    use toile_character::{BodyModel, Joint};

    use super::*;
    use crate::{field_function::FieldFunction, group::Groups, primitive::Primitive};

    fn body() -> ImplicitBody {
        let skeleton = BodyModel::load_default().unwrap().mean_skeleton;
        let state = State { axes: Vector3::repeat(0.1), center: Vector3::zeros(), turn: Vector3::zeros() };
        let ball = |name: &str| Primitive {
            name: name.into(),
            groups: Groups::ROOT,
            ..Primitive::metaball(Joint::Hips, state)
        };
        ImplicitBody {
            name: "balls".into(),
            field: FieldFunction::Wyvill,
            skeleton,
            beta: Vec::new(),
            scale: 1.0,
            primitives: vec![ball("trunk"), ball("twin"), ball("twin")],
        }
    }

    fn done(edits: &[Edit]) -> Result<ImplicitBody, ImplicitError> {
        let mut body = body();
        edits.iter().try_for_each(|edit| edit.apply(&mut body)).map(|()| body)
    }

    #[test]
    fn primitives_are_added_moved_and_deleted() {
        let add = Edit::Add(
            "name = \"biceps\", joint = \"leftUpperArm\", center = [60, -70, 20.5], axes = [22, 60, 24]".into(),
        );
        let way = "by = [5, 0, 0], turn = [0, 0, 90], scale = [2, 1, 1]".to_string();
        let body = done(&[add, Edit::Move("biceps".into(), way), Edit::Delete("#3".into())]).unwrap();
        let biceps = body.primitives.last().unwrap();
        assert_eq!((body.primitives.len(), biceps.joint), (3, Joint::LeftUpperArm));
        assert!((biceps.state.center - Vector3::new(0.065, -0.07, 0.0205)).norm() < 1e-12);
        assert!((biceps.state.axes - Vector3::new(0.044, 0.06, 0.024)).norm() < 1e-12);
        let across = biceps.state.rotation() * Vector3::x();
        assert!((across - Vector3::y()).norm() < 1e-9, "turned by 90° about z: {across}");
    }

    #[test]
    fn what_cannot_be_done_is_said_and_changes_nothing() {
        for (edit, says) in [
            (Edit::Delete("7".into()), "numbered from 1 to 3"),
            (Edit::Delete("0".into()), "no primitive 0"),
            (Edit::Delete("tail".into()), "no primitive is called `tail`"),
            (Edit::Delete("twin".into()), "numbers 2, 3"),
            (Edit::Move("1".into(), "scale = [1, 0, 1]".into()), "above 0"),
            (Edit::Move("1".into(), "by = [1, nan, 1]".into()), "finite"),
            (Edit::Move("1".into(), "hop = [1, 2, 3]".into()), "unknown field"),
            (Edit::Move("1".into(), "by = [1, 2".into()), "by = [1, 2"),
            (Edit::Add("joint = \"tail\", center = [0, 0, 0], axes = [1, 1, 1]".into()), "`tail` is no joint"),
            (Edit::Add("joint = \"hips\", center = [0, 0, 0], axes = [1, -1, 1]".into()), "above 0"),
            (Edit::Add("joint = \"hips\"".into()), "missing field"),
        ] {
            let mut changed = body();
            let error = edit.apply(&mut changed).unwrap_err().to_string();
            assert!(error.contains(says) && !error.starts_with("line"), "{edit:?}: {error}");
            assert_eq!(changed, body());
        }
        let all = ["1", "1", "1"].map(|n| Edit::Delete(n.into()));
        assert!(done(&all).unwrap_err().to_string().contains("no primitive in the group"), "a body without a torso");
    }
}
