//! The buffers of a plan with their bytes: under the names, and as large, as a run enters them in its inventory.
//!
//! Of an assembled tangent the filling of lanes is left out, which is found when it is assembled.

use tensormass_kernels::pairs;

use super::device::on_gpu;
use super::{Layout, Needed};
use crate::body::{Constraint, LawBatch};
use crate::contact::{Grid, Shape};
use crate::cpu::{ElementBytes, TOUCHING_BYTES, element_bytes, pressed_bytes};
use crate::inventory::names;
use crate::order::{Sharing, blocks_of_clusters, sharing};
use crate::scene::{Precision, Scene};
use crate::tangent::{Tangent, blocks};

/// A buffer's name and bytes.
pub(super) type Buffer = (&'static str, usize);

/// The buffers of a scene on a device, those without bytes left out.
pub(super) fn buffers(scene: &Scene, needed: &Needed, layout: Layout, vectors: usize) -> Vec<Buffer> {
    let all = match layout {
        Layout::Cpu => on_cpu(scene, needed, vectors),
        Layout::Gpu => on_gpu(scene, needed, vectors),
    };
    all.into_iter().filter(|(_, bytes)| *bytes > 0).collect()
}

fn on_cpu(scene: &Scene, needed: &Needed, vectors: usize) -> Vec<Buffer> {
    let body = &needed.model.body;
    let nodes = body.masses.len();
    let real = scene.solver.precision.bytes();
    let bytes = match scene.solver.precision {
        Precision::F32 => element_bytes::<f32>,
        Precision::F64 => element_bytes::<f64>,
    };
    let with = |tangent: Tangent| {
        let tangents = needed.tangents.iter();
        body.batches.iter().zip(tangents).map(move |(b, t)| (b, *t == Some(tangent)))
    };
    let mut elements = ElementBytes::default();
    for (batch, stores) in with(Tangent::Stored) {
        let of = bytes(body, batch);
        elements.places += of.places;
        elements.rest += of.rest;
        elements.constants += of.constants;
        elements.stored += if stores { of.stored } else { 0 };
    }
    // Numbers, columns and places of the blocks that clusters own; slots of those that they share, and who has them; and where
    // an element's blocks are.
    let matrix = |b: &LawBatch| {
        let (own, places) = (blocks(body, b), pairs(b.element.info.nodes).count() * b.elements.len());
        let foreign = blocks_of_clusters(body, b) - own;
        (9 * real + 6) * own + (9 * real + 16) * foreign + 4 * places
    };
    let assembled = with(Tangent::Assembled).filter(|(_, assembles)| *assembles).map(|(b, _)| matrix(b)).sum();
    // Each node has a partial force, and one for each cluster to which it is foreign; a number both ways, and where the numbers
    // of a shared node are.
    let Sharing { foreign, shared } = sharing(body);
    let (entries, rows) = body.mass_matrix.as_ref().map_or((0, 0), |m| (m.values.len(), m.offsets.len()));
    let pressed = body.pressures.iter().flat_map(|p| &p.faces);
    let contact = body.contact.as_ref();
    let shapes = contact.iter().flat_map(|contact| &contact.obstacles).map(|o| &o.shape);
    vec![
        (names::ELEMENT_NODES, elements.places),
        (names::REST, elements.rest),
        (names::CONSTANTS, elements.constants),
        (names::ELEMENT_NUMBERS, 4 * body.elements.len()),
        (names::PARTIAL_FORCES, 3 * real * (nodes + foreign)),
        (names::SLOTS, 8 * foreign + 12 * shared),
        (names::PLACES, 4 * nodes),
        (names::CONSTRAINED, size_of::<Constraint>() * body.constraints.len()),
        (names::STORED_TANGENT, elements.stored),
        (names::ASSEMBLED_TANGENT, assembled),
        (names::VECTORS, vectors * 3 * real * nodes),
        (names::MASS_MATRIX, (4 + real) * entries + 4 * rows),
        (names::SURFACE, TOUCHING_BYTES * contact.map_or(0, |contact| contact.nodes.len())),
        (names::PRESSED, pressed.map(pressed_bytes).sum()),
        (names::TRIANGLES, shapes.map(Shape::bytes).sum()),
    ]
}

/// The distances that a device has in place of the triangles of obstacles, with the obstacles' numbers.
pub(super) fn grids(needed: &Needed, layout: Layout) -> Vec<(usize, Grid)> {
    let contact = needed.model.body.contact.as_ref().filter(|_| layout == Layout::Gpu);
    let shapes = contact.iter().flat_map(|contact| &contact.obstacles).map(|o| &o.shape);
    shapes.enumerate().filter_map(|(i, shape)| Some((i, Grid::bake(shape.solid()?)))).collect()
}
