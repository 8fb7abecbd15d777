//! Errors of avatars.

/// Errors of the avatar crate.
#[derive(Debug, thiserror::Error)]
pub enum AvatarError {
    /// A layer that cannot be written.
    #[error("layer `{layer}`: {reason}")]
    Layer {
        /// The layer's name.
        layer: String,
        /// The reason.
        reason: String,
    },
    /// Skeleton or pose are not usable.
    #[error("skeleton: {0}")]
    Skeleton(String),
    /// A motion that cannot be written.
    #[error("motion `{motion}`: {reason}")]
    Motion {
        /// The motion's name.
        motion: String,
        /// The reason.
        reason: String,
    },
    /// Helper joints that do not fit the avatar or each other.
    #[error("helper joints: {0}")]
    Helpers(String),
    /// Spring bones that do not fit the avatar or have no meaning.
    #[error("spring bones: {0}")]
    Springs(String),
    /// The avatar as a whole, or its meta data.
    #[error("avatar: {0}")]
    Avatar(String),
}

impl AvatarError {
    pub(crate) fn layer(layer: &str, reason: impl Into<String>) -> Self {
        Self::Layer { layer: layer.into(), reason: reason.into() }
    }
}
