//! WGSL text of generated kernels, and what it binds: how a GPU runtime meets laws without knowing them.

/// What a kernel binds, in the order of its binding numbers in group 0, from 0.
///
/// Every vector over nodes is `array<vec4<f32>>`: three components, and in the fourth the node's constraint mask (bits
/// 1, 2, 4 for x, y, z), which no kernel changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Binding {
    /// `uniform`, 16 bytes: elements of the pass (`u32`), the rest unused.
    ElementPass,
    /// `uniform`, 16 bytes: nodes (`u32`), whether the pass is the first to write its product (`u32`), the factor of the
    /// sum of slots (`f32`), the factor of the masses (`f32`).
    NodePass,
    /// `array<vec4<u32>>`: the nodes of each element.
    Nodes,
    /// `array<vec4<f32>>`, for all elements the gradient of node 1's interpolation function with the rest volume as
    /// fourth component, then for all that of node 2, then of node 3.
    Rest,
    /// `array<f32>`: the material's constants.
    Constants,
    /// Vector: displacement.
    Displacement,
    /// Vector: velocity.
    Velocity,
    /// Vector: the direction of a differential.
    Increment,
    /// `array<vec4<f32>>`: partial forces; the slots of one node follow each other.
    Slots,
    /// `array<vec4<u32>>`: the slot of each of an element's nodes.
    SlotIndex,
    /// `array<u32>`: where each node's slots begin, and one end.
    Offsets,
    /// `array<f32>`: the margin of each element, positive inside the law's domain.
    Margins,
    /// `array<f32>`: the strain energy of each element.
    Energies,
    /// `array<f32>`, nine an element: Cauchy stress.
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

impl Binding {
    /// Whether it is a uniform buffer.
    pub fn is_uniform(self) -> bool {
        matches!(self, Self::ElementPass | Self::NodePass)
    }

    /// Whether kernels write it.
    pub fn is_written(self) -> bool {
        matches!(
            self,
            Self::Slots | Self::Margins | Self::Energies | Self::Stresses | Self::Sum | Self::Product | Self::Partials
        )
    }
}

/// A compute shader with one entry point, `main`.
#[derive(Debug, Clone, Copy)]
pub struct Shader {
    /// WGSL; its parameters are pipeline constants: `work_group_size`; in element passes `elements_per_invocation`; where
    /// it binds [`Binding::Constants`], `constants_stride`, constants between one element's set and the next, 0 where
    /// all share one.
    pub text: &'static str,
    /// What it binds.
    pub bindings: &'static [Binding],
}

/// The element passes of a law on linear tetrahedra.
#[derive(Debug, Clone, Copy)]
pub struct LawShaders {
    /// Strain energy of each element.
    pub energy: Shader,
    /// Nodal forces of each element into its slots.
    pub force: Shader,
    /// Nodal force differentials of each element into its slots.
    pub dforce: Shader,
    /// Diagonal of the tangent stiffness at each element's nodes into its slots.
    pub diagonal: Shader,
    /// Cauchy stress of each element.
    pub cauchy: Shader,
}

/// The element passes of a law's damping on linear tetrahedra.
#[derive(Debug, Clone, Copy)]
pub struct DampingShaders {
    /// Nodal damping forces of each element into its slots.
    pub damping: Shader,
    /// Their differentials by the velocity into the slots.
    pub ddamping: Shader,
    /// The diagonal of minus that differential at each element's nodes into its slots.
    pub diagonal: Shader,
}
