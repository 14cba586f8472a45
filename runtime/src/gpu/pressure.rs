//! Pressure on a GPU in two passes: an invocation a face leaves the forces on its nodes in slots, one a node adds them up.

use std::rc::Rc;

use tensormass_kernels::ElementInfo;

use super::GpuBackend;
use super::backend::GpuVector;
use super::recorder::{Kernel, Memory};
use super::shaders::{Access, Argument, Frame, module, vector};
use crate::body::PressedFace;
use crate::device::DeviceError;
use crate::inventory::names::PRESSED;

/// Faces under a pressure on a GPU.
#[derive(Debug)]
pub struct GpuPressure {
    kinds: Vec<Faces>,
}

/// Those of one kind.
#[derive(Debug)]
struct Faces {
    count: usize,
    /// The places of the nodes of one face after the other.
    nodes: Memory,
    /// Two tangents at rest at each point of one face after the other.
    tangents: Memory,
    slots: Memory,
    face_pass: Rc<Kernel>,
    /// Place, first and one after the last of its entries in `order`.
    sums: Memory,
    sum_count: usize,
    order: Memory,
    node_pass: Rc<Kernel>,
}

const NODES: Argument = ("nodes", "u32", Access::Read);
const TANGENTS: Argument = ("tangents", "vec4<f32>", Access::Read);
const SUMS: Argument = ("sums", "vec4<u32>", Access::Read);
const ORDER: Argument = ("order", "u32", Access::Read);

fn face_arguments() -> Vec<Argument> {
    vec![NODES, TANGENTS, vector("u", Access::Read), vector("slots", Access::Write)]
}

fn node_arguments() -> Vec<Argument> {
    vec![SUMS, ORDER, vector("slots", Access::Read), vector("f", Access::Write)]
}

impl GpuPressure {
    /// Faces on a backend.
    ///
    /// # Errors
    /// There are more than the device can bind.
    pub(super) fn new(backend: &GpuBackend, faces: &[PressedFace]) -> Result<Self, DeviceError> {
        let mut kinds: Vec<&'static ElementInfo> = vec![];
        for face in faces {
            if !kinds.iter().any(|kind| std::ptr::eq(*kind, face.kind)) {
                kinds.push(face.kind);
            }
        }
        let of = |kind: &&'static ElementInfo| {
            let own: Vec<&PressedFace> = faces.iter().filter(|face| std::ptr::eq(face.kind, *kind)).collect();
            Faces::new(backend, kind, &own)
        };
        Ok(Self { kinds: kinds.iter().map(of).collect::<Result<_, _>>()? })
    }

    /// f += the forces of a pressure at displacement u.
    pub(super) fn add(&self, backend: &GpuBackend, pressure: f64, u: &GpuVector, f: &mut GpuVector) {
        for faces in &self.kinds {
            let numbers = [faces.count as u32, 0, (pressure as f32).to_bits(), 0];
            backend.dispatch_each(
                &faces.face_pass,
                numbers,
                &[&faces.nodes, &faces.tangents, u.memory(), &faces.slots],
            );
            let numbers = [faces.sum_count as u32, 0, 0, 0];
            backend.dispatch_each(&faces.node_pass, numbers, &[&faces.sums, &faces.order, &faces.slots, f.memory()]);
        }
    }
}

impl Faces {
    fn new(backend: &GpuBackend, kind: &'static ElementInfo, faces: &[&PressedFace]) -> Result<Self, DeviceError> {
        let recorder = backend.recorder();
        let place = |n: &u32| backend.order().places[*n as usize];
        let nodes: Vec<u32> = faces.iter().flat_map(|face| face.nodes.iter().map(place)).collect();
        let four = |x: &[f64; 3]| [x[0] as f32, x[1] as f32, x[2] as f32, 0.0];
        let tangents: Vec<[f32; 4]> =
            faces.iter().flat_map(|face| face.tangents.as_flattened().iter().map(four)).collect();
        // The slots of each node, by its place.
        let mut by_node: Vec<(u32, u32)> = nodes.iter().zip(0..).map(|(place, slot)| (*place, slot)).collect();
        by_node.sort_unstable();
        let order: Vec<u32> = by_node.iter().map(|(_, slot)| *slot).collect();
        let mut sums: Vec<[u32; 4]> = vec![];
        for (k, (place, _)) in (0..).zip(&by_node) {
            match sums.last_mut() {
                Some(last) if last[0] == *place => last[2] = k + 1,
                _ => sums.push([*place, k, k + 1, 0]),
            }
        }
        Ok(Self {
            count: faces.len(),
            slots: recorder.memory(PRESSED, 16 * nodes.len() as u64)?,
            nodes: recorder.filled(PRESSED, &nodes)?,
            tangents: recorder.filled(PRESSED, &tangents)?,
            face_pass: backend.kernel("pressure: faces", &face_text(kind), &face_arguments()),
            sum_count: sums.len(),
            sums: recorder.filled(PRESSED, &sums)?,
            order: recorder.filled(PRESSED, &order)?,
            node_pass: backend.kernel("pressure: nodes", &node_text(), &node_arguments()),
        })
    }
}

/// The pass over faces of a kind.
pub(super) fn face_text(kind: &ElementInfo) -> String {
    let (nodes, points) = (kind.nodes, kind.points.len());
    let mut text = "fn each(i: u32) {\n".to_string();
    text += &format!("    let u0 = u[nodes[{nodes}u * i]].xyz;\n");
    for j in 1..nodes {
        text += &format!("    let d{j} = u[nodes[{nodes}u * i + {j}u]].xyz - u0;\n");
    }
    for j in 0..nodes {
        text += &format!("    var f{j} = vec3<f32>(0.0f);\n");
    }
    let number = |x: f64| format!("f32({:?}f)", x as f32);
    for (q, point) in kind.points.iter().enumerate() {
        for (k, name) in ["a", "b"].into_iter().enumerate() {
            text += &format!("    var {name}{q} = tangents[{}u * i + {}u].xyz;\n", 2 * points, 2 * q + k);
            for j in 1..nodes {
                text += &format!("    {name}{q} += {} * d{j};\n", number(point.gradients[j][k]));
            }
        }
        text += &format!("    let n{q} = (-numbers.a * {}) * cross(a{q}, b{q});\n", number(point.weight));
        for (j, function) in point.functions.iter().enumerate() {
            text += &format!("    f{j} += {} * n{q};\n", number(*function));
        }
    }
    for j in 0..nodes {
        text += &format!("    slots[{nodes}u * i + {j}u] = vec4<f32>(f{j}, 0.0f);\n");
    }
    module("Pressure: faces.", &face_arguments(), &(text + "}\n"), Frame::Each)
}

/// The pass over nodes.
pub(super) fn node_text() -> String {
    let text = "fn each(i: u32) {
    let node = sums[i];
    var sum = vec3<f32>(0.0f);
    for (var k = node.y; k < node.z; k++) {
        sum += slots[order[k]].xyz;
    }
    let old = f[node.x];
    f[node.x] = vec4<f32>(old.xyz + sum, old.w);
}
";
    module("Pressure: nodes.", &node_arguments(), text, Frame::Each)
}

/// The modules of every kind of face, for tests.
pub(super) fn samples() -> Vec<(String, String)> {
    let faces = tensormass_kernels::elements().iter().map(|e| e.info).filter(|info| info.dimension == 2);
    let named = |info: &ElementInfo| (format!("pressure on {}", info.name), face_text(info));
    faces.map(named).chain([("pressure: nodes".to_string(), node_text())]).collect()
}
