//! Shape and pose of the statistical body from a scan, weights onto scans, measurements, posing under clothes.
