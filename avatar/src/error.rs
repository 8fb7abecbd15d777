//! What can go wrong with an avatar.

/// Errors of the avatar crate.
#[derive(Debug, thiserror::Error)]
pub enum AvatarError {
    /// A layer that no file can be made of.
    #[error("layer `{layer}`: {reason}")]
    Layer {
        /// The layer's name.
        layer: String,
        /// What is wrong with it.
        reason: String,
    },
    /// Skeleton or pose are not usable.
    #[error("skeleton: {0}")]
    Skeleton(String),
    /// A motion that no clip can be made of.
    #[error("motion `{motion}`: {reason}")]
    Motion {
        /// The motion's name.
        motion: String,
        /// What is wrong with it.
        reason: String,
    },
    /// The avatar as a whole, or what is said about it.
    #[error("avatar: {0}")]
    Avatar(String),
}

impl AvatarError {
    pub(crate) fn layer(layer: &str, reason: impl Into<String>) -> Self {
        Self::Layer { layer: layer.into(), reason: reason.into() }
    }
}
