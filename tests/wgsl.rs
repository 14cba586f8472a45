//! The generated WGSL: every law and pass is valid, within every device's limits, and binds what its `Shader` says.

use tensormass_kernels::generated::tetrahedron_p1::{NODE_PRODUCT, NODE_SUM};
use tensormass_kernels::laws;
use tensormass_kernels::shader::Shader;
use tensormass_testing::wgsl;

/// `SlotIndex` is `slot_index` in the text.
fn snake_case(name: &str) -> String {
    let mut out = String::new();
    for c in name.chars() {
        if c.is_ascii_uppercase() && !out.is_empty() {
            out.push('_');
        }
        out.push(c.to_ascii_lowercase());
    }
    out
}

fn check(what: &str, shader: &Shader) {
    let bound = match wgsl::check(shader.text) {
        Ok(bound) => bound,
        Err(refusal) => panic!("{what}: {refusal:?}\n{}", shader.text),
    };
    assert_eq!(bound.len(), shader.bindings.len(), "{what}: {bound:?} against {:?}", shader.bindings);
    for (found, expected) in bound.iter().zip(shader.bindings) {
        assert_eq!(found.name, snake_case(&format!("{expected:?}")), "{what}");
        assert_eq!(found.uniform, expected.is_uniform(), "{what}, {expected:?}: uniform");
        assert_eq!(found.written, expected.is_written(), "{what}, {expected:?}: written");
        assert!(found.used, "{what}, {expected:?}: bound and not used");
    }
    assert!(bound[0].uniform && bound[1..].iter().all(|b| !b.uniform), "{what}: the uniform is binding 0");
}

#[test]
fn element_passes_of_every_law() {
    for law in laws() {
        let s = law.shaders;
        let passes = [&s.energy, &s.force, &s.dforce, &s.diagonal, &s.cauchy];
        for (name, shader) in ["energy", "force", "dforce", "diagonal", "cauchy"].iter().zip(passes) {
            check(&format!("{}, {name}", law.info.name), shader);
        }
    }
}

#[test]
fn node_passes() {
    check("node_sum", &NODE_SUM);
    check("node_product", &NODE_PRODUCT);
}
