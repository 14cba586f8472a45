//! The generated WGSL: every law and pass is valid, within every device's limits, and binds what its `Shader` says.

use tensormass_kernels::shader::{
    Argument, Binding, DampingFunctions, PASSES, Pass, PointFunction, Shader, Unit, element_pass, node_product,
    node_sum,
};
use tensormass_kernels::{ElementEntry, elements, laws};
use tensormass_testing::codegen::print::wgsl::is_free;
use tensormass_testing::wgsl;

/// `ElementPass` is `element_pass` in the text.
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
    let bound = match wgsl::check(&shader.text) {
        Ok(bound) => bound,
        Err(refusal) => panic!("{what}: {refusal:?}\n{}", shader.text),
    };
    assert_eq!(bound.len(), shader.bindings.len(), "{what}: {bound:?} against {:?}", shader.bindings);
    for (found, expected) in bound.iter().zip(&shader.bindings) {
        assert_eq!(found.name, snake_case(&format!("{expected:?}")), "{what}");
        assert_eq!(found.uniform, expected.is_uniform(), "{what}, {expected:?}: uniform");
        assert_eq!(found.written, expected.is_written(), "{what}, {expected:?}: written");
        assert!(found.used, "{what}, {expected:?}: bound and not used");
    }
    assert!(bound[0].uniform && bound[1..].iter().all(|b| !b.uniform), "{what}: the uniform is binding 0");
}

/// What invocations of passes of an element compute.
fn units(element: &ElementEntry) -> &'static [Unit] {
    if element.info.is_linear_simplex { &[Unit::Element, Unit::Strip] } else { &[Unit::Element] }
}

/// Elements of which bodies can be made: faces have no strain.
#[test]
fn passes_of_every_law_on_every_element() {
    for law in laws() {
        for element in elements().iter().filter(|e| e.info.dimension > 1) {
            for (pass, unit) in PASSES.into_iter().flat_map(|pass| units(element).iter().map(move |unit| (pass, *unit)))
            {
                let Some(shader) = element_pass(law, element, pass, unit) else { continue };
                let what = format!("{}, {}, {pass:?}, {unit:?}", law.info.name, element.info.name);
                check(&what, &shader);
                for name in declared(&shader.text) {
                    assert!(!is_free(name), "{what}: a value could be named like `{name}`");
                }
            }
        }
    }
}

/// A damping that reads all there is takes as many buffers as every device has, the gate among them.
#[test]
fn damping_that_reads_everything() {
    let law = laws().iter().find(|law| law.damping.is_some()).expect("a law with a dissipation");
    let damping = law.damping.expect("it was asked for");
    let terms: Vec<String> = (0..9).map(|k| format!("c[0] * g[{k}] * gt[{k}] * dg[{k}]")).collect();
    let (count, terms) = (law.info.constants.len(), terms.join(", "));
    let tensors = "g: array<f32, 9>, gt: array<f32, 9>, dg: array<f32, 9>";
    let text = format!(
        "\nfn ddamping(c: array<f32, {count}>, {tensors}) -> array<f32, 9> {{\n    return array({terms});\n}}\n"
    );
    let arguments =
        &[Argument::Constants, Argument::DisplacementGradient, Argument::GradientRate, Argument::GradientIncrement];
    let ddamping = PointFunction { name: "ddamping", text: text.leak(), arguments, field: None };
    let functions = Box::leak(Box::new(DampingFunctions { ddamping, ..*damping.functions }));
    let (mut law, mut with) = (*law, damping);
    with.functions = functions;
    law.damping = Some(with);
    for element in elements().iter().filter(|e| e.info.dimension > 1) {
        for unit in units(element) {
            let shader = element_pass(&law, element, Pass::DDamping, *unit).expect("the law has a dissipation");
            check(&format!("damping that reads everything, {}, {unit:?}", element.info.name), &shader);
            assert_eq!(shader.bindings.len(), 9, "a uniform and eight buffers");
            assert!(shader.bindings.contains(&Binding::Gate));
        }
    }
}

#[test]
fn node_passes() {
    check("node_sum", &node_sum());
    check("node_product", &node_product());
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
