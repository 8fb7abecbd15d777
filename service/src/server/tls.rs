//! Certificate and key for encrypted connections.

use std::{fmt::Display, path::Path, sync::Arc};

use tokio_rustls::{
    TlsAcceptor,
    rustls::{
        ServerConfig,
        crypto::ring,
        pki_types::{CertificateDer, PrivateKeyDer, pem::PemObject},
    },
};

use crate::error::ServiceError;

/// What encrypts connections with these PEM files.
///
/// # Errors
/// [`ServiceError::Tls`] names the file that cannot be used.
pub fn acceptor(certificate: &Path, key: &Path) -> Result<TlsAcceptor, ServiceError> {
    let wrong = |path: &Path, reason: &dyn Display| ServiceError::Tls {
        path: path.to_path_buf(),
        reason: format!("{reason}; a PEM file is needed"),
    };
    let chain: Vec<CertificateDer> = CertificateDer::pem_file_iter(certificate)
        .and_then(Iterator::collect)
        .map_err(|error| wrong(certificate, &error))?;
    let secret = PrivateKeyDer::from_pem_file(key).map_err(|error| wrong(key, &error))?;
    let config = ServerConfig::builder_with_provider(Arc::new(ring::default_provider()))
        .with_safe_default_protocol_versions()
        .and_then(|builder| builder.with_no_client_auth().with_single_cert(chain, secret))
        .map_err(|error| wrong(certificate, &error))?;
    Ok(TlsAcceptor::from(Arc::new(config)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_that_are_no_certificate_are_named() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("certificate.pem");
        let said = |certificate: &Path| acceptor(certificate, certificate).err().unwrap().to_string();
        assert!(said(&file).contains("certificate.pem"));
        std::fs::write(&file, "nothing").unwrap();
        assert!(said(&file).contains("PEM"));
    }
}
