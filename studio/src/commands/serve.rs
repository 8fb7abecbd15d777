//! `toile serve`: the archive in the browser.

use std::{
    io::{self, Write},
    net::{IpAddr, Ipv4Addr, SocketAddr},
    path::PathBuf,
};

use toile_capture::printable_path;
use toile_service::{Access, Listening, has_console, random_hex, serve};

use crate::{StudioError, outcome::Answer, session::Session};

const AFTER: &str = "\
The first line on standard output is the address to open in a browser. Only this machine can reach it, unless --listen says
otherwise: then a token is needed, which is printed once, as a part of the address. Ctrl-C ends the service; a take that is
being recorded is ended whole, and jobs go on when the service comes back. docs/service.md says what is promised.

Examples:
  toile serve archive
  toile serve archive --port 8000
  toile serve archive --listen 192.168.0.4 --port 8443 --tls-cert studio.pem --tls-key studio.key";

/// The port where none is given.
pub const PORT: u16 = 8717;

/// Serve an archive of subjects to the browser: scan, process, look, correct
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER)]
pub struct Serve {
    /// The folder of subjects; created where it is missing
    archive: PathBuf,
    /// The port; 0 takes any that is free
    #[arg(long, value_name = "N", default_value_t = PORT)]
    port: u16,
    /// An address of this machine that others may reach, instead of loopback; who asks must show a token then
    #[arg(long, value_name = "ADDR")]
    listen: Option<IpAddr>,
    /// Another name by which this machine is called, besides its host name and addresses
    #[arg(long, value_name = "HOST", requires = "listen")]
    name: Vec<String>,
    /// Encrypt with this certificate (PEM)
    #[arg(long, value_name = "FILE", requires = "tls_key")]
    tls_cert: Option<PathBuf>,
    /// The key of the certificate (PEM)
    #[arg(long, value_name = "FILE", requires = "tls_cert")]
    tls_key: Option<PathBuf>,
}

impl Serve {
    /// Runs the command, until the program is told to end.
    ///
    /// # Errors
    /// [`StudioError`] where the archive, the address, or the certificate cannot be used.
    pub fn run(&self, session: &Session) -> Result<Answer, StudioError> {
        let wrong = |error: &dyn std::fmt::Display| StudioError::refused(&self.archive, error.to_string());
        let is_tls = self.tls_cert.is_some();
        let reaching = self.listen.filter(|address| !address.is_loopback());
        let token = reaching.map(|_| random_hex(32)).transpose().map_err(|error| wrong(&error))?;
        let access = match &token {
            Some(token) => Access::with_token(token.clone(), self.names(), is_tls),
            None => Access { is_tls, ..Access::loopback() },
        };
        let listening = Listening {
            address: self.listen.unwrap_or(Ipv4Addr::LOCALHOST.into()),
            port: self.port,
            tls: self.tls_cert.clone().zip(self.tls_key.clone()),
        };
        let ready = |address: SocketAddr| {
            let scheme = if is_tls { "https" } else { "http" };
            let token = token.as_ref().map_or_else(String::new, |token| format!("?token={token}"));
            let mut out = io::stdout().lock();
            // A reader that went away is not a failure of ours.
            drop(writeln!(out, "{scheme}://{address}/{token}").and_then(|()| out.flush()));
            session.progress.say(&format!("serving {}; Ctrl-C ends", printable_path(&self.archive)));
            if !has_console() {
                session.progress.say("this program was built without its console; `make` builds both");
            }
        };
        // The sentence names the archive, the address or the file by itself.
        serve(&self.archive, access, &listening, ready).map_err(StudioError::Service)?;
        Ok(Answer::default())
    }

    /// How this machine may be called.
    fn names(&self) -> Vec<String> {
        let own = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
        self.name.iter().cloned().chain([own.trim().to_string()]).filter(|name| !name.is_empty()).collect()
    }
}
