//! The kind of garment that a layer is: one type for all stages.
//!
//! `subject.toml` holds a layer's type as text, which `capture` neither reads nor changes (it knows no garments); the
//! command line and the pipeline parse it once, here.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};

/// The kinds of garments that stages treat differently; everything else is [`Self::Other`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GarmentType {
    /// T-shirt, shirt, blouse, pullover, vest.
    Top,
    /// Trousers, jeans, shorts, leggings: each leg by itself.
    Trousers,
    /// Skirt: hangs from the waist around both legs.
    Skirt,
    /// Dress: torso and legs in one.
    Dress,
    /// Jacket, coat: open in front or thick.
    Jacket,
    /// Hat, cap, helmet: on the head.
    Hat,
    /// Shoes, boots, socks: on both feet.
    Shoes,
    /// Anything else: scarf, bag, gloves.
    Other,
}

/// Words by which people call the types; the first of each is the type's own name.
const WORDS: [(GarmentType, &[&str]); 8] = [
    (
        GarmentType::Top,
        &["top", "tshirt", "t-shirt", "shirt", "blouse", "pullover", "sweater", "jumper", "hoodie", "vest", "polo"],
    ),
    (GarmentType::Trousers, &["trousers", "pants", "jeans", "shorts", "leggings", "chinos"]),
    (GarmentType::Skirt, &["skirt", "kilt"]),
    (GarmentType::Dress, &["dress", "gown"]),
    (GarmentType::Jacket, &["jacket", "coat", "blazer", "parka", "anorak", "cardigan"]),
    (GarmentType::Hat, &["hat", "cap", "beanie", "helmet", "headscarf"]),
    (GarmentType::Shoes, &["shoes", "boots", "sneakers", "trainers", "sandals", "slippers", "socks"]),
    (GarmentType::Other, &["other", "scarf", "bag", "belt", "gloves"]),
];

impl GarmentType {
    /// The name on the command line, in `subject.toml` and in reports.
    pub fn name(self) -> &'static str {
        WORDS.iter().find(|(kind, _)| *kind == self).map_or("other", |(_, words)| words[0])
    }

    /// The type that a word in a layer's name stands for, such as `blue-jeans`; `None` where no word is known.
    pub fn from_layer_name(name: &str) -> Option<Self> {
        let name = name.to_ascii_lowercase();
        let parts: Vec<&str> = name.split(|c: char| !c.is_ascii_alphabetic()).collect();
        let known = |word: &&str| name == *word || parts.contains(word);
        WORDS.iter().find(|(_, words)| words.iter().any(&known)).map(|(kind, _)| *kind)
    }
}

impl fmt::Display for GarmentType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for GarmentType {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let lower = text.trim().to_ascii_lowercase();
        let known = WORDS.iter().find(|(_, words)| words.contains(&lower.as_str()));
        known.map(|(kind, _)| *kind).ok_or_else(|| {
            let names: Vec<_> = WORDS.iter().map(|(kind, _)| kind.name()).collect();
            format!("`{text}` is not a garment type; choose one of {}", names.join(", "))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_parse_and_print() {
        for (kind, words) in WORDS {
            assert_eq!(kind.to_string().parse(), Ok(kind));
            assert!(words.iter().all(|word| word.parse() == Ok(kind)), "{kind}");
            assert_eq!(serde_json::to_string(&kind).unwrap(), format!("\"{kind}\""));
        }
        assert!("toga".parse::<GarmentType>().unwrap_err().contains("trousers"));
    }

    #[test]
    fn layer_names_give_types() {
        assert_eq!(GarmentType::from_layer_name("Blue-jeans"), Some(GarmentType::Trousers));
        assert_eq!(GarmentType::from_layer_name("t-shirt"), Some(GarmentType::Top));
        assert_eq!(GarmentType::from_layer_name("jacket2"), Some(GarmentType::Jacket));
        assert_eq!(GarmentType::from_layer_name("overalls"), None);
        assert_eq!(" Skirt ".parse(), Ok(GarmentType::Skirt));
    }
}
