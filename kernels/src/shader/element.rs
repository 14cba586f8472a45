//! Element passes: gather G, evaluate a law's point kernel, contract or store; one invocation some elements, or strips of
//! them (`strip`).
//!
//! What is printed here moves values and adds up quadrature points; all that a law or an element computes is in the
//! functions that the generator printed. An element with one point has no loop and no sum.

use super::Shader;
use super::binding::{Binding, declarations};
use super::frame::{OVERRIDES, STRIDE, entry_point};
use super::functions::{Argument, ElementFunctions, PointFunction};
use super::lines::{Lines, array, row};
use crate::element::{ElementEntry, ElementInfo};
use crate::law::LawEntry;

/// What an element pass computes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Pass {
    /// Strain energy of each element.
    Energy,
    /// Nodal forces of each element into its slots.
    Force,
    /// Nodal force differentials of each element into its slots, unless the solver has stopped.
    DForce,
    /// Diagonal of the tangent stiffness at each element's nodes into its slots.
    Diagonal,
    /// Cauchy stress of each element.
    Cauchy,
    /// Nodal damping forces of each element into its slots.
    Damping,
    /// Their differentials by the velocity into the slots.
    DDamping,
    /// The diagonal of minus that differential at each element's nodes into its slots.
    DampingDiagonal,
}

/// What an invocation of a pass computes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Unit {
    /// An element.
    Element,
    /// Three linear tetrahedra in a row (see [`crate::strip`]).
    Strip,
}

/// All passes.
pub const PASSES: [Pass; 8] = [
    Pass::Energy,
    Pass::Force,
    Pass::DForce,
    Pass::Diagonal,
    Pass::Cauchy,
    Pass::Damping,
    Pass::DDamping,
    Pass::DampingDiagonal,
];

/// The arguments that are gradients of nodal vectors: their names in a pass, the function that reads the nodes, and where.
const GATHERED: [(Argument, &str, &str, &str); 3] = [
    (Argument::DisplacementGradient, "g", "nodal_displacement", "displacement"),
    (Argument::GradientRate, "gt", "nodal_velocity", "velocity"),
    (Argument::GradientIncrement, "dg", "nodal_increment", "increment"),
];

impl Pass {
    /// The law's function that the pass evaluates; none of damping where the law has no dissipation.
    pub fn function(self, law: &LawEntry) -> Option<&'static PointFunction> {
        let (own, damping) = (law.functions, law.damping.map(|damping| damping.functions));
        match self {
            Self::Energy => Some(&own.energy),
            Self::Force => Some(&own.force),
            Self::DForce => Some(&own.dforce),
            Self::Diagonal => Some(&own.diagonal),
            Self::Cauchy => Some(&own.cauchy),
            Self::Damping => damping.map(|d| &d.damping),
            Self::DDamping => damping.map(|d| &d.ddamping),
            Self::DampingDiagonal => damping.map(|d| &d.diagonal),
        }
    }

    fn contracts(self) -> bool {
        matches!(self, Self::Force | Self::DForce | Self::Damping | Self::DDamping)
    }

    fn is_diagonal(self) -> bool {
        matches!(self, Self::Diagonal | Self::DampingDiagonal)
    }
}

/// A pass of a law on an element; none of damping where the law has no dissipation.
///
/// # Panics
/// Strips of another element than the linear tetrahedron.
pub fn element_pass(law: &LawEntry, element: &ElementEntry, pass: Pass, unit: Unit) -> Option<Shader> {
    let function = pass.function(law)?;
    assert!(unit == Unit::Element || element.info.is_linear_simplex, "strips are of linear tetrahedra");
    let composed = Composed {
        unit,
        pass,
        function,
        functions: element.functions,
        info: element.info,
        constants: law.info.constants.len(),
    };
    let bindings = composed.bindings();
    let text = format!("{}{}", law.functions.banner, composed.module(&bindings));
    Some(Shader { text, bindings })
}

/// One law's function on one element.
pub(super) struct Composed<'a> {
    unit: Unit,
    pass: Pass,
    function: &'a PointFunction,
    functions: &'a ElementFunctions,
    info: &'a ElementInfo,
    constants: usize,
}

impl Composed<'_> {
    fn reads(&self, argument: Argument) -> bool {
        self.function.arguments.contains(&argument)
    }

    pub(super) fn gathered(&self) -> impl Iterator<Item = (&'static str, &'static str, &'static str)> {
        GATHERED
            .iter()
            .filter(|(argument, ..)| self.reads(*argument))
            .map(|(_, name, reader, of)| (*name, *reader, *of))
    }

    pub(super) fn gathers(&self) -> bool {
        self.gathered().next().is_some()
    }

    /// Whether there is one quadrature point: nothing is added up.
    fn is_single(&self) -> bool {
        self.info.points.len() == 1
    }

    fn gradients(&self) -> bool {
        self.gathers() || self.pass.contracts() || self.reads(Argument::NodeGradient)
    }

    fn weight(&self) -> bool {
        self.pass != Pass::Cauchy || !self.is_single()
    }

    pub(super) fn slots(&self) -> bool {
        self.pass.contracts() || self.pass.is_diagonal()
    }

    pub(super) fn margin(&self) -> bool {
        self.function.field.is_some()
    }

    fn bindings(&self) -> Vec<Binding> {
        let all = [
            (true, Binding::ElementPass),
            (self.gathers(), Binding::Nodes),
            (self.gradients() || self.weight(), Binding::Rest),
            (self.reads(Argument::Constants), Binding::Constants),
            (self.reads(Argument::DisplacementGradient), Binding::Displacement),
            (self.reads(Argument::GradientRate), Binding::Velocity),
            (self.reads(Argument::GradientIncrement), Binding::Increment),
            (self.slots(), Binding::Slots),
            (self.margin(), Binding::Margins),
            (self.pass == Pass::Energy, Binding::Energies),
            (self.pass == Pass::Cauchy, Binding::Stresses),
            (matches!(self.pass, Pass::DForce | Pass::DDamping), Binding::Gate),
        ];
        all.into_iter().filter_map(|(needed, binding)| needed.then_some(binding)).collect()
    }

    fn module(&self, bindings: &[Binding]) -> String {
        let stride = if bindings.contains(&Binding::Constants) { STRIDE } else { "" };
        let mut out = format!("{OVERRIDES}{stride}\n{}", declarations(bindings));
        if self.gradients() {
            out += &if self.info.is_linear_simplex { shape_gradients() } else { self.mapping() };
        }
        if self.unit == Unit::Element {
            self.gathered().for_each(|(_, reader, of)| out += &self.gather(reader, of));
        }
        let functions = [
            (self.gathers(), self.functions.gradient),
            (self.reads(Argument::NodeGradient), self.functions.node_gradients),
            (self.pass.contracts(), self.functions.contract),
        ];
        out.extend(functions.into_iter().filter_map(|(needed, text)| needed.then_some(text)));
        out += self.function.text;
        out += &match self.unit {
            Unit::Element => self.one_element(),
            Unit::Strip => self.one_strip(),
        };
        out + &entry_point(bindings.contains(&Binding::Gate))
    }

    /// Node j among vectors of four numbers under a name: `node1.x`.
    fn place(name: &str, j: usize) -> String {
        format!("{name}{}.{}", j / 4, ["x", "y", "z", "w"][j % 4])
    }

    /// The vectors of four numbers of an element.
    fn fours(&self, name: &'static str) -> impl Iterator<Item = (usize, String)> + use<> {
        (0..self.info.nodes.div_ceil(4)).map(move |k| (k, format!("{name}{k}")))
    }

    /// Reads the nodes of an element, or their slots.
    fn read_fours(&self, name: &'static str, buffer: &str, out: &mut Lines) {
        self.fours(name).for_each(|(k, vector)| out.line(&format!("let {vector} = {buffer}[{}];", row(k))));
    }

    /// A function that reads the vectors of an element's nodes.
    fn gather(&self, name: &str, of: &str) -> String {
        let nodes = 0..self.info.nodes;
        let values: Vec<String> = nodes.clone().flat_map(|j| ["x", "y", "z"].map(|k| format!("u{j}.{k}"))).collect();
        let arguments: Vec<String> = self.fours("node").map(|(_, vector)| format!("{vector}: vec4<u32>")).collect();
        let mut out = Lines::new(&format!("fn {name}({}) -> array<f32, {}> {{", arguments.join(", "), values.len()));
        nodes.for_each(|j| out.line(&format!("let u{j} = {of}[{}];", Self::place("node", j))));
        out.returns(&values)
    }

    /// The functions that read a point's slopes and J^-1.
    fn mapping(&self) -> String {
        let ElementInfo { nodes, dimension, points, .. } = self.info;
        let names = &["x", "y", "z"][..*dimension];
        let values: Vec<String> = (1..*nodes).flat_map(|j| names.iter().map(move |k| format!("s{j}.{k}"))).collect();
        let comment = "// dLambda_1/dxi, dLambda_2/dxi, ... at a quadrature point.";
        let mut slopes = Lines::new(&format!("{comment}\nfn slopes(q: u32) -> array<f32, {}> {{", values.len()));
        slopes.line(&format!("let first = {}u * element_pass.elements + {}u * q;", 3 * points.len(), nodes - 1));
        slopes.line("let s1 = rest[first];");
        (2..*nodes).for_each(|j| slopes.line(&format!("let s{j} = rest[first + {}u];", j - 1)));
        let comment = "// J^-1 at a quadrature point (1/m).";
        let mut inverse = Lines::new(&format!("{comment}\nfn inverse_jacobian(e: u32, q: u32) -> array<f32, 9> {{"));
        inverse.line("let first = 3u * q * element_pass.elements + e;");
        inverse.line("let r0 = rest[first];");
        inverse.line("let r1 = rest[first + element_pass.elements];");
        inverse.line("let r2 = rest[first + 2u * element_pass.elements];");
        let rows: Vec<String> = (0..3).flat_map(|j| ["x", "y", "z"].map(|k| format!("r{j}.{k}"))).collect();
        slopes.returns(&values) + &inverse.returns(&rows)
    }

    /// What a pass passes to an element's functions for the gradients at a point.
    fn geometry(&self) -> &'static str {
        if self.info.is_linear_simplex { "b" } else { "s, j" }
    }

    /// The call of the law's function; `node_gradient` is the expression of the gradient at one node.
    fn call(&self, node_gradient: &str) -> String {
        let name = |argument: &Argument| match argument {
            Argument::Constants => "c",
            Argument::DisplacementGradient => "g",
            Argument::GradientRate => "gt",
            Argument::GradientIncrement => "dg",
            Argument::NodeGradient => node_gradient,
        };
        let arguments: Vec<&str> = self.function.arguments.iter().map(name).collect();
        format!("{}({})", self.function.name, arguments.join(", "))
    }

    /// The function that computes one element.
    fn one_element(&self) -> String {
        let mut out = Lines::new("fn element(e: u32) {");
        if self.gathers() {
            self.read_fours("node", "nodes", &mut out);
        }
        let nodes = self.fours("node").map(|(_, vector)| vector).collect::<Vec<_>>().join(", ");
        for (name, reader, _) in self.gathered() {
            out.line(&format!("let nodal_{name} = {reader}({nodes});"));
        }
        self.read_constants("e", &mut out);
        if self.is_single() {
            self.point("e", &mut out);
        } else {
            for sum in self.sums() {
                out.line(&sum);
            }
            out.open(&format!("for (var q = 0u; q < {}u; q++) {{", self.info.points.len()));
            self.point("e", &mut out);
            out.close();
        }
        self.store("e", &mut out);
        if self.slots() {
            out.line(&format!("let slot = element_pass.first_slot + {}u * e;", self.info.nodes));
            for j in 0..self.info.nodes {
                let [x, y, z] = [3 * j, 3 * j + 1, 3 * j + 2];
                let place = if j == 0 { "slot".to_string() } else { format!("slot + {j}u") };
                out.line(&format!("slots[{place}] = vec4<f32>(f[{x}], f[{y}], f[{z}], 0.0f);"));
            }
        }
        out.close();
        out.text
    }

    /// Reads the constants of an element, by its number.
    pub(super) fn read_constants(&self, element: &str, out: &mut Lines) {
        if self.reads(Argument::Constants) {
            out.line(&format!("let first = constants_stride * {element};"));
            let entry = |k| if k == 0 { "constants[first]".to_string() } else { format!("constants[first + {k}u]") };
            out.line(&format!("let c = {};", array(&(0..self.constants).map(entry).collect::<Vec<_>>())));
        }
    }

    /// What is added up over the points of an element with several.
    fn sums(&self) -> Vec<String> {
        let mut sums = match self.pass {
            Pass::Energy => vec!["var integral = 0.0f;".to_string()],
            Pass::Cauchy => vec!["var sigma = array<f32, 9>();".to_string(), "var volume = 0.0f;".to_string()],
            _ => vec![format!("var f = array<f32, {}>();", 3 * self.info.nodes)],
        };
        if self.margin() {
            // No margin is greater.
            sums.push("var margin = 3.4028235e38f;".into());
        }
        sums
    }

    /// What is computed at one quadrature point, q where there are several; `rest` is where its first row at rest is.
    pub(super) fn point(&self, rest: &str, out: &mut Lines) {
        let single = self.is_single();
        if self.gradients() {
            if self.info.is_linear_simplex {
                out.line(&format!("let b = shape_gradients({rest});"));
            } else {
                let q = if single { "0u" } else { "q" };
                out.line(&format!("let s = slopes({q});"));
                out.line(&format!("let j = inverse_jacobian(e, {q});"));
            }
        }
        if self.weight() {
            let first = if single { rest } else { "3u * q * element_pass.elements + e" };
            out.line(&format!("let w = rest[{first}].w;"));
        }
        for (name, ..) in self.gathered() {
            out.line(&format!("let {name} = gradient(nodal_{name}, {});", self.geometry()));
        }
        if self.pass.is_diagonal() {
            return self.diagonal(out);
        }
        out.line(&format!("let point = {};", self.call("")));
        let value = self.function.field.map_or("point".to_string(), |field| format!("point.{field}"));
        match (self.pass, single) {
            (Pass::Energy, true) => out.line(&format!("let integral = {value} * w;")),
            (Pass::Energy, false) => out.line(&format!("integral += {value} * w;")),
            (Pass::Cauchy, true) => out.line(&format!("let sigma = {value};")),
            (Pass::Cauchy, false) => {
                (0..9).for_each(|k| out.line(&format!("sigma[{k}] += {value}[{k}] * w;")));
                out.line("volume += w;");
            }
            (_, true) => out.line(&format!("let f = contract({value}, {}, w);", self.geometry())),
            (_, false) => {
                out.line(&format!("let part = contract({value}, {}, w);", self.geometry()));
                (0..3 * self.info.nodes).for_each(|k| out.line(&format!("f[{k}] += part[{k}];")));
            }
        }
        if self.margin() {
            out.line(if single { "let margin = point.margin;" } else { "margin = min(margin, point.margin);" });
        }
    }

    /// The diagonal at each node; nodes of an element with several points in a loop, because a law's function is long.
    fn diagonal(&self, out: &mut Lines) {
        let at = |k: [String; 3]| format!("array<f32, 3>({})", k.map(|k| format!("n[{k}]")).join(", "));
        let keyword = if self.is_single() { "let" } else { "var" };
        if self.reads(Argument::NodeGradient) {
            out.line(&format!("{keyword} n = node_gradients({});", self.geometry()));
        }
        if !self.is_single() {
            out.open(&format!("for (var k = 0u; k < {}u; k += 3u) {{", 3 * self.info.nodes));
            let places = ["k", "k + 1u", "k + 2u"].map(String::from);
            out.line(&format!("let d = {};", self.call(&at(places.clone()))));
            for (i, k) in places.iter().enumerate() {
                out.line(&format!("f[{k}] += w * d[{i}];"));
            }
            return out.close();
        }
        let nodes = 0..self.info.nodes;
        for a in nodes.clone() {
            out.line(&format!("let d{a} = {};", self.call(&at([0, 1, 2].map(|i| (3 * a + i).to_string())))));
        }
        let values: Vec<String> = nodes.flat_map(|a| [0, 1, 2].map(|i| format!("w * d{a}[{i}]"))).collect();
        out.line(&format!("let f = {};", array(&values)));
    }

    /// Stores what an element has but its forces, by its number.
    pub(super) fn store(&self, element: &str, out: &mut Lines) {
        match self.pass {
            Pass::Energy => out.line(&format!("energies[{element}] = integral;")),
            Pass::Cauchy => {
                let part = if self.is_single() { "" } else { " / volume" };
                for k in 0..9 {
                    out.line(&format!("stresses[9u * {element} + {k}u] = sigma[{k}]{part};"));
                }
            }
            _ => {}
        }
        if self.margin() {
            // Of several passes the margin of the first that is outside stays.
            out.open("if element_pass.keeps_margins == 0u || !(margin > 0.0f) {");
            out.line(&format!("margins[{element}] = margin;"));
            out.close();
        }
    }
}

/// The function that reads the gradients of a linear tetrahedron.
fn shape_gradients() -> String {
    let comment = "// grad Lambda_1, grad Lambda_2, ... of an element (1/m).";
    let mut out = Lines::new(&format!("{comment}\nfn shape_gradients(e: u32) -> array<f32, 9> {{"));
    (0..3).for_each(|k| out.line(&format!("let g{} = rest[{}];", k + 1, row(k))));
    out.returns(&(1..4).flat_map(|j| ["x", "y", "z"].map(|k| format!("g{j}.{k}"))).collect::<Vec<_>>())
}
