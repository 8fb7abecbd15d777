//! Benchmarks of the fusion stage; cases are named stage/case/size.
fn main() {}
