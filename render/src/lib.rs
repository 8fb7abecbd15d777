//! One small CPU rasteriser for reports, sensors and tests.
