//! Names that all stages after the cutting of garments share.

/// Name of a garment's vertex attribute: 1 where the cloth hangs free of the body, 0 where it lies close to it
/// (Hu et al. 2017, §6.2, part skirts and dresses in two for the animation).
pub const FREE_PART: &str = "free";
