//! Files of a subject: read with ranges and tags, and never from outside its folder.

use std::{
    fs::File,
    io::{Read, Seek, SeekFrom},
    time::UNIX_EPOCH,
};

use axum::{
    body::{Body, Bytes},
    extract::{Path, Query, State},
    http::{HeaderMap, HeaderValue, StatusCode, header},
    response::{IntoResponse, Response},
};
use futures_util::stream;
use serde::Deserialize;
use utoipa::IntoParams;

use super::blocking::blocking;
use crate::{
    archive::open_inside,
    console::kind,
    error::{Refusal, Told},
    service::Service,
};

/// Bytes that are read at once.
const PIECE: u64 = 256 << 10;
/// Policy of pages that a subject's folder holds, such as the report: they show themselves, and nothing else.
const PAGE_POLICY: &str =
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; sandbox; frame-ancestors 'self'";

/// How a file is wanted.
#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
pub struct Wanted {
    /// `1`: to be kept under its name.
    pub download: Option<String>,
}

/// A file of a subject
#[utoipa::path(get, path = "/api/subjects/{id}/files/{way}", tag = "subjects", params(
    ("id" = String, Path, description = "Name of the subject's folder", example = "anna"),
    ("way" = String, Path, description = "The file's way from the subject's folder", example = "build/00-body/scan.ply"),
    Wanted), responses(
    (status = 200, description = "The file", content_type = "application/octet-stream"),
    (status = 206, description = "The part that `Range` asks for", content_type = "application/octet-stream"),
    (status = 304, description = "It is what `If-None-Match` names"),
    (status = 404, description = "There is no such file", body = Told),
    (status = 400, description = "The way is not UTF-8, or the query is wrong", body = Told),
    (status = 416, description = "The file is shorter than what `Range` asks for", body = Told)))]
pub async fn file(
    State(service): State<Service>,
    Path((id, way)): Path<(String, String)>,
    Query(wanted): Query<Wanted>,
    asked: HeaderMap,
) -> Result<Response, Refusal> {
    let name = way.rsplit('/').next().unwrap_or("file").to_string();
    let opened = blocking(&service, move |service| open(&service.archive.subject(&id)?, &way));
    let (file, length, tag) = opened.await?;
    let mut answer = answer(file, length, &tag, &asked)?;
    let headers = answer.headers_mut();
    let kind = kind(&name);
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(kind));
    headers.insert(header::ACCEPT_RANGES, HeaderValue::from_static("bytes"));
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("private, no-cache"));
    if kind.starts_with("text/html") || kind.starts_with("image/svg") {
        headers.insert(header::CONTENT_SECURITY_POLICY, HeaderValue::from_static(PAGE_POLICY));
    }
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "._- ".contains(c);
    if wanted.download.is_some() {
        let name: String = name.chars().map(|c| if is_plain(c) { c } else { '_' }).collect();
        if let Ok(value) = HeaderValue::from_str(&format!("attachment; filename=\"{name}\"")) {
            headers.insert(header::CONTENT_DISPOSITION, value);
        }
    }
    Ok(answer)
}

/// The file, its length, and a tag that changes whenever it does.
fn open(root: &std::path::Path, way: &str) -> Result<(File, u64, String), Refusal> {
    let missing = |_| Refusal::missing("there is no such file");
    let file = open_inside(root, way).map_err(missing)?;
    let about = file.metadata().map_err(missing)?;
    let time = about.modified().ok().and_then(|time| time.duration_since(UNIX_EPOCH).ok()).unwrap_or_default();
    Ok((file, about.len(), format!("\"{:x}-{:x}\"", about.len(), time.as_nanos())))
}

fn answer(file: File, length: u64, tag: &str, asked: &HeaderMap) -> Result<Response, Refusal> {
    let tag_value = HeaderValue::from_str(tag).map_err(|error| Refusal::failure(error.to_string()))?;
    let text = |name| asked.get(name).and_then(|value: &HeaderValue| value.to_str().ok());
    if text(header::IF_NONE_MATCH).is_some_and(|known| known.split(',').any(|known| known.trim() == tag)) {
        return Ok((StatusCode::NOT_MODIFIED, [(header::ETAG, tag_value)]).into_response());
    }
    let is_current = text(header::IF_RANGE).is_none_or(|known| known == tag);
    let range = text(header::RANGE).filter(|_| is_current).and_then(|range| part(range, length));
    let (status, from, to) = match range {
        None => (StatusCode::OK, 0, length),
        Some(Some((from, to))) => (StatusCode::PARTIAL_CONTENT, from, to),
        Some(None) => {
            let sentence = format!("the file has {length} bytes; the range lies outside");
            return Err(Refusal::new(StatusCode::RANGE_NOT_SATISFIABLE, sentence));
        }
    };
    let mut answer = (status, [(header::ETAG, tag_value)], pieces(file, from, to)).into_response();
    answer.headers_mut().insert(header::CONTENT_LENGTH, HeaderValue::from(to - from));
    if status == StatusCode::PARTIAL_CONTENT
        && let Ok(value) = HeaderValue::from_str(&format!("bytes {from}-{}/{length}", to - 1))
    {
        answer.headers_mut().insert(header::CONTENT_RANGE, value);
    }
    Ok(answer)
}

/// The single range of a `Range` header as first byte and end; `None` where the header is to be passed over (several ranges,
/// other units), `Some(None)` where it lies outside of the file.
fn part(range: &str, length: u64) -> Option<Option<(u64, u64)>> {
    let (from, to) = range.strip_prefix("bytes=")?.split_once('-')?;
    let (from, to) = (from.trim(), to.trim());
    let (from, end) = match (from.parse::<u64>(), to.parse::<u64>()) {
        (Ok(from), Ok(to)) if from <= to => (from, to.saturating_add(1).min(length)),
        (Ok(from), Err(_)) if to.is_empty() => (from, length),
        (Err(_), Ok(last)) if from.is_empty() => (length.saturating_sub(last), length),
        _ => return None,
    };
    Some((from < end).then_some((from, end)))
}

/// The bytes of a file, read piece by piece as fast as they are taken.
fn pieces(mut file: File, from: u64, to: u64) -> Body {
    let positioned = file.seek(SeekFrom::Start(from)).map(|_| file);
    let read = |state: Option<(File, u64)>| async move {
        let (mut file, left) = state.filter(|(_, left)| *left > 0)?;
        let piece = tokio::task::spawn_blocking(move || {
            let mut bytes = vec![0; left.min(PIECE) as usize];
            file.read_exact(&mut bytes).map(|()| (file, bytes))
        });
        match piece.await.map_err(std::io::Error::other).flatten() {
            Ok((file, bytes)) => {
                let left = left - bytes.len() as u64;
                Some((Ok(Bytes::from(bytes)), Some((file, left))))
            }
            Err(error) => Some((Err(error), None)),
        }
    };
    match positioned {
        Ok(file) => Body::from_stream(stream::unfold(Some((file, to - from)), read)),
        Err(_) => Body::empty(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_read_as_the_standard_has_them() {
        assert_eq!(part("bytes=0-0", 10), Some(Some((0, 1))));
        assert_eq!(part("bytes=2-", 10), Some(Some((2, 10))));
        assert_eq!(part("bytes=-3", 10), Some(Some((7, 10))));
        assert_eq!(part("bytes=-30", 10), Some(Some((0, 10))));
        assert_eq!(part("bytes=5-99", 10), Some(Some((5, 10))));
        assert_eq!(part("bytes=10-", 10), Some(None));
        assert_eq!(part("bytes=-0", 10), Some(None));
        assert_eq!(part("bytes=0-", 0), Some(None));
        for passed_over in ["bytes=5-2", "bytes=0-1,3-4", "lines=1-2", "bytes=x-y", "bytes=", "bytes=-"] {
            assert_eq!(part(passed_over, 10), None, "{passed_over}");
        }
        assert_eq!(part("bytes=0-18446744073709551615", 10), Some(Some((0, 10))));
    }
}
