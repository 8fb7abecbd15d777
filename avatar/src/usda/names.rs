//! Names of prims: letters, digits and `_`, no digit first, each once.

use std::collections::BTreeSet;

/// The names that are taken.
#[derive(Default)]
pub(super) struct Names(BTreeSet<String>);

impl Names {
    /// A name for a prim that comes nearest to `name` and is free; now it is taken.
    pub fn take(&mut self, name: &str) -> String {
        let plain = identifier(name);
        let numbered = (2..).map(|n: usize| format!("{plain}_{n}"));
        let free = std::iter::once(plain.clone()).chain(numbered).find(|candidate| !self.0.contains(candidate));
        let free = free.unwrap_or(plain);
        self.0.insert(free.clone());
        free
    }
}

/// `name` with `_` in place of what a name of USD cannot have; `01-top` becomes `_01_top`.
pub(super) fn identifier(name: &str) -> String {
    let plain: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    if plain.starts_with(|c: char| c.is_ascii_digit()) || plain.is_empty() { format!("_{plain}") } else { plain }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_is_allowed_and_comes_once() {
        let mut names = Names::default();
        let taken = ["01-top", "01 top", "_01_top", "Müller", ""].map(|name| names.take(name));
        assert_eq!(taken, ["_01_top", "_01_top_2", "_01_top_3", "M_ller", "_"]);
    }
}
