//! The figures of a running batch over HTTP, for a Prometheus on this machine: `GET /metrics`, and nothing else.

use std::{
    io::{self, Read, Write},
    net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream},
    path::Path,
    sync::{Arc, Mutex, PoisonError},
    thread,
    time::Duration,
};

use super::metrics::Metrics;
use crate::ArchiveError;

/// How long a client may take for its request, and for taking the answer.
const PATIENCE: Duration = Duration::from_secs(2);
/// The longest request that is read, bytes.
const LONGEST: usize = 8192;

/// A port that answers with the figures of a batch as long as the program runs.
#[derive(Debug)]
pub struct MetricsPort {
    /// Where it listens: this machine only.
    pub address: SocketAddr,
    metrics: Arc<Mutex<Metrics>>,
}

impl MetricsPort {
    /// Listens at a port of this machine; 0 takes any that is free.
    ///
    /// # Errors
    /// [`ArchiveError`] where another program has the port.
    pub fn open(port: u16) -> Result<Self, ArchiveError> {
        let wrong = |error: io::Error| {
            let reason = format!("cannot be listened at ({error}); give another --metrics-port, or 0 for any");
            ArchiveError::refused(Path::new(&format!("port {port}")), reason)
        };
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(wrong)?;
        let address = listener.local_addr().map_err(wrong)?;
        let metrics = Arc::new(Mutex::new(Metrics::default()));
        let shown = metrics.clone();
        // It ends with the program: what it waits for has no other end.
        thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                // A client that goes away is no failure of ours.
                drop(answer(stream, &shown));
            }
        });
        Ok(Self { address, metrics })
    }

    /// Shows these figures from now on.
    pub fn show(&self, metrics: &Metrics) {
        self.metrics.lock().unwrap_or_else(PoisonError::into_inner).clone_from(metrics);
    }
}

fn answer(mut stream: TcpStream, metrics: &Mutex<Metrics>) -> io::Result<()> {
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    let head = head_of(&mut stream)?;
    let (status, kind, body) = match head.lines().next().map(|line| line.split(' ').collect::<Vec<_>>()).as_deref() {
        Some(["GET", "/metrics", _]) => {
            let text = metrics.lock().unwrap_or_else(PoisonError::into_inner).text();
            ("200 OK", "text/plain; version=0.0.4; charset=utf-8", text)
        }
        _ => ("404 Not Found", "text/plain; charset=utf-8", "the figures are at /metrics\n".to_string()),
    };
    let length = body.len();
    write!(
        stream,
        "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n{body}"
    )?;
    stream.flush()
}

/// The request up to the empty line; what comes after is not for us.
fn head_of(stream: &mut TcpStream) -> io::Result<String> {
    let mut head = Vec::new();
    let mut piece = [0; 512];
    while head.len() < LONGEST && !head.windows(4).any(|four| four == b"\r\n\r\n") {
        match stream.read(&mut piece)? {
            0 => break,
            length => head.extend_from_slice(&piece[..length]),
        }
    }
    Ok(String::from_utf8_lossy(&head).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ask(address: SocketAddr, request: &str) -> String {
        let mut stream = TcpStream::connect(address).unwrap();
        stream.write_all(request.as_bytes()).unwrap();
        let mut text = String::new();
        stream.read_to_string(&mut text).unwrap();
        text
    }

    #[test]
    fn figures_are_served_to_this_machine_and_nothing_else_is() {
        let port = MetricsPort::open(0).unwrap();
        assert!(port.address.ip().is_loopback());
        port.show(&Metrics::new(7));
        let text = ask(port.address, "GET /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n");
        assert!(text.starts_with("HTTP/1.1 200 OK\r\n") && text.contains("\ntoile_batch_subjects_due 7\n"), "{text}");
        assert!(ask(port.address, "GET / HTTP/1.1\r\n\r\n").starts_with("HTTP/1.1 404"));
        assert!(ask(port.address, "POST /metrics HTTP/1.1\r\n\r\n").starts_with("HTTP/1.1 404"));
        let taken = MetricsPort::open(port.address.port()).unwrap_err().to_string();
        assert!(taken.contains("--metrics-port"), "{taken}");
    }
}
