//! Opening a bucket: the URL says which, the environment says how it is reached.

use std::{env, path::PathBuf, time::Duration};

use object_store::{
    ObjectStore, ObjectStoreScheme, RetryConfig, aws::AmazonS3Builder, aws::Checksum, azure::MicrosoftAzureBuilder,
    gcp::GoogleCloudStorageBuilder, path::Path as Key,
};
use url::Url;

use crate::ArchiveError;

/// How often the store's client repeats a request that failed, and for how long in all.
const RETRIES: usize = 8;
const RETRY_FOR: Duration = Duration::from_secs(90);
/// A take may take long to come, but something must come: no limit for the whole, one for every read.
const LIMITS: [(&str, &str); 2] = [("timeout", "7 days"), ("read_timeout", "60 s")];

/// A store, the prefix in it, and the URL for messages.
pub(super) struct Opened {
    pub(super) store: Box<dyn ObjectStore>,
    pub(super) prefix: Key,
    pub(super) name: String,
}

/// Opens a bucket by its URL; see [`Bucket::open`](super::Bucket::open).
pub(super) fn open(url: &str) -> Result<Opened, ArchiveError> {
    let name = url.split(['?', '#']).next().unwrap_or(url).to_string();
    let wrong = |reason: String| ArchiveError::refused(&PathBuf::from(&name), reason);
    let parsed = Url::parse(&name).map_err(|error| wrong(format!("is not a URL: {error}")))?;
    if !parsed.username().is_empty() || parsed.password().is_some() {
        let at = PathBuf::from(format!("{}://...", parsed.scheme()));
        let reason =
            "credentials do not belong in a URL: give them in the environment (AWS_ACCESS_KEY_ID and the like)";
        return Err(ArchiveError::refused(&at, reason));
    }
    if parsed.host_str().is_none_or(str::is_empty) {
        return Err(wrong("names no bucket; write s3://BUCKET/PREFIX".into()));
    }
    // The first bucket of the process says which cryptography is used; ours is the only one that is built in.
    drop(rustls::crypto::ring::default_provider().install_default());
    let (scheme, prefix) = ObjectStoreScheme::parse(&parsed).map_err(|error| wrong(error.to_string()))?;
    let store = build(&scheme, &parsed).map_err(|error| wrong(error.to_string()))?;
    Ok(Opened { store, prefix, name })
}

fn build(scheme: &ObjectStoreScheme, url: &Url) -> object_store::Result<Box<dyn ObjectStore>> {
    let retry = || RetryConfig { max_retries: RETRIES, retry_timeout: RETRY_FOR, ..RetryConfig::default() };
    match scheme {
        ObjectStoreScheme::AmazonS3 => {
            let plain = AmazonS3Builder::new().with_url(url.as_str()).with_retry(retry());
            let plain = plain.with_checksum_algorithm(Checksum::SHA256);
            let set = |built: AmazonS3Builder, (key, value): (String, String)| match key.parse() {
                Ok(key) => built.with_config(key, value),
                Err(_) => built,
            };
            Ok(Box::new(options("AWS_").fold(plain, set).build()?))
        }
        ObjectStoreScheme::GoogleCloudStorage => {
            let plain = GoogleCloudStorageBuilder::new().with_url(url.as_str()).with_retry(retry());
            let set = |built: GoogleCloudStorageBuilder, (key, value): (String, String)| match key.parse() {
                Ok(key) => built.with_config(key, value),
                Err(_) => built,
            };
            Ok(Box::new(options("GOOGLE_").fold(plain, set).build()?))
        }
        _ => {
            let plain = MicrosoftAzureBuilder::new().with_url(url.as_str()).with_retry(retry());
            let set = |built: MicrosoftAzureBuilder, (key, value): (String, String)| match key.parse() {
                Ok(key) => built.with_config(key, value),
                Err(_) => built,
            };
            Ok(Box::new(options("AZURE_").fold(plain, set).build()?))
        }
    }
}

/// Our limits, and then what the environment says for a provider: its variables, as the names of options are written.
fn options(prefix: &'static str) -> impl Iterator<Item = (String, String)> {
    let limits = LIMITS.iter().map(|(key, value)| ((*key).to_string(), (*value).to_string()));
    let given = env::vars().filter(move |(key, _)| key.starts_with(prefix));
    limits.chain(given.map(|(key, value)| (key.to_ascii_lowercase(), value)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(url: &str) -> String {
        open(url).err().map(|error| error.to_string()).unwrap_or_default()
    }

    #[test]
    fn credentials_in_a_url_are_refused_without_being_said() {
        let said = message("s3://me:secret@bucket/x");
        assert!(said.contains("environment") && !said.contains("secret"), "{said}");
    }

    #[test]
    fn what_is_no_bucket_is_refused() {
        assert!(message("s3:///x").contains("names no bucket"));
        assert!(message("s3").contains("is not a URL"));
        assert!(open("s3://bucket/a/b?token=1").is_ok_and(|opened| opened.name == "s3://bucket/a/b"));
    }
}
