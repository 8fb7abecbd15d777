//! Writing a body's text.

use std::fmt::Write;

use nalgebra::Vector3;
use toile_character::joint::JOINTS;

use super::FORMAT;
use crate::{
    body::ImplicitBody,
    group::{Group, Groups},
    primitive::{Kind, Primitive},
    state::State,
};

const HEAD: &str = "\
# A body of primitives. Joints are metres, primitives millimetres from their joint and degrees, along the axes of the rest pose.
# docs/implicit.md explains every line.
";

/// The text of `body`, which [`super::read`] reads back: joints to a tenth of a millimetre, primitives to a tenth of a millimetre and of a
/// degree.
pub fn write(body: &ImplicitBody) -> String {
    let mut out = String::from(HEAD);
    let beta: Vec<String> = body.beta.iter().map(|b| short(*b, 3)).collect();
    // writing into a string cannot fail
    let _ = write!(
        out,
        "format = {FORMAT}\nname = {}\nfield = \"{}\"\nbeta = [{}]\n",
        quoted(&body.name),
        body.field,
        beta.join(", ")
    );
    if (body.scale - 1.0).abs() > 5e-5 {
        let _ = writeln!(out, "scale = {}", short(body.scale, 4));
    }
    out.push_str("\n[joints]\n");
    for joint in JOINTS.into_iter().filter(|j| !j.is_finger()) {
        let at = body.skeleton.position(joint).coords;
        let _ = writeln!(out, "{} = {}", joint.name(), triple(&at, 4));
    }
    body.primitives.iter().for_each(|p| primitive(&mut out, p));
    out
}

fn primitive(out: &mut String, p: &Primitive) {
    out.push_str("\n[[primitive]]\n");
    if !p.name.is_empty() {
        let _ = writeln!(out, "name = {}", quoted(&p.name));
    }
    let (center, axes, turn) = numbers(&p.state);
    let _ = write!(out, "joint = \"{}\"\ncenter = {center}\naxes = {axes}\nturn = {turn}\n", p.joint.name());
    if (p.weight - 1.0).abs() > 5e-4 {
        let _ = writeln!(out, "weight = {}", short(p.weight, 3));
    }
    if p.kind == Kind::Ellipsoid {
        out.push_str("kind = \"ellipsoid\"\n");
    }
    if p.groups != Groups::default().with(Group::of_joint(p.joint)) {
        let names: Vec<String> = p.groups.names().into_iter().map(|n| format!("\"{n}\"")).collect();
        let _ = writeln!(out, "groups = [{}]", names.join(", "));
    }
    if let Some(m) = &p.deform {
        let limits = Vector3::from(m.limits).map(f64::to_degrees);
        let state = |s: &State| {
            let (center, axes, turn) = numbers(s);
            let (own_center, _, own_turn) = numbers(&p.state);
            let center = if center == own_center { String::new() } else { format!("center = {center}, ") };
            let turn = if turn == own_turn { String::new() } else { format!(", turn = {turn}") };
            format!("{{ {center}axes = {axes}{turn} }}")
        };
        let _ = write!(
            out,
            "[primitive.muscle]\nreference = \"{}\"\naxis = {}\nlimits = {}\nmin = {}\nmax = {}\nblending = \"{}\"\n",
            m.reference.name(),
            triple(&m.axis, 4),
            triple(&limits, 1),
            state(&m.at_min),
            state(&m.at_max),
            m.blending
        );
    }
}

fn numbers(state: &State) -> (String, String, String) {
    let degrees = state.turn.map(f64::to_degrees);
    // an axis that would be rounded to nothing stays one that can be read
    let axes = (state.axes * 1e3).map(|a| a.max(0.1));
    (triple(&(state.center * 1e3), 1), triple(&axes, 1), triple(&degrees, 1))
}

fn triple(v: &Vector3<f64>, digits: usize) -> String {
    format!("[{}, {}, {}]", short(v.x, digits), short(v.y, digits), short(v.z, digits))
}

/// A number with at most `digits` decimals, as a TOML float.
fn short(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    let text = text.trim_end_matches('0');
    let text = if text.ends_with('.') { format!("{text}0") } else { text.to_string() };
    if text == "-0.0" { "0.0".into() } else { text }
}

/// A TOML string: what would end it or the line is escaped.
fn quoted(text: &str) -> String {
    let escaped: String = text
        .chars()
        .map(|c| match c {
            '"' | '\\' => format!("\\{c}"),
            c if c.is_control() => format!("\\u{:04X}", c as u32),
            c => c.to_string(),
        })
        .collect();
    format!("\"{escaped}\"")
}
