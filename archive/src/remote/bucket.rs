//! A bucket, or a part of it, and the few things that are done with it. All that waits for the network waits in here.

use std::{
    collections::BTreeMap,
    fs::File,
    io::{Read, Write},
    path::{Path, PathBuf},
    thread,
    time::Duration,
};

use futures_util::{StreamExt, TryStreamExt};
use object_store::{
    Error, GetOptions, GetRange, MultipartUpload, ObjectMeta, ObjectStore, ObjectStoreExt, PutPayload,
    path::Path as Key,
};
use rayon::{ThreadPool, ThreadPoolBuilder};
use toile_capture::files::atomic_write_with;
use tokio::runtime::{Builder, Runtime};

use super::{
    open,
    told::{is_final, told},
};
use crate::ArchiveError;

/// How often a transfer is begun again that broke off in the middle. A request that failed at once was repeated by the store's client
/// already, for a minute and a half at most.
const ATTEMPTS: u32 = 5;
/// The first pause between two tries; it doubles.
const PAUSE: Duration = Duration::from_millis(100);
/// Threads that wait for the network.
const THREADS: usize = 2;
/// Requests side by side: a store answers after some 50 ms, so that one after the other would be no more than 20 a second.
const SIDE_BY_SIDE: usize = 16;
/// A larger file is sent in parts of this length, bytes. S3 takes 10 000 parts, hence files up to 160 GB.
const PART: usize = 16 << 20;

/// A prefix in a bucket.
pub struct Bucket {
    store: Box<dyn ObjectStore>,
    prefix: Key,
    name: String,
    runtime: Runtime,
    pool: ThreadPool,
}

/// An object: its length, and the store's own mark of its content (an entity tag).
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Object {
    pub(super) bytes: u64,
    pub(super) mark: String,
}

impl Object {
    /// Length and mark for comparing: some answers put the mark into quotation marks, and some do not.
    pub(super) fn stamp(&self) -> (u64, String) {
        (self.bytes, self.mark.trim_matches('"').to_string())
    }
}

impl Bucket {
    /// Opens `s3://bucket/prefix`, `gs://bucket/prefix` or `az://container/prefix`. Nothing is sent yet.
    ///
    /// # Errors
    /// [`ArchiveError`] where the URL is none, carries credentials, or the environment lacks what the provider needs.
    pub fn open(url: &str) -> Result<Self, ArchiveError> {
        let open::Opened { store, prefix, name } = open::open(url)?;
        let wrong = |reason: String| ArchiveError::refused(&PathBuf::from(&name), reason);
        let runtime = Builder::new_multi_thread().worker_threads(THREADS).enable_all().build();
        let runtime = runtime.map_err(|error| wrong(error.to_string()))?;
        let pool = ThreadPoolBuilder::new().num_threads(SIDE_BY_SIDE).build();
        let pool = pool.map_err(|error| wrong(error.to_string()))?;
        Ok(Self { store, prefix, name, runtime, pool })
    }

    /// The URL, without what a URL may carry besides.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Works in a pool of threads that may all wait for the network.
    pub(crate) fn side_by_side<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        self.pool.install(work)
    }

    /// Every object below `folder` (all, where that is empty) by its path in it.
    pub(super) fn list(&self, folder: &str) -> Result<BTreeMap<String, Object>, ArchiveError> {
        let below = self.key(folder);
        let list = || self.runtime.block_on(self.store.list(Some(&below)).try_collect());
        let all: Vec<ObjectMeta> = self.again(folder, list)?;
        let entry = |meta: ObjectMeta| {
            let parts = meta.location.prefix_match(&below)?;
            let inside: Vec<String> = parts.map(|part| part.as_ref().to_string()).collect();
            Some((inside.join("/"), Object { bytes: meta.size, mark: mark(meta.e_tag) }))
        };
        Ok(all.into_iter().filter_map(entry).collect())
    }

    /// The content of a small object; `None` where there is none.
    pub(super) fn read(&self, path: &str) -> Result<Option<Vec<u8>>, ArchiveError> {
        let key = self.key(path);
        let get = || {
            self.runtime.block_on(async {
                match self.store.get(&key).await {
                    Ok(found) => found.bytes().await.map(|bytes| Some(bytes.to_vec())),
                    Err(Error::NotFound { .. }) => Ok(None),
                    Err(error) => Err(error),
                }
            })
        };
        self.again(path, get)
    }

    /// Brings an object into a file, which appears whole. A transfer that breaks off goes on where it was.
    pub(super) fn fetch_object(&self, path: &str, object: &Object, to: &Path) -> Result<(), ArchiveError> {
        let mut failed = None;
        let written = atomic_write_with(to, |file| {
            let mut at = 0;
            let result = self.again(path, || self.runtime.block_on(self.copy(path, object, &mut at, file)));
            match result {
                Ok(disk) => disk,
                Err(error) => {
                    failed = Some(error);
                    Err(std::io::Error::other("not fetched"))
                }
            }
        });
        failed.map_or_else(|| Ok(written?), Err)
    }

    /// Copies an object from the byte `at` on, and moves `at` along; the inner error is the disk's.
    async fn copy(
        &self,
        path: &str,
        object: &Object,
        at: &mut u64,
        to: &mut impl Write,
    ) -> object_store::Result<std::io::Result<()>> {
        if *at == object.bytes {
            return Ok(Ok(()));
        }
        let range = (*at > 0).then_some(GetRange::Offset(*at));
        let if_match = (!object.mark.is_empty()).then(|| object.mark.clone());
        let found =
            self.store.get_opts(&self.key(path), GetOptions { range, if_match, ..GetOptions::default() }).await?;
        let mut stream = found.into_stream();
        while let Some(bytes) = stream.next().await {
            let bytes = bytes?;
            if let Err(error) = to.write_all(&bytes) {
                return Ok(Err(error));
            }
            *at += bytes.len() as u64;
        }
        if *at == object.bytes {
            return Ok(Ok(()));
        }
        let source = format!("{at} of {} bytes came", object.bytes).into();
        Err(Error::Generic { store: "transfer", source })
    }

    /// Writes an object whole: readers see the old one or the new one. Answers its mark.
    pub(super) fn write(&self, path: &str, bytes: Vec<u8>) -> Result<String, ArchiveError> {
        let (key, payload) = (self.key(path), PutPayload::from(bytes));
        let put = || self.runtime.block_on(self.store.put(&key, payload.clone()));
        self.again(path, put).map(|done| mark(done.e_tag))
    }

    /// Sends a file, which appears whole. Answers its mark.
    pub(super) fn send(&self, path: &str, from: &Path) -> Result<String, ArchiveError> {
        let wrong = |error| ArchiveError::io(from, error);
        let mut file = File::open(from).map_err(wrong)?;
        let first = part_of(&mut file).map_err(wrong)?;
        if first.len() < PART {
            return self.write(path, first);
        }
        let key = self.key(path);
        let mut upload = self.again(path, || self.runtime.block_on(self.store.put_multipart(&key)))?;
        let sent = self.send_parts(path, &mut *upload, first, &mut || part_of(&mut file).map_err(wrong));
        if sent.is_err() {
            // What stays of it costs room until the bucket's own rules remove it; nobody sees it.
            drop(self.runtime.block_on(upload.abort()));
        }
        sent
    }

    fn send_parts(
        &self,
        path: &str,
        upload: &mut dyn MultipartUpload,
        mut part: Vec<u8>,
        next: &mut dyn FnMut() -> Result<Vec<u8>, ArchiveError>,
    ) -> Result<String, ArchiveError> {
        while !part.is_empty() {
            let sent = self.runtime.block_on(upload.put_part(PutPayload::from(part)));
            sent.map_err(|error| self.wrong(path, &error))?;
            part = next()?;
        }
        let done = self.runtime.block_on(upload.complete());
        done.map(|done| mark(done.e_tag)).map_err(|error| self.wrong(path, &error))
    }

    /// Removes an object; one that is not there counts as removed.
    pub(super) fn remove(&self, path: &str) -> Result<(), ArchiveError> {
        let key = self.key(path);
        let remove = || match self.runtime.block_on(self.store.delete(&key)) {
            Err(Error::NotFound { .. }) => Ok(()),
            other => other,
        };
        self.again(path, remove)
    }

    fn key(&self, path: &str) -> Key {
        let whole = format!("{}/{path}", self.prefix);
        // Paths come from the listing, and are taken as they are; what no listing gives is written so that a store takes it.
        Key::parse(&whole).unwrap_or_else(|_| Key::from(whole))
    }

    /// Tries a transfer until it is whole; what another try will not change is not tried again.
    fn again<T>(&self, path: &str, mut work: impl FnMut() -> object_store::Result<T>) -> Result<T, ArchiveError> {
        let mut pause = PAUSE;
        for _ in 1..ATTEMPTS {
            match work() {
                Ok(value) => return Ok(value),
                Err(error) if is_final(&error) => return Err(self.wrong(path, &error)),
                Err(_) => thread::sleep(pause),
            }
            pause *= 2;
        }
        work().map_err(|error| self.wrong(path, &error))
    }

    fn wrong(&self, path: &str, error: &Error) -> ArchiveError {
        let at = format!("{}/{path}", self.name.trim_end_matches('/'));
        ArchiveError::refused(Path::new(at.trim_end_matches('/')), told(error))
    }
}

/// The next part of a file, shorter at its end.
fn part_of(file: &mut File) -> std::io::Result<Vec<u8>> {
    let mut part = Vec::new();
    Read::by_ref(file).take(PART as u64).read_to_end(&mut part)?;
    Ok(part)
}

fn mark(e_tag: Option<String>) -> String {
    e_tag.unwrap_or_default()
}
