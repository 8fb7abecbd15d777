//! Depth cameras that speak UVC (Z16, Y16) through V4L2.
