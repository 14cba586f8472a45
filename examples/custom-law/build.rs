//! Generates the kernels of every law in this crate's `laws/`.

fn main() {
    tensormass_codegen::build("laws");
}
