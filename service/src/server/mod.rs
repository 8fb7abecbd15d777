//! Listening: connections, their limits, and encryption.

mod patience;
mod tls;

use std::{
    io,
    net::{IpAddr, Ipv4Addr, SocketAddr},
    path::{Path, PathBuf},
    pin::pin,
    sync::{Arc, atomic::Ordering},
    time::Duration,
};

use axum::{Router, body::Body, extract::Request};
use hyper::body::Incoming;
use hyper_util::rt::{TokioIo, TokioTimer};
use tokio::{
    io::{AsyncRead, AsyncWrite},
    net::{TcpListener, TcpStream},
    signal::{
        ctrl_c,
        unix::{SignalKind, signal},
    },
    sync::watch,
    time::{sleep, timeout},
};
use tokio_rustls::TlsAcceptor;
use tower::ServiceExt;

use self::patience::Patient;
use crate::{access::Access, app::app, error::ServiceError, limits::Share, metrics::Counted, service::Service};

/// Connections at the same time; more are closed at once.
const MOST_CONNECTIONS: u64 = 512;
/// The head of a request must come within this time, and an encrypted connection be made.
const HEAD_WITHIN: Duration = Duration::from_secs(10);
/// After the end was asked for, requests have this long to be answered.
const LAST_ANSWERS: Duration = Duration::from_secs(2);

/// Where to listen.
#[derive(Debug, Clone)]
pub struct Listening {
    /// The address; loopback where nothing else was asked for.
    pub address: IpAddr,
    /// The port; 0 for any that is free.
    pub port: u16,
    /// Certificate and key (PEM files), where connections are to be encrypted.
    pub tls: Option<(PathBuf, PathBuf)>,
}

impl Default for Listening {
    fn default() -> Self {
        Self { address: Ipv4Addr::LOCALHOST.into(), port: 0, tls: None }
    }
}

/// A server that listens already.
pub struct Server {
    listener: TcpListener,
    tls: Option<TlsAcceptor>,
}

impl Server {
    /// Begins to listen; connections wait until [`Self::run`].
    ///
    /// # Errors
    /// [`ServiceError`] where the port is taken or may not be used, or certificate and key are not.
    pub async fn bind(listening: &Listening) -> Result<Self, ServiceError> {
        let tls = listening.tls.as_ref().map(|(certificate, key)| tls::acceptor(certificate, key)).transpose()?;
        let address = SocketAddr::new(listening.address, listening.port);
        let listener = TcpListener::bind(address).await.map_err(|error| ServiceError::Address {
            reason: match error.kind() {
                io::ErrorKind::AddrInUse => {
                    "another program listens on this port; choose another with --port, or --port 0 for any".into()
                }
                io::ErrorKind::PermissionDenied => {
                    "this port may not be used; choose one above 1023 with --port".into()
                }
                io::ErrorKind::AddrNotAvailable => "this machine does not have this address; see --listen".into(),
                _ => error.to_string(),
            },
            address,
        })?;
        Ok(Self { listener, tls })
    }

    /// The address that it listens on.
    ///
    /// # Errors
    /// The system's error.
    pub fn address(&self) -> Result<SocketAddr, ServiceError> {
        Ok(self.listener.local_addr()?)
    }

    /// Answers requests until `end`; then what runs is ended whole.
    pub async fn run(self, service: Service, end: impl Future<Output = ()>) {
        let app = app(service.clone());
        let (closing, closes) = watch::channel(());
        let mut end = pin!(end);
        loop {
            let accepted = tokio::select! {
                accepted = self.listener.accept() => accepted,
                () = &mut end => break,
            };
            let Ok((stream, _)) = accepted else {
                // Out of files, most likely: it passes when connections end.
                sleep(Duration::from_millis(100)).await;
                continue;
            };
            let Some(counted) = Counted::within(&service.metrics.connections, MOST_CONNECTIONS) else {
                service.metrics.connections_refused.fetch_add(1, Ordering::Relaxed);
                continue;
            };
            let (app, tls, closes) = (app.clone(), self.tls.clone(), closes.clone());
            tokio::spawn(async move {
                let _counted = counted;
                connect(stream, app, tls, closes).await;
            });
        }
        drop(self.listener);
        let ended = service.clone();
        drop(tokio::task::spawn_blocking(move || ended.end()).await);
        drop(closes);
        // Nobody is left to hear it where no connection is open.
        let _ = closing.send(());
        drop(timeout(LAST_ANSWERS, closing.closed()).await);
    }
}

async fn connect(stream: TcpStream, app: Router, tls: Option<TlsAcceptor>, closes: watch::Receiver<()>) {
    drop(stream.set_nodelay(true));
    let stream = Patient::new(stream);
    match tls {
        None => answer(stream, app, closes).await,
        Some(tls) => {
            if let Ok(Ok(stream)) = timeout(HEAD_WITHIN, tls.accept(stream)).await {
                answer(stream, app, closes).await;
            }
        }
    }
}

/// Answers the requests of one connection.
async fn answer(
    stream: impl AsyncRead + AsyncWrite + Unpin + Send + 'static,
    app: Router,
    mut closes: watch::Receiver<()>,
) {
    let share = Arc::new(Share::default());
    let service = hyper::service::service_fn(move |request: hyper::Request<Incoming>| {
        let mut request: Request = request.map(Body::new);
        request.extensions_mut().insert(share.clone());
        app.clone().oneshot(request)
    });
    let mut http = hyper::server::conn::http1::Builder::new();
    http.timer(TokioTimer::new()).header_read_timeout(HEAD_WITHIN).max_buf_size(64 << 10);
    let mut connection = pin!(http.serve_connection(TokioIo::new(stream), service).with_upgrades());
    // A connection that breaks off is its caller's own affair.
    tokio::select! {
        ended = connection.as_mut() => drop(ended),
        _ = closes.changed() => {
            connection.as_mut().graceful_shutdown();
            drop(connection.await);
        }
    }
}

/// Opens an archive, listens, says where through `ready`, and answers until the program is told to end (Ctrl-C, SIGTERM).
///
/// # Errors
/// [`ServiceError`] where the archive, the address, or the certificate cannot be used.
pub fn serve(
    root: &Path,
    access: Access,
    listening: &Listening,
    ready: impl FnOnce(SocketAddr),
) -> Result<(), ServiceError> {
    let runtime = tokio::runtime::Builder::new_multi_thread().thread_name("http").enable_all().build()?;
    runtime.block_on(async {
        let server = Server::bind(listening).await?;
        let service = Service::open(root, access)?;
        let warmed = service.clone();
        // The first page shall not wait for what must be read of thousands of subjects.
        drop(tokio::task::spawn_blocking(move || drop(warmed.all_summaries())));
        ready(server.address()?);
        let mut terminated = signal(SignalKind::terminate())?;
        let end = async {
            tokio::select! {
                _ = ctrl_c() => {}
                _ = terminated.recv() => {}
            }
        };
        server.run(service, end).await;
        Ok(())
    })
}
