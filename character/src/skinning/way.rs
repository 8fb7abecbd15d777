//! How the motions of several joints are blended into that of a vertex.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};

/// How the motions of the joints that move a vertex are blended.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Skinning {
    /// The weighted sum of the joints' matrices (Hu et al. 2017, eq. 3): what every importer does. It shrinks what is twisted.
    #[default]
    Linear,
    /// The weighted sum of the matrices' logarithms (Magnenat-Thalmann et al. 2004, eq. 3; Alexa's operator): rigid for every vertex.
    Log,
    /// Linear where the axes of a vertex's joints agree, in log space where they do not (the same, section 4.2).
    Hybrid,
}

impl Skinning {
    /// All ways.
    pub const ALL: [Self; 3] = [Self::Linear, Self::Log, Self::Hybrid];

    /// Its name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Log => "log",
            Self::Hybrid => "hybrid",
        }
    }
}

impl fmt::Display for Skinning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Skinning {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Self::ALL
            .into_iter()
            .find(|way| way.name() == name)
            .ok_or_else(|| format!("{name:?} is no way of skinning; use linear, log or hybrid"))
    }
}
