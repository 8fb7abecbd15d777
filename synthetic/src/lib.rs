//! A virtual dressed subject on a turning table, its sensor and its truth.
