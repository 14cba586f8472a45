//! What generated WGSL binds: the generator's side of `tensormass_kernels::shader::Binding`, which says what each holds.

/// A binding; the kernels crate has the same variants and describes their layout.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)] // described where the kernels crate declares them
pub enum Binding {
    ElementPass,
    NodePass,
    Nodes,
    Rest,
    Constants,
    Displacement,
    Velocity,
    Increment,
    Slots,
    SlotIndex,
    Offsets,
    Margins,
    Energies,
    Stresses,
    Gate,
    Sum,
    Masses,
    Product,
    Partials,
}

/// Every binding, for tests and for the names that no value may take.
pub const BINDINGS: [Binding; 19] = [
    Binding::ElementPass,
    Binding::NodePass,
    Binding::Nodes,
    Binding::Rest,
    Binding::Constants,
    Binding::Displacement,
    Binding::Velocity,
    Binding::Increment,
    Binding::Slots,
    Binding::SlotIndex,
    Binding::Offsets,
    Binding::Margins,
    Binding::Energies,
    Binding::Stresses,
    Binding::Gate,
    Binding::Sum,
    Binding::Masses,
    Binding::Product,
    Binding::Partials,
];

const UNIFORM: &str = "var<uniform>";
const READ: &str = "var<storage, read>";
// One access for a binding in every pass: a bind group's layout states it, and one layout then fits all.
const WRITTEN: &str = "var<storage, read_write>";

impl Binding {
    /// The variable's name.
    pub fn variable(self) -> &'static str {
        self.parts().1
    }

    fn parts(self) -> (&'static str, &'static str, &'static str) {
        match self {
            Self::ElementPass => (UNIFORM, "element_pass", "ElementPass"),
            Self::NodePass => (UNIFORM, "node_pass", "NodePass"),
            Self::Nodes => (READ, "nodes", "array<vec4<u32>>"),
            Self::Rest => (READ, "rest", "array<vec4<f32>>"),
            Self::Constants => (READ, "constants", "array<f32>"),
            Self::Displacement => (READ, "displacement", "array<vec4<f32>>"),
            Self::Velocity => (READ, "velocity", "array<vec4<f32>>"),
            Self::Increment => (READ, "increment", "array<vec4<f32>>"),
            Self::Slots => (WRITTEN, "slots", "array<vec4<f32>>"),
            Self::SlotIndex => (READ, "slot_index", "array<vec4<u32>>"),
            Self::Offsets => (READ, "offsets", "array<u32>"),
            Self::Margins => (WRITTEN, "margins", "array<f32>"),
            Self::Energies => (WRITTEN, "energies", "array<f32>"),
            Self::Stresses => (WRITTEN, "stresses", "array<f32>"),
            Self::Gate => (READ, "gate", "array<f32>"),
            Self::Sum => (WRITTEN, "sum", "array<vec4<f32>>"),
            Self::Masses => (READ, "masses", "array<vec4<f32>>"),
            Self::Product => (WRITTEN, "product", "array<vec4<f32>>"),
            Self::Partials => (WRITTEN, "partials", "array<f32>"),
        }
    }
}

const ELEMENT_PASS: &str = "\
struct ElementPass {
    // Elements of the pass.
    elements: u32,
    unused_0: u32,
    unused_1: u32,
    unused_2: u32,
}

";

const NODE_PASS: &str = "\
struct NodePass {
    nodes: u32,
    // 1 where the pass is the first to write its product.
    first: u32,
    // The factor of the sum of slots.
    factor: f32,
    // The factor of the masses.
    mass_factor: f32,
}

";

/// Declares the bindings of a module, numbered from 0 in their order, and the uniform's structure.
pub fn declarations(bindings: &[Binding]) -> String {
    let mut out = String::new();
    for b in bindings {
        match b {
            Binding::ElementPass => out += ELEMENT_PASS,
            Binding::NodePass => out += NODE_PASS,
            Binding::Nodes | Binding::Rest | Binding::Constants | Binding::Displacement | Binding::Increment => {}
            Binding::Slots | Binding::SlotIndex | Binding::Offsets | Binding::Margins | Binding::Energies => {}
            Binding::Stresses | Binding::Gate | Binding::Sum | Binding::Masses | Binding::Product => {}
            Binding::Velocity | Binding::Partials => {}
        }
    }
    for (i, b) in bindings.iter().enumerate() {
        let (access, name, kind) = b.parts();
        out += &format!("@group(0) @binding({i}) {access} {name}: {kind};\n");
    }
    out
}
