//! Element passes: gather G, evaluate a law's point kernel, contract or store; one invocation some elements.

use super::binding::{Binding, declarations};
use super::{Shader, comment, function, helpers};
use crate::derivation::{Derivation, PointKernel};
use crate::element::ElementKernels;
use crate::ir::{Input, Output};
use crate::law::ast::Law;
use crate::print::naming;

/// Components of a `vec4` that holds one entry a node.
const NODES: [&str; 4] = ["x", "y", "z", "w"];

/// What a pass does with the result of its point kernel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Pass {
    /// Stores the energy of the element.
    Energy,
    /// Contracts the stress to nodal forces.
    Force,
    /// As `Force` with the differential, unless the solver has stopped.
    DForce,
    /// Stores the diagonal at each node.
    Diagonal,
    /// Stores the Cauchy stress.
    Cauchy,
    /// As `Force` with the stress of damping.
    Damping,
    /// As `DForce` with that stress's differential.
    DDamping,
    /// As `Diagonal` with that of damping.
    DampingDiagonal,
}

/// The passes, in the order of [`NAMES`].
const PASSES: [Pass; 5] = [Pass::Energy, Pass::Force, Pass::DForce, Pass::Diagonal, Pass::Cauchy];

/// The names of the passes of [`law_shaders`], which are those of their point kernels, in their order.
pub const NAMES: [&str; 5] = ["energy", "force", "dforce", "diagonal", "cauchy"];

/// The passes of damping, in the order of [`DAMPING_NAMES`].
const DAMPING_PASSES: [Pass; 3] = [Pass::Damping, Pass::DDamping, Pass::DampingDiagonal];

/// The names of the passes of [`damping_shaders`], which are those of their point kernels, in their order.
pub const DAMPING_NAMES: [&str; 3] = ["damping", "ddamping", "damping_diagonal"];

/// Storage buffers that WebGPU's default limits allow a pass.
const MOST_BUFFERS: usize = 8;

/// The inputs that are gradients of nodal vectors: the function that reads the nodes, and the array.
const GATHERED: [(Input, &str, &str); 3] = [
    (Input::DisplacementGradient, "nodal_displacement", "displacement"),
    (Input::GradientRate, "nodal_velocity", "velocity"),
    (Input::GradientIncrement, "nodal_increment", "increment"),
];

/// What one pass has and needs: decided once, for its bindings and for its text.
struct Needs<'a> {
    pass: Pass,
    point: PointKernel<'a>,
    element: &'a ElementKernels,
}

impl Needs<'_> {
    fn reads(&self, role: Input) -> bool {
        self.point.reads(role)
    }

    fn gathers(&self) -> bool {
        GATHERED.iter().any(|(role, ..)| self.reads(*role))
    }

    fn contracts(&self) -> bool {
        matches!(self.pass, Pass::Force | Pass::DForce | Pass::Damping | Pass::DDamping)
    }

    fn shape_gradients(&self) -> bool {
        self.gathers() || self.contracts() || self.reads(Input::NodeGradient)
    }

    fn volume(&self) -> bool {
        self.pass != Pass::Cauchy
    }

    fn slots(&self) -> bool {
        self.contracts() || self.is_diagonal()
    }

    fn is_diagonal(&self) -> bool {
        matches!(self.pass, Pass::Diagonal | Pass::DampingDiagonal)
    }

    fn margin(&self) -> bool {
        self.point.outputs().any(|(role, _)| *role == Output::DomainMargin)
    }

    fn bindings(&self) -> Vec<Binding> {
        let all = [
            (true, Binding::ElementPass),
            (self.gathers(), Binding::Nodes),
            (self.shape_gradients() || self.volume(), Binding::Rest),
            (self.reads(Input::Constants), Binding::Constants),
            (self.reads(Input::DisplacementGradient), Binding::Displacement),
            (self.reads(Input::GradientRate), Binding::Velocity),
            (self.reads(Input::GradientIncrement), Binding::Increment),
            (self.slots(), Binding::Slots),
            (self.slots(), Binding::SlotIndex),
            (self.margin(), Binding::Margins),
            (self.pass == Pass::Energy, Binding::Energies),
            (self.pass == Pass::Cauchy, Binding::Stresses),
            (self.pass == Pass::DForce, Binding::Gate),
        ];
        let mut bindings: Vec<Binding> =
            all.into_iter().filter_map(|(needed, binding)| needed.then_some(binding)).collect();
        // Where there is no room for the gate the pass runs in vain once a solver has stopped: nobody reads its slots.
        if self.pass == Pass::DDamping && bindings.len() <= MOST_BUFFERS {
            bindings.push(Binding::Gate);
        }
        bindings
    }
}

/// The element passes of a law: energy, force, dforce, diagonal, cauchy.
///
/// # Panics
/// The element has not four nodes: the buffers hold four.
pub fn law_shaders(law: &Law, derivation: &Derivation, element: &ElementKernels) -> [Shader; 5] {
    let shader = shaders(law, derivation, element);
    std::array::from_fn(|k| shader(PASSES[k], NAMES[k]))
}

/// The element passes of a law's damping, if it has a dissipation: damping, ddamping, damping_diagonal.
///
/// # Panics
/// The element has not four nodes: the buffers hold four.
pub fn damping_shaders(law: &Law, derivation: &Derivation, element: &ElementKernels) -> Option<[Shader; 3]> {
    let shader = shaders(law, derivation, element);
    derivation.is_dissipative().then(|| std::array::from_fn(|k| shader(DAMPING_PASSES[k], DAMPING_NAMES[k])))
}

fn shaders<'a>(
    law: &Law,
    derivation: &'a Derivation,
    element: &'a ElementKernels,
) -> impl Fn(Pass, &str) -> Shader + 'a {
    assert_eq!(element.nodes as usize, NODES.len(), "an element's nodes are one vec4<u32>");
    let banner = comment(&format!(
        "{}\n\nc: {}.\n\nGenerated by tensormass-codegen {} from laws/{}.rs (text {:016x}); do not edit.",
        law.docs.trim(),
        naming::constants(derivation),
        env!("CARGO_PKG_VERSION"),
        law.name,
        derivation.hash
    ));
    move |pass, name| {
        let needs = Needs { pass, point: derivation.point(name), element };
        let bindings = needs.bindings();
        Shader { text: format!("{banner}\n{}", module(&needs, &bindings)), bindings }
    }
}

fn module(needs: &Needs, bindings: &[Binding]) -> String {
    let stride = if bindings.contains(&Binding::Constants) { STRIDE } else { "" };
    let mut out = format!("{OVERRIDES}{stride}\n{}", declarations(bindings));
    out += &helpers::texts(&function::point_helpers(&needs.point));
    if needs.shape_gradients() {
        out += &shape_gradients();
    }
    for (role, name, array) in GATHERED {
        if needs.reads(role) {
            out += &gather(name, array);
        }
    }
    let functions = [
        (needs.gathers(), &needs.element.gradient),
        (needs.reads(Input::NodeGradient), &needs.element.node_gradients),
        (needs.contracts(), &needs.element.contract),
    ];
    for (_, kernel) in functions.iter().filter(|(needed, _)| *needed) {
        out += &function::function(kernel, &kernel.ir().name);
    }
    out += &function::point_function(&needs.point);
    out += &one_element(needs);
    out += &entry_point(bindings.contains(&Binding::Gate));
    out
}

const OVERRIDES: &str = "\
override work_group_size: u32 = 64u;
// Elements that one invocation computes, one after the other.
override elements_per_invocation: u32 = 1u;
";

const STRIDE: &str = "\
// Constants between one element's set and the next; 0 where all share one, which a compiler can then load once.
override constants_stride: u32 = 0u;
";

fn shape_gradients() -> String {
    let rows: Vec<String> = (1..NODES.len()).flat_map(|j| ["x", "y", "z"].map(|k| format!("g{j}.{k}"))).collect();
    let lets: String = (1..NODES.len())
        .map(|j| match j {
            1 => "    let g1 = rest[e];\n".to_string(),
            2 => "    let g2 = rest[element_pass.elements + e];\n".to_string(),
            _ => format!("    let g{j} = rest[{}u * element_pass.elements + e];\n", j - 1),
        })
        .collect();
    format!(
        "\n// grad Lambda_1, grad Lambda_2, ... of an element (1/m).\nfn shape_gradients(e: u32) -> array<f32, {}> {{\n{lets}    \
         return {};\n}}\n",
        rows.len(),
        function::array(&rows, "    ")
    )
}

/// A function that reads the vectors of an element's nodes.
fn gather(name: &str, array: &str) -> String {
    let lets: String = NODES.iter().enumerate().map(|(j, k)| format!("    let u{j} = {array}[node.{k}];\n")).collect();
    let values: Vec<String> = (0..NODES.len()).flat_map(|j| ["x", "y", "z"].map(|k| format!("u{j}.{k}"))).collect();
    format!(
        "\nfn {name}(node: vec4<u32>) -> array<f32, {}> {{\n{lets}    return {};\n}}\n",
        values.len(),
        function::array(&values, "    ")
    )
}

/// The call of the point kernel; `node_gradient` is the expression of the gradient at one node.
fn call(needs: &Needs, node_gradient: &str) -> String {
    let arguments: Vec<&str> = function::point_inputs(&needs.point)
        .map(|(role, _)| if role == Input::NodeGradient { node_gradient } else { naming::letter(role) })
        .collect();
    format!("{}({})", needs.point.name(), arguments.join(", "))
}

fn offset(first: &str, k: u32) -> String {
    if k == 0 { first.to_string() } else { format!("{first} + {k}u") }
}

/// The function that computes one element.
fn one_element(needs: &Needs) -> String {
    let mut out = String::from("\nfn element(e: u32) {\n");
    let mut line = |text: &str| out += &format!("    {text}\n");
    if needs.gathers() {
        line("let node = nodes[e];");
    }
    if needs.shape_gradients() {
        line("let b = shape_gradients(e);");
    }
    if needs.volume() {
        line("let volume = rest[e].w;");
    }
    if let Some((_, count)) = function::point_inputs(&needs.point).find(|(role, _)| *role == Input::Constants) {
        line("let first = constants_stride * e;");
        let values: Vec<String> = (0..count).map(|k| format!("constants[{}]", offset("first", k))).collect();
        line(&format!("let c = {};", function::array(&values, "    ")));
    }
    for (role, function, _) in GATHERED {
        if needs.reads(role) {
            line(&format!("let {} = gradient({function}(node), b);", naming::letter(role)));
        }
    }
    if needs.slots() {
        line("let slot = slot_index[e];");
    }
    if needs.is_diagonal() {
        diagonal(needs, &mut line);
    } else {
        line(&format!("let point = {};", call(needs, "")));
        store(needs, &mut line);
    }
    out + "}\n"
}

/// Stores what the point kernel gives in `point`.
fn store(needs: &Needs, line: &mut impl FnMut(&str)) {
    let several = needs.point.outputs().count() > 1;
    let output = |role| if several { format!("point.{}", function::field(role)) } else { "point".to_string() };
    match needs.pass {
        Pass::Energy => line(&format!("energies[e] = {} * volume;", output(Output::EnergyDensity))),
        Pass::Force | Pass::DForce | Pass::Damping | Pass::DDamping => {
            let differential = matches!(needs.pass, Pass::DForce | Pass::DDamping);
            let role = if differential { Output::StressIncrement } else { Output::Stress };
            line(&format!("let f = contract({}, b, volume);", output(role)));
            for (j, k) in NODES.iter().enumerate() {
                let [x, y, z] = [3 * j, 3 * j + 1, 3 * j + 2];
                line(&format!("slots[slot.{k}] = vec4<f32>(f[{x}], f[{y}], f[{z}], 0.0f);"));
            }
        }
        Pass::Cauchy => {
            let sigma = output(Output::Cauchy);
            (0..9).for_each(|k| line(&format!("stresses[{}] = {sigma}[{k}];", offset("9u * e", k))));
        }
        Pass::Diagonal | Pass::DampingDiagonal => {}
    }
    if needs.margin() {
        line(&format!("margins[e] = {};", output(Output::DomainMargin)));
    }
}

/// Evaluates the diagonal at each node and stores it.
fn diagonal(needs: &Needs, line: &mut impl FnMut(&str)) {
    if needs.reads(Input::NodeGradient) {
        line("let n = node_gradients(b);");
    }
    for (j, k) in NODES.iter().enumerate() {
        let n = function::array(&[0, 1, 2].map(|i| format!("n[{}]", 3 * j + i)), "");
        line(&format!("let d{j} = {};", call(needs, &n)));
        line(&format!("slots[slot.{k}] = vec4<f32>(volume * d{j}[0], volume * d{j}[1], volume * d{j}[2], 0.0f);"));
    }
}

fn entry_point(gated: bool) -> String {
    let gate = if gated { "    if gate[0] == 0.0f {\n        return;\n    }\n" } else { "" };
    format!(
        "
@compute @workgroup_size(work_group_size)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {{
{gate}    let invocations = groups.x * groups.y * work_group_size;
    let e = (group.y * groups.x + group.x) * work_group_size + local;
    if e < element_pass.elements {{
        element(e);
    }}
    // Not one loop for all: where an invocation has one element, nothing of a loop may be left.
    for (var i = 1u; i < elements_per_invocation; i++) {{
        let next = e + i * invocations;
        if next < element_pass.elements {{
            element(next);
        }}
    }}
}}
"
    )
}
