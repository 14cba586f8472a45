//! What passes bind, and how a module declares it.

/// What a pass binds, in the order of its binding numbers in group 0, from 0.
///
/// Every vector over nodes is `array<vec4<f32>>`: three components, and in the fourth the node's constraint mask (bits
/// 1, 2, 4 for x, y, z), which no pass changes. A pass over strips counts strips where this says elements: of these the
/// nodes are those of a strip, quadrature points those of its three elements, and what elements have by number is that of
/// the first ones of all strips, then of the second and of the third ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Binding {
    /// `uniform`, 16 bytes: elements of the pass (`u32`), whether it keeps margins while elements are inside (`u32`), the
    /// first slot of its first element (`u32`), the rest unused.
    ElementPass,
    /// `uniform`, 16 bytes: nodes (`u32`), whether the pass is the first to write its product (`u32`), the factor of the
    /// sum of slots (`f32`), the factor of the masses (`f32`).
    NodePass,
    /// `array<vec4<u32>>`: the first four nodes of each element, then the next four of each, and so on.
    Nodes,
    /// `array<vec4<f32>>`: for each quadrature point, row by row of J^-1, that row of each element (1/m), with the point's
    /// weight as fourth component of the first row (m^3). Then, unless the rows are the gradients of the interpolation
    /// functions (linear tetrahedra), point by point the slopes dLambda_j/dxi of nodes 1, 2, .. of the reference element.
    Rest,
    /// `array<f32>`: the material's constants.
    Constants,
    /// Vector: displacement.
    Displacement,
    /// Vector: velocity.
    Velocity,
    /// Vector: the direction of a differential.
    Increment,
    /// `array<vec4<f32>>`: partial forces, those of an element's nodes one after the other.
    Slots,
    /// `array<u32>`: where in this array the list of each node's slots begins, and where the last one ends; then the lists.
    Incidence,
    /// `array<f32>`: the least margin of each element's points, positive inside the law's domain.
    Margins,
    /// `array<f32>`: the strain energy of each element.
    Energies,
    /// `array<f32>`, nine an element: Cauchy stress, the mean over the element's volume at rest.
    Stresses,
    /// `array<f32>`: entry 0 is 0 where the pass is to do nothing (a solver that has stopped).
    Gate,
    /// Vector: what the sum of slots is added to.
    Sum,
    /// Vector: lumped masses, one a component.
    Masses,
    /// Vector: what a product with the operator is written to.
    Product,
    /// `array<f32>`: one partial sum a work group.
    Partials,
}

const UNIFORM: &str = "var<uniform>";
const READ: &str = "var<storage, read>";
// One access for a binding in every pass: a bind group's layout states it, and one layout then fits all.
const WRITTEN: &str = "var<storage, read_write>";

impl Binding {
    /// Whether it is a uniform buffer.
    pub fn is_uniform(self) -> bool {
        self.parts().0 == UNIFORM
    }

    /// Whether passes write it.
    pub fn is_written(self) -> bool {
        self.parts().0 == WRITTEN
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
            Self::Incidence => (READ, "incidence", "array<u32>"),
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
    // 1 where margins that an earlier pass wrote stay while an element is inside.
    keeps_margins: u32,
    // The first slot of the first element.
    first_slot: u32,
    unused: u32,
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
pub(super) fn declarations(bindings: &[Binding]) -> String {
    let structure = |b: &Binding| match b {
        Binding::ElementPass => ELEMENT_PASS,
        Binding::NodePass => NODE_PASS,
        _ => "",
    };
    let mut out: String = bindings.iter().map(structure).collect();
    for (i, b) in bindings.iter().enumerate() {
        let (access, name, kind) = b.parts();
        out += &format!("@group(0) @binding({i}) {access} {name}: {kind};\n");
    }
    out
}
