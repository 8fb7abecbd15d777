//! Frames, rigs, calibration, the source trait, takes on disk: recording, replay, import, inspection.
