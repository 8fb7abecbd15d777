//! The `toile` program: command line, pipeline, reports.
