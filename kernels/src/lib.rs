//! Traits that generated kernels implement, and the kernels generated from `laws/`.
