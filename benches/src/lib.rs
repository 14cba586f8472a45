//! Holds the benchmarks in `benches/`; nothing else is here.
