//! Values as USD text.

use std::fmt::Display;

use nalgebra::{Isometry3, Point3};

/// `[a, b, c]`.
pub(super) fn array(values: impl IntoIterator<Item = impl Display>) -> String {
    let mut out = String::from("[");
    for (i, value) in values.into_iter().enumerate() {
        out.push_str(if i == 0 { "" } else { ", " });
        out.push_str(&value.to_string());
    }
    out.push(']');
    out
}

/// `(a, b, c)`.
pub(super) fn tuple(values: impl IntoIterator<Item = impl Display>) -> String {
    let list = array(values);
    format!("({})", &list[1..list.len() - 1])
}

/// A string in quotes; what would end or steer it is written as an escape.
pub(super) fn string(value: &str) -> String {
    let escaped = |c: char| match c {
        '"' | '\\' => format!("\\{c}"),
        c if c.is_control() => " ".into(),
        c => c.to_string(),
    };
    format!("\"{}\"", value.chars().map(escaped).collect::<String>())
}

/// A transform as a matrix that acts on row vectors.
pub(super) fn matrix(a_from_b: &Isometry3<f64>) -> String {
    let matrix = a_from_b.to_homogeneous();
    tuple(matrix.column_iter().map(|column| tuple(column.iter())))
}

/// The lowest and the highest corner of the box around `points`.
pub(super) fn extent<'a>(points: impl Iterator<Item = &'a Point3<f32>>) -> String {
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for p in points {
        low = std::array::from_fn(|axis| low[axis].min(p[axis]));
        high = std::array::from_fn(|axis| high[axis].max(p[axis]));
    }
    array([tuple(low), tuple(high)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strings_cannot_end_early_and_matrices_have_their_place_last() {
        assert_eq!(string("a\"b\\\n"), r#""a\"b\\ ""#);
        let moved = Isometry3::translation(1.0, 2.0, 3.5);
        assert_eq!(matrix(&moved), "((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (1, 2, 3.5, 1))");
    }
}
