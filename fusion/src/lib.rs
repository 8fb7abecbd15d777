//! Depth frames to a scan: filtering, tracking, loop closing, TSDF, surface extraction, clean-up.
