//! What went wrong at a store, in a clause for people, without the request that it happened to: that may be signed.

use object_store::Error;

/// What an error means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Meaning {
    Denied,
    Unknown,
    Missing,
    Replaced,
    NoCredentials,
    Other,
}

/// The clause for an error.
pub(super) fn told(error: &Error) -> String {
    match meaning(error) {
        Meaning::Denied => {
            "the store does not allow it: these credentials lack the right to list, read or write here".into()
        }
        Meaning::Unknown => "the store does not know these credentials".into(),
        Meaning::Missing => "there is no such bucket or object".into(),
        Meaning::Replaced => "was replaced while it was fetched; run the batch again".into(),
        Meaning::NoCredentials => {
            "there are no credentials: the environment has none (AWS_ACCESS_KEY_ID and the like; docs/archives.md), and this machine has no role"
                .into()
        }
        Meaning::Other => format!("the store did not answer as it should, however often it was asked: {}", last(error)),
    }
}

/// True for what another try will not change.
pub(super) fn is_final(error: &Error) -> bool {
    matches!(error, Error::InvalidPath { .. } | Error::NotSupported { .. }) || meaning(error) != Meaning::Other
}

fn meaning(error: &Error) -> Meaning {
    match (error, status(error)) {
        (Error::PermissionDenied { .. }, _) | (_, Some(403)) => Meaning::Denied,
        (Error::Unauthenticated { .. }, _) | (_, Some(401)) => Meaning::Unknown,
        (Error::NotFound { .. }, _) | (_, Some(404)) => Meaning::Missing,
        (Error::Precondition { .. }, _) => Meaning::Replaced,
        _ if is_about_the_machine(error) => Meaning::NoCredentials,
        _ => Meaning::Other,
    }
}

/// The status that the store answered with: the client tells it in words where it has no variant for the request.
fn status(error: &Error) -> Option<u16> {
    causes(error).find_map(|text| text.split_once("status code: ")?.1.get(..3)?.parse().ok())
}

/// Where clouds tell their machines who they are: asked only where the environment has no credentials.
const MACHINE: [&str; 2] = ["169.254.169.254", "metadata.google.internal"];

fn is_about_the_machine(error: &Error) -> bool {
    let all: String = causes(error).collect::<Vec<_>>().join(" ");
    MACHINE.iter().any(|host| all.contains(host))
}

/// The last cause, without URLs and without the store's own page about it.
fn last(error: &Error) -> String {
    let text = causes(error).last().unwrap_or_default();
    let plain =
        ["http://", "https://", "<"].iter().fold(text.as_str(), |text, end| text.split(end).next().unwrap_or(""));
    let line = plain.lines().next().unwrap_or_default();
    line.chars().take(200).collect::<String>().trim_end_matches([' ', ':', '(']).to_string()
}

fn causes(error: &Error) -> impl Iterator<Item = String> {
    let first: Option<&dyn std::error::Error> = Some(error);
    std::iter::successors(first, |error| error.source()).map(ToString::to_string)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn generic(source: &str) -> Error {
        Error::Generic { store: "S3", source: source.into() }
    }

    #[test]
    fn requests_are_not_repeated_to_people() {
        let said = told(&generic("error sending to https://a/b?sig=secret"));
        assert!(said.ends_with("error sending to") && !said.contains("secret"), "{said}");
    }

    #[test]
    fn a_status_in_words_is_understood_and_the_page_is_not_told() {
        let answered = |status: &str| format!("Server returned non-2xx status code: {status}: <Key>secret</Key>");
        assert!(told(&generic(&answered("403 Forbidden"))).contains("does not allow it"));
        assert!(told(&generic(&answered("404 Not Found"))).contains("no such bucket"));
        let said = told(&generic(&answered("500 Internal Server Error")));
        assert!(said.ends_with("500 Internal Server Error") && !is_final(&generic(&answered("500 X"))), "{said}");
        assert!(is_final(&generic(&answered("403 Forbidden"))));
    }

    #[test]
    fn missing_credentials_are_named() {
        assert!(told(&generic("no answer from http://169.254.169.254/latest")).contains("no credentials"));
    }
}
