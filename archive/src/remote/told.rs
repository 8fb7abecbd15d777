//! What went wrong at a store, in a clause for people, without the request that it happened to: that may be signed.

use object_store::Error;

/// The clause for an error.
pub(super) fn told(error: &Error) -> String {
    match error {
        Error::PermissionDenied { .. } => {
            "the store does not allow it: these credentials lack the right to list, read or write here".into()
        }
        Error::Unauthenticated { .. } => "the store does not know these credentials".into(),
        Error::NotFound { .. } => "there is no such bucket or object".into(),
        Error::Precondition { .. } => "was replaced while it was fetched; run the batch again".into(),
        other if is_about_the_machine(other) => {
            "there are no credentials: the environment has none (AWS_ACCESS_KEY_ID and the like; docs/archives.md), and this machine has no role"
                .into()
        }
        other => format!("the store did not answer as it should, however often it was asked: {}", last(other)),
    }
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
    let plain = text.split("http://").flat_map(|part| part.split("https://")).next().unwrap_or_default();
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
    fn missing_credentials_are_named() {
        assert!(told(&generic("no answer from http://169.254.169.254/latest")).contains("no credentials"));
    }
}
