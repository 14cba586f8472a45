//! What the physics tests share: reference cases, scenes run in memory, bodies for any law, a random sequence.

pub mod contact;
pub mod elements;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod manufactured;
pub mod vibration;

use std::path::{Path, PathBuf};

use serde_json::Value;
use tensormass_runtime::LawEntry;
use tensormass_runtime::backend::Backend;
use tensormass_runtime::body::{Body, Constraint, LawBatch, Rows};
use tensormass_runtime::cpu::{CpuBackend, CpuField, CpuVector, Precision};
use tensormass_runtime::history::History;
use tensormass_runtime::mass::lump;
use tensormass_runtime::mesh::{ElementId, Mesh};
use tensormass_runtime::scene::{self, Override, Scene};
use tensormass_runtime::simulate::{Ending, Outcome, Silent, run};
use tensormass_runtime::system::System;

/// The end-loaded cantilever CANTI_SMALL; its tip's mean deflection is minus the probe `work`.
pub const CANTILEVER: &str = r#"
[mesh]
beam = { size = [10, 1, 1], cells = [20, 2, 2] }

[[material]]
law = "hooke"
density = 1000.0
parameters = { young = 1e6, poisson = 0.3 }

[[boundary]]
nodes = "near(x, xmin)"
fix = ["x", "y", "z"]

[[load]]
kind = "traction"
faces = "near(x, xmax)"
value = [0.0, 0.0, 1.0]

[solver]
integrator = "static"
precision = "f64"
cg = { tolerance = 1e-11, max_iterations = 20000 }

[[probe]]
name = "nodes"
kind = "displacement"
nodes = "near(x, xmax)"
component = "z"

[[probe]]
name = "work"
kind = "energy"
part = "external"

[[probe]]
name = "elastic"
kind = "energy"
part = "elastic"

[[probe]]
name = "volume"
kind = "volume"
elements = "all"
"#;

/// A system on the CPU.
pub type Cpu<R> = System<CpuBackend<R>, CpuField<R>>;

/// A file of the repository.
pub fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path)
}

/// A file of tests/reference.
pub fn reference(file: &str) -> Value {
    let path = repository("tests/reference").join(file);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    serde_json::from_str(&text).expect("reference files are JSON")
}

/// The case of this id in tests/reference/cases.json.
pub fn case(id: &str) -> Value {
    let cases = reference("cases.json");
    let all = cases["cases"].as_array().expect("a list of cases");
    all.iter().find(|c| c["id"] == id).unwrap_or_else(|| panic!("there is no case {id}")).clone()
}

/// A number of a reference case.
pub fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

/// Several numbers of a reference case.
pub fn numbers<const N: usize>(value: &Value) -> [f64; N] {
    std::array::from_fn(|i| number(&value[i]))
}

/// Overrides as `--set` takes them.
pub fn overrides<S: AsRef<str>>(set: &[S]) -> Vec<Override> {
    set.iter().map(|s| Override::parse(s.as_ref()).unwrap_or_else(|e| panic!("{e}"))).collect()
}

/// A scene from text.
pub fn scene<S: AsRef<str>>(text: &str, set: &[S]) -> Scene {
    scene::parse(text, "test.toml", &overrides(set)).unwrap_or_else(|e| panic!("{e}"))
}

/// Runs a scene in memory to whatever end.
pub fn outcome(scene: &Scene) -> Outcome {
    run(scene, None, &mut Silent).unwrap_or_else(|e| panic!("{e}"))
}

/// Runs a scene in memory to its end.
pub fn done(scene: &Scene) -> Outcome {
    let outcome = outcome(scene);
    assert_eq!(outcome.ending, Ending::Done, "{}", outcome.summary["error"]);
    outcome
}

/// The last value of a probe.
pub fn probe(outcome: &Outcome, name: &str) -> f64 {
    let found = outcome.probes.iter().find(|(n, _, _)| n == name);
    found.unwrap_or_else(|| panic!("there is no probe {name}")).2
}

/// |value / wanted - 1|.
pub fn relative(value: f64, wanted: f64) -> f64 {
    (value / wanted - 1.0).abs()
}

/// Numbers in [-1, 1) from a seed.
pub struct Random(pub u64);

impl Random {
    /// The next number.
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// The next three numbers, times a factor.
    pub fn vector(&mut self, factor: f64) -> [f64; 3] {
        std::array::from_fn(|_| factor * self.next())
    }
}

/// Parameters for any law: its defaults, or else 1 MPa for a stress, .3 for what may be .3, the middle of the range for
/// the rest; equal components of one unit vector for a direction.
pub fn parameters(law: &LawEntry) -> Vec<f64> {
    let one = |p: &tensormass_runtime::ParameterInfo| {
        let wish = match p.dimensions {
            [0, 1, 0] => 1e6,
            _ if p.direction => 1.0 / 3.0_f64.sqrt(),
            _ => 0.3,
        };
        let (low, high) = p.range;
        vec![if (low..=high).contains(&wish) { wish } else { 0.5 * (low + high) }; p.len]
    };
    law.info.parameters.iter().flat_map(|p| p.default.map_or_else(|| one(p), <[f64]>::to_vec)).collect()
}

/// The parameters of [`parameters`], with viscosities (Pa s) of this size instead of its own, the k-th k times as large.
pub fn viscous(law: &LawEntry, viscosity: f64) -> Vec<f64> {
    let mut values = parameters(law);
    let (mut first, mut k) = (0, 0);
    for p in law.info.parameters {
        if p.dimensions == [0, 1, 1] {
            k += 1;
            values[first..first + p.len].fill(f64::from(k) * viscosity);
        }
        first += p.len;
    }
    values
}

/// The laws that tests/reference/cases.json has, and its names of them.
pub const REFERENCE: [(&str, &str); 6] = [
    ("hooke", "hooke"),
    ("st_venant_kirchhoff", "svk"),
    ("neo_hookean", "nh_log"),
    ("neo_hookean_isochoric", "iso_nh"),
    ("stable_neo_hookean", "stable_nh"),
    ("mooney_rivlin", "mooney"),
];

/// The parameters of those cases, by name; of other laws those of [`parameters`].
pub fn reference_parameters(law: &LawEntry) -> Vec<f64> {
    let (young, poisson) = (1e6, 0.3);
    let mu = young / (2.0 * (1.0 + poisson));
    let named = |p: &tensormass_runtime::ParameterInfo| match p.name {
        "young" => Some(young),
        "poisson" => Some(poisson),
        "mu1" => Some(0.75 * mu),
        "mu2" => Some(0.25 * mu),
        "lambda" => Some(young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)) - mu / 2.0),
        _ => None,
    };
    let all: Option<Vec<f64>> = law.info.parameters.iter().map(named).collect();
    all.unwrap_or_else(|| parameters(law))
}

/// The parameters of [`parameters`] as a TOML table.
pub fn parameters_text(law: &LawEntry) -> String {
    table(law, &parameters(law))
}

/// Parameters as a TOML table.
pub fn table(law: &LawEntry, values: &[f64]) -> String {
    let mut rest = values;
    let mut items = Vec::new();
    for p in law.info.parameters {
        let (now, later) = rest.split_at(p.len);
        rest = later;
        items.push(if p.len == 1 { format!("{} = {:?}", p.name, now[0]) } else { format!("{} = {now:?}", p.name) });
    }
    format!("{{ {} }}", items.join(", "))
}

/// A body of one law, of elements of any kinds, in SI units (1000 kg/m3); `imposed` are (node, component, displacement), ascending.
pub fn body(mesh: &Mesh, law: &'static LawEntry, parameters: &[f64], imposed: &[(u32, u8, f64)]) -> Body {
    let density = 1000.0;
    let element_masses: Vec<f64> = mesh.elements().map(|e| mesh.volume(e) * density).collect();
    let elements: Rows<u32> = mesh.elements().map(|e| mesh.element_nodes(e).iter().map(|n| n.0)).collect();
    // One batch a kind.
    let batch = |of: &[ElementId]| LawBatch {
        law,
        element: mesh.kind(of[0]),
        elements: of.iter().map(|e| e.0).collect(),
        constants: law.constants(parameters),
        per_element: false,
    };
    let all: Vec<ElementId> = mesh.elements().collect();
    let kinds = all.chunk_by(|a, b| std::ptr::eq(mesh.kind(*a), mesh.kind(*b)));
    let each = mesh.elements().zip(elements.iter()).zip(&element_masses);
    let [low, high] = mesh.bounding_box();
    let constraint = |(motion, &(node, component, _)): (usize, &(u32, u8, f64))| Constraint { node, component, motion };
    Body {
        rest: mesh.elements().map(|e| mesh.rest(e)).collect(),
        batches: kinds.map(batch).collect(),
        masses: lump(mesh.nodes().len(), each.map(|((e, nodes), mass)| (mesh.kind(e), nodes, *mass))),
        mass_matrix: None,
        elements,
        element_masses,
        constraints: imposed.iter().enumerate().map(constraint).collect(),
        motions: imposed.iter().map(|&(_, _, value)| History::constant(value)).collect(),
        loads: vec![],
        pressures: vec![],
        contact: None,
        moves: true,
        mass_damping: 0.0,
        stiffness_damping: 0.0,
        diameter: (0..3).map(|i| (high[i] - low[i]).powi(2)).sum::<f64>().sqrt(),
        volume: mesh.total_volume(),
    }
}

/// A body on the CPU.
pub fn system<R: Precision>(body: Body) -> Cpu<R> {
    let backend = CpuBackend::new(&body);
    let field = CpuField::new(&backend, &body);
    System::new(backend, field, body)
}

/// A vector that is 0 but at one node.
pub fn at_node<R: Precision>(backend: &CpuBackend<R>, node: usize, value: [f64; 3]) -> CpuVector<R> {
    let mut values = backend.download(&backend.zeros());
    values[node] = value;
    backend.upload(&values)
}
