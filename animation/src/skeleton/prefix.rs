//! What programs write before all names of a skeleton: the actor, the rig, the exporter.

/// Share of the joints whose names start with it: a root or a helper may be called otherwise.
const SHARE: f64 = 0.75;

/// The longest beginning, up to a separator, that most of `names` have in common; empty where there is none.
pub(super) fn common<'a>(names: &[&'a str]) -> &'a str {
    let mut best = "";
    for name in names {
        for (at, separator) in name.char_indices().filter(|(_, c)| !c.is_alphanumeric()) {
            let prefix = &name[..at + separator.len_utf8()];
            let is_shared = || {
                let sharing = names.iter().filter(|n| n.len() > prefix.len() && n.starts_with(prefix)).count();
                sharing as f64 >= SHARE * names.len() as f64
            };
            if prefix.len() > best.len() && is_shared() {
                best = prefix;
            }
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_most_names_start_with_is_found() {
        let rig = ["RL_BoneRoot", "CC_Base_Hip", "CC_Base_L_Thigh", "CC_Base_R_Thigh", "CC_Base_Head"];
        assert_eq!(common(&rig), "CC_Base_");
        assert_eq!(common(&["Bob Smith:Hips", "Bob Smith:Head"]), "Bob Smith:");
        assert_eq!(common(&["left_hip", "right_hip", "left_knee", "right_knee"]), "");
        assert_eq!(common(&[]), "");
    }
}
