//! The generated WGSL: every law and pass is valid, within every device's limits, and binds what its `Shader` says.

use tensormass_kernels::generated::{NODE_PRODUCT, NODE_SUM};
use tensormass_kernels::laws;
use tensormass_kernels::shader::Shader;
use tensormass_testing::codegen::print::wgsl::is_free;
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

/// The names that a text declares for the whole module, but types, which begin with a capital letter.
fn declared(text: &str) -> impl Iterator<Item = &str> {
    text.lines().filter_map(|line| {
        let binding = line.strip_prefix("@group").and_then(|rest| Some(rest.split_once("> ")?.1));
        let name =
            binding.or_else(|| ["fn ", "override ", "struct "].iter().find_map(|word| line.strip_prefix(word)))?;
        name.split(['(', ':', ' ']).next().filter(|name| !name.starts_with(|c: char| c.is_ascii_uppercase()))
    })
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
            let what = format!("{}, {name}", law.info.name);
            check(&what, shader);
            for name in declared(shader.text) {
                assert!(!is_free(name), "{what}: a value could be named like `{name}`");
            }
        }
        let damping = law.damping.map(|d| [&d.shaders.damping, &d.shaders.ddamping, &d.shaders.diagonal]);
        for (name, shader) in ["damping", "ddamping", "diagonal"].iter().zip(damping.into_iter().flatten()) {
            let what = format!("{}, {name} of damping", law.info.name);
            check(&what, shader);
            for name in declared(shader.text) {
                assert!(!is_free(name), "{what}: a value could be named like `{name}`");
            }
        }
    }
}

#[test]
fn node_passes() {
    check("node_sum", &NODE_SUM);
    check("node_product", &NODE_PRODUCT);
}

#[test]
fn no_value_takes_a_word_of_the_language() {
    for word in wgsl::words() {
        assert!(!is_free(word), "`{word}` is taken");
    }
    for name in ["j", "w_j", "tr_a", "n00", "d0_n01", "volume_ratio"] {
        assert!(is_free(name), "`{name}` is free");
    }
}
