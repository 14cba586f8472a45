//! Generates the kernels of every law in laws/.

fn main() {}
