//! USB: what is plugged in, at which speed, and the permission to use it.
