//! The buffers of a plan on a GPU, as far as the body is within one page.

use super::Needed;
use super::buffers::{Buffer, grids};
use crate::backend::REGISTERS;
use crate::body::LawBatch;
use crate::device_memory::{ALIGNMENT, GROUP, PASSES, WORK_GROUP, bytes, motions, partial_sums};
use crate::guard;
use crate::inventory::names;
use crate::order::{DeviceOrder, Grouped};
use crate::scene::Scene;
use tensormass_kernels::strip::MEMBERS;

use super::Layout;

/// Elements of one law and kind that passes run over, with what they have.
#[derive(Default)]
struct Sizes {
    nodes: usize,
    rest: usize,
    constants: usize,
    slots: usize,
    margins: usize,
    stresses: usize,
    /// Elements of the largest part that is computed at once.
    largest: usize,
}

/// Bytes of a device's buffer, where there is one.
fn buffer(wanted: usize) -> usize {
    bytes(wanted as u64) as usize
}

impl Sizes {
    fn add(&mut self, batch: &LawBatch, grouped: &Grouped) {
        let info = batch.element.info;
        let points = info.points.len();
        // A range has slopes of its reference element with its rest data.
        let slopes = if info.is_linear_simplex { 0 } else { points * (info.nodes - 1) };
        self.nodes += 16 * grouped.fours(info.nodes);
        self.slots += grouped.slots(info.nodes);
        for elements in [MEMBERS * grouped.strips.len(), grouped.alone.len()].into_iter().filter(|n| *n > 0) {
            let sets = if batch.per_element { elements } else { 1 };
            self.rest += 48 * points * elements + 16 * slopes;
            self.constants += buffer(4 * sets * batch.law.info.constants.len());
            self.margins += if batch.law.info.domain.is_some() { buffer(4 * elements) } else { 0 };
            self.stresses += buffer(36 * elements);
            self.largest = self.largest.max(elements);
        }
    }
}

/// The buffers of a scene.
pub(super) fn on_gpu(scene: &Scene, needed: &Needed, vectors: usize) -> Vec<Buffer> {
    let body = &needed.model.body;
    let nodes = body.masses.len();
    let order = DeviceOrder::of(body);
    let (mut all, mut damped) = (Sizes::default(), Sizes::default());
    let dissipative = |b: &LawBatch| b.law.damping.is_some();
    for (batch, grouped) in body.batches.iter().zip(&order.elements) {
        all.add(batch, grouped);
        // Where only some laws have a dissipation, their elements have buffers of their own for it.
        if body.is_viscous() && dissipative(batch) && !body.batches.iter().all(dissipative) {
            damped.add(batch, grouped);
        }
    }
    let incidence = |sizes: &Sizes| if sizes.slots > 0 { 4 * (sizes.slots + nodes + 1) } else { 0 };
    let entries = body.mass_matrix.as_ref().map_or((0, 0), |m| (m.values.len(), m.offsets.len()));
    let contact = body.contact.as_ref();
    let mut constrained: Vec<u32> = body.constraints.iter().map(|c| c.node).collect();
    constrained.dedup();
    let moved = contact.is_some() || !constrained.is_empty();
    let surface = contact.map_or(0, |contact| contact.nodes.len());
    let registers = 4 * REGISTERS;
    vec![
        (names::ELEMENT_NODES, all.nodes + damped.nodes),
        (names::REST, all.rest + damped.rest),
        (names::CONSTANTS, all.constants + damped.constants),
        (names::PARTIAL_FORCES, 16 * all.slots),
        (names::SLOTS, incidence(&all) + incidence(&damped)),
        (names::MARGINS, all.margins + damped.margins),
        // And the zero vector, which has the constraints.
        (names::VECTORS, 16 * (vectors + 1) * nodes),
        (names::CONSTRAINED, 16 * constrained.len()),
        (names::MASS_MATRIX, 8 * entries.0 + 4 * entries.1),
        (names::SURFACE, 16 * surface),
        (names::HELD, if needed.implicit { 16 * surface } else { 0 }),
        (names::PRESSED, pressed(needed)),
        (names::GRIDS, grids(needed, Layout::Gpu).iter().map(|(_, grid)| size_of_val(grid.values())).sum()),
        (names::PARTIALS, 4 * partial_sums(body, WORK_GROUP)),
        // That of a solver, and that of passes which nothing stops.
        (names::REGISTERS, if needed.implicit { 2 * registers } else { registers }),
        (names::NUMBERS, (PASSES * ALIGNMENT) as usize),
        (names::MOTIONS, if moved { 4 * motions(body) } else { 0 }),
        (names::OUTPUTS, if needed.records.stresses { all.stresses } else { 0 }),
        (names::RESULTS, results(scene, needed, &all)),
    ]
}

/// Of faces under pressure by pressure and kind: nodes, tangents, slots, and which of these each node adds up.
fn pressed(needed: &Needed) -> usize {
    let of_kind = |faces: &[&crate::body::PressedFace]| {
        let mut nodes: Vec<u32> = faces.iter().flat_map(|f| f.nodes.iter().copied()).collect();
        let tangents: usize = faces.iter().map(|f| 2 * f.tangents.len()).sum();
        let named = nodes.len();
        nodes.sort_unstable();
        nodes.dedup();
        [4 * named, 16 * tangents, 16 * named, 16 * nodes.len(), 4 * named].map(buffer).iter().sum::<usize>()
    };
    let mut sum = 0;
    for pressure in &needed.model.body.pressures {
        let mut kinds: Vec<(&str, Vec<&crate::body::PressedFace>)> = vec![];
        for face in &pressure.faces {
            match kinds.iter_mut().find(|(kind, _)| *kind == face.kind.name) {
                Some((_, faces)) => faces.push(face),
                None => kinds.push((face.kind.name, vec![face])),
            }
        }
        sum += kinds.iter().map(|(_, faces)| of_kind(faces)).sum::<usize>();
    }
    sum
}

/// The buffer through which the host reads: as large as the largest thing it asks for.
fn results(scene: &Scene, needed: &Needed, elements: &Sizes) -> usize {
    let body = &needed.model.body;
    let groups = |count: usize| 4 * count.div_ceil(GROUP as usize);
    let records = needed.records;
    let checkpoints = scene.output.checkpoint_every.is_some();
    let held = needed.implicit && body.contact.is_some();
    let vectors = records.displacement || records.velocity || records.reactions || needed.impulses;
    let of_domains = body.batches.iter().filter(|b| b.law.info.domain.is_some()).map(|b| b.elements.len());
    let parts = [
        (true, groups(body.masses.len())),
        (true, of_domains.map(groups).sum()),
        // The energies of the end.
        (true, 4 * elements.largest),
        (records.stresses, 36 * elements.largest),
        (needed.implicit, 4 * REGISTERS),
        (vectors || checkpoints || held || guard::reads(body, needed.implicit), 16 * body.masses.len()),
    ];
    parts.iter().filter(|(reads, _)| *reads).map(|(_, bytes)| bytes.next_power_of_two()).max().unwrap_or(0)
}
