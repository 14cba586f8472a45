//! A body's elements as a GPU holds them: pages, as much of the mesh as the device can bind, of ranges of one law and kind.

use tensormass_kernels::shader::Pass;
use tensormass_kernels::{ElementEntry, ElementInfo, LawEntry};

use crate::body::{Body, LawBatch};
use crate::device::DeviceError;
use crate::mesh::Incidence;

use super::recorder::{Memory, Recorder};

/// Bytes of a slot.
const SLOT_BYTES: u64 = 16;

/// Elements of one law and kind within a page.
pub(super) struct Range {
    pub law: &'static LawEntry,
    pub element: &'static ElementEntry,
    /// The mesh's number of each element.
    pub elements: Vec<u32>,
    /// Constants between one element's set and the next.
    pub stride: u32,
    pub nodes: Memory,
    pub rest: Memory,
    pub constants: Memory,
    /// The first slot of its first element.
    pub first_slot: u32,
    /// Only where the law has a domain.
    pub margins: Option<Memory>,
    /// For what an output pass writes, made when one is asked for.
    pub output: Option<Memory>,
}

/// Elements whose slots fit into one binding, and the slots of each node.
pub(super) struct Page {
    pub ranges: Vec<Range>,
    pub incidence: Memory,
}

/// A part of one batch: the batch, and which of its elements, in order.
type Part<'a> = (&'a LawBatch, &'a [u32]);

/// The mesh's numbers of the elements of a part.
fn elements<'a>((batch, part): Part<'a>) -> impl Iterator<Item = u32> + Clone + 'a {
    part.iter().map(|place| batch.elements[*place as usize])
}

/// The elements of some batches, in the order that is given for each, in pages whose buffers have at most `limit` bytes.
/// Nodes are given by their places in vectors.
///
/// # Errors
/// A buffer is larger than the device can bind.
pub(super) fn pages<'a>(
    recorder: &Recorder,
    (body, places): (&Body, &[u32]),
    batches: impl Iterator<Item = (&'a LawBatch, &'a Vec<u32>)>,
    limit: u64,
) -> Result<Vec<Page>, DeviceError> {
    paged(batches, limit).iter().map(|parts| Page::new(recorder, (body, places), parts)).collect()
}

/// Bytes an element in the largest of a batch's buffers.
fn widest(batch: &LawBatch) -> u64 {
    let info = batch.element.info;
    let rest = 48 * info.points.len() as u64;
    let constants = if batch.per_element { 4 * batch.law.info.constants.len() as u64 } else { 0 };
    (SLOT_BYTES * info.nodes as u64).max(rest).max(constants)
}

fn paged<'a>(batches: impl Iterator<Item = (&'a LawBatch, &'a Vec<u32>)>, limit: u64) -> Vec<Vec<Part<'a>>> {
    let mut pages = vec![];
    let (mut page, mut room) = (vec![], limit);
    for (batch, order) in batches {
        // A range's rest data end with the slopes of its reference element.
        let (widest, table) = (widest(batch), 16 * slopes(batch.element.info).len() as u64);
        let mut start = 0;
        while start < batch.elements.len() {
            let fits = (room.saturating_sub(table) / widest) as usize;
            if fits == 0 && !page.is_empty() {
                pages.push(std::mem::take(&mut page));
                room = limit;
                continue;
            }
            // A device that cannot bind one element cannot be used; the buffer's own error says so.
            let end = (start + fits.max(1)).min(batch.elements.len());
            page.push((batch, &order[start..end]));
            room = room.saturating_sub(table + widest * (end - start) as u64);
            start = end;
        }
    }
    if !page.is_empty() {
        pages.push(page);
    }
    pages
}

/// What a range's rest data end with: slopes of the reference element, point by point, as the passes read them.
fn slopes(info: &ElementInfo) -> Vec<[f32; 4]> {
    let four = |[x, y, z]: &[f64; 3]| [*x as f32, *y as f32, *z as f32, 0.0];
    let points = info.points.iter().filter(|_| !info.is_linear_simplex);
    points.flat_map(|point| point.gradients[1..].iter().map(four)).collect()
}

/// Rows of n numbers as passes read them: the first four numbers of each row, then the next four of each, and so on.
fn by_fours<'a>(n: usize, rows: impl Iterator<Item = &'a [u32]> + Clone) -> Vec<[u32; 4]> {
    let block =
        |k: usize| rows.clone().map(move |row| std::array::from_fn(|i| row.get(4 * k + i).copied().unwrap_or(0)));
    (0..n.div_ceil(4)).flat_map(block).collect()
}

impl Page {
    fn new(recorder: &Recorder, (body, places): (&Body, &[u32]), parts: &[Part]) -> Result<Self, DeviceError> {
        let elements = parts.iter().flat_map(|part| elements(*part));
        let nodes = elements.flat_map(|e| &body.elements[e as usize]).map(|n| places[*n as usize] as usize);
        let incidence = Incidence::of_slots(body.masses.len(), nodes.collect::<Vec<_>>().into_iter());
        // Where lists begin is counted from the beginning of the buffer that holds them too.
        let before = incidence.offsets().len() as u32;
        let offsets = incidence.offsets().iter().map(|offset| before + offset);
        let lists: Vec<u32> = offsets.chain(incidence.slots().iter().copied()).collect();
        let (mut ranges, mut first_slot) = (vec![], 0);
        for part in parts {
            ranges.push(Range::new(recorder, (body, places), *part, first_slot)?);
            first_slot += (part.1.len() * part.0.element.info.nodes) as u32;
        }
        Ok(Self { ranges, incidence: recorder.filled("slots of nodes", &lists)? })
    }

    /// Bytes of the slots of all its elements.
    pub fn slot_bytes(&self) -> u64 {
        SLOT_BYTES * self.ranges.iter().map(|r| r.elements.len() * r.element.info.nodes).sum::<usize>() as u64
    }
}

impl Range {
    fn new(
        recorder: &Recorder,
        (body, places): (&Body, &[u32]),
        (batch, part): Part,
        first_slot: u32,
    ) -> Result<Self, DeviceError> {
        let (info, count) = (batch.element.info, batch.law.info.constants.len());
        let constants: Vec<f32> = if batch.per_element {
            let of_element = |place: &u32| &batch.constants[*place as usize * count..][..count];
            part.iter().flat_map(of_element).map(|c| *c as f32).collect()
        } else {
            batch.constants.iter().map(|c| *c as f32).collect()
        };
        let elements: Vec<u32> = elements((batch, part)).collect();
        let of_elements = elements.iter().flat_map(|&e| &body.elements[e as usize]);
        let nodes: Vec<u32> = of_elements.map(|n| places[*n as usize]).collect();
        let nodes = by_fours(info.nodes, nodes.chunks_exact(info.nodes));
        let row = |(q, k): (usize, usize)| {
            elements.iter().map(move |&e| {
                let point = &body.rest[e as usize][q];
                let g = &point.inverse_jacobian[3 * k..3 * k + 3];
                [g[0] as f32, g[1] as f32, g[2] as f32, if k == 0 { point.weight as f32 } else { 0.0 }]
            })
        };
        let rows = (0..info.points.len()).flat_map(|q| (0..3).map(move |k| (q, k)));
        let rest: Vec<[f32; 4]> = rows.flat_map(row).chain(slopes(info)).collect();
        // A law whose stress tells a margin has a domain.
        let has_margin = Pass::Force.function(batch.law).is_some_and(|f| f.field.is_some());
        let margins = match has_margin {
            true => Some(recorder.memory("margins of elements", 4 * elements.len() as u64)?),
            false => None,
        };
        Ok(Self {
            law: batch.law,
            element: batch.element,
            stride: if batch.per_element { count as u32 } else { 0 },
            nodes: recorder.filled("nodes of elements", &nodes)?,
            rest: recorder.filled("rest data of elements", &rest)?,
            constants: recorder.filled("constants of materials", &constants)?,
            first_slot,
            margins,
            output: None,
            elements,
        })
    }
}
