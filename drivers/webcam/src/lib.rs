//! Colour from any webcam through nokhwa.
