//! The next garment layer from the next scan: labels, cut, un-pose, stack without penetration.
