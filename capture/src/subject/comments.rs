//! Comments of a TOML file that is written anew.

use std::collections::BTreeMap;

use toml::Table;

/// The header of a layer's table.
const LAYERS: &str = "[[layers]]";

/// Where a line stands: its table with the number of it, and its key.
type Place = (String, usize, String);

/// The comments of one line: whole lines above it, and what stands behind its value.
#[derive(Default)]
struct Comments {
    above: Vec<String>,
    behind: String,
}

/// `new` with the comments of `old`, each at the line of the same table and key; those of lines that are gone stand at the
/// end. `moved` says which layer of `new` a layer of `old` is (`None`: it is gone). `new` itself where the result would not
/// say the same, which several lines of text in one value can bring about.
pub(super) fn keep_comments(old: &str, new: &str, moved: impl Fn(usize) -> Option<usize>) -> String {
    let now = |(table, count, key): Place| match count.checked_sub(1).filter(|_| table == LAYERS) {
        Some(layer) => (table, moved(layer).map_or(usize::MAX, |layer| layer + 1), key),
        None => (table, count, key),
    };
    let mut comments: BTreeMap<Place, Comments> = read(old).into_iter().map(|(place, c)| (now(place), c)).collect();
    if comments.is_empty() {
        return new.to_string();
    }
    let mut text = String::new();
    for (place, line) in places(new) {
        let Comments { above, behind } = comments.remove(&place).unwrap_or_default();
        above.iter().for_each(|comment| text.push_str(&format!("{comment}\n")));
        let space = if behind.is_empty() { "" } else { " " };
        text.push_str(&format!("{line}{space}{behind}\n"));
    }
    for Comments { above, behind } in comments.into_values() {
        above.iter().chain([&behind]).filter(|c| !c.is_empty()).for_each(|c| text.push_str(&format!("{c}\n")));
    }
    let same =
        toml::from_str::<Table>(&text).is_ok_and(|kept| toml::from_str::<Table>(new).is_ok_and(|new| new == kept));
    if same { text } else { new.to_string() }
}

fn read(text: &str) -> BTreeMap<Place, Comments> {
    let (mut comments, mut above) = (BTreeMap::new(), Vec::new());
    for (place, line) in places(text) {
        if line.trim_start().starts_with('#') {
            above.push(line.to_string());
        } else if !line.trim().is_empty() {
            let behind = behind(line).to_string();
            if !above.is_empty() || !behind.is_empty() {
                comments.insert(place, Comments { above: std::mem::take(&mut above), behind });
            }
        }
    }
    if !above.is_empty() {
        comments.insert(("\u{10ffff}".into(), 0, String::new()), Comments { above, behind: String::new() });
    }
    comments
}

/// Every line with its place.
fn places(text: &str) -> impl Iterator<Item = (Place, &str)> {
    let (mut table, mut counts) = (String::new(), BTreeMap::<String, usize>::new());
    text.lines().map(move |line| {
        let words = line.trim();
        if words.starts_with('[') {
            table = words.split('#').next().unwrap_or_default().trim().to_string();
            *counts.entry(table.clone()).or_default() += 1;
        }
        let key = words.split('=').next().unwrap_or_default().trim();
        let key = if words.starts_with('[') || words.starts_with('#') { "" } else { key };
        ((table.clone(), counts.get(&table).copied().unwrap_or(0), key.to_string()), line)
    })
}

/// The comment behind a line's value: from the first `#` whose line before it is whole.
fn behind(line: &str) -> &str {
    let is_whole = |at: &usize| !line[..*at].trim().is_empty() && toml::from_str::<Table>(&line[..*at]).is_ok();
    line.match_indices('#').map(|(at, _)| at).find(is_whole).map_or("", |at| &line[at..])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_stay_at_their_lines_and_never_change_what_is_said() {
        let old = "# who\nname = \"a#b\" # the #1\n\n[[layers]] # first\nname = \"body\"\n# why\n[[layers]]\n\
                   # wool\nname = \"coat\"\nold = 1 # gone\n# end\n";
        let new = "name = \"a#b\"\nrig = \"\"\n\n[[layers]]\nname = \"body\"\n\n[[layers]]\nname = \"coat\"\n";
        let kept = keep_comments(old, new, Some);
        assert_eq!(
            kept,
            "# who\nname = \"a#b\" # the #1\nrig = \"\"\n\n[[layers]] # first\nname = \"body\"\n\n# why\n[[layers]]\n\
             # wool\nname = \"coat\"\n# gone\n# end\n"
        );
        assert_eq!(keep_comments(&kept, new, Some), kept);
        let tricky = "notes = \"\"\"\n# no comment\nname = 3 # nor this\n\"\"\"\n";
        assert_eq!(keep_comments(tricky, new, Some).parse::<Table>().unwrap(), new.parse::<Table>().unwrap());
        assert_eq!(keep_comments("name = 1", new, Some), new);
    }

    #[test]
    fn comments_go_with_their_layers() {
        let old = "[[layers]]\nname = \"body\" # 1\n# two\n[[layers]]\nname = \"a\"\n[[layers]]\nname = \"b\" # 3\n";
        let new = "[[layers]]\nname = \"b\"\n[[layers]]\nname = \"body\"\n";
        let kept = keep_comments(old, new, |layer| [Some(1), None, Some(0)][layer]);
        assert_eq!(kept, "[[layers]]\nname = \"b\" # 3\n[[layers]]\nname = \"body\" # 1\n# two\n");
    }
}
