//! Frame numbers for people.

/// Numbers for people: ranges where they follow each other, the first few of many.
pub(crate) fn number_list(numbers: &[u64]) -> String {
    let mut ranges: Vec<(u64, u64)> = Vec::new();
    for &number in numbers {
        match ranges.last_mut() {
            Some((_, last)) if last.checked_add(1) == Some(number) => *last = number,
            _ => ranges.push((number, number)),
        }
    }
    let text = |&(first, last): &(u64, u64)| if first == last { first.to_string() } else { format!("{first}-{last}") };
    let shown: Vec<String> = ranges.iter().take(8).map(text).collect();
    let more = if ranges.len() > shown.len() { ", ..." } else { "" };
    format!("{}{more}", shown.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_listed_as_ranges() {
        assert_eq!(number_list(&[3, 4, 5, 9]), "3-5, 9");
        assert_eq!(number_list(&[u64::MAX]), u64::MAX.to_string());
        assert!(number_list(&(0..40).map(|i| 2 * i).collect::<Vec<_>>()).ends_with(", ..."));
    }
}
