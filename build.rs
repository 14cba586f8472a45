//! Generates the kernels of every law in `laws/`.

fn main() {
    tensormass_codegen::build("laws");
}
