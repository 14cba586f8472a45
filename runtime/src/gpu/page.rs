//! A body's elements as a GPU holds them: pages, as much of the mesh as the device can bind, of ranges of one law and kind.

use tensormass_kernels::shader::{Pass, Unit};
use tensormass_kernels::strip::{self, MEMBERS};
use tensormass_kernels::{ElementEntry, ElementInfo, LawEntry, RestPoint};

use crate::body::{Body, LawBatch};
use crate::device::DeviceError;
use crate::inventory::names::{CONSTANTS, ELEMENT_NODES, MARGINS, REST, SLOTS};
use crate::mesh::Incidence;
use crate::order::Grouped;
use crate::strips::{Member, reordered};

use super::recorder::{Memory, Recorder};

/// Bytes of a slot.
const SLOT_BYTES: u64 = 16;

/// Elements of one law and kind within a page, all in strips or none.
pub(super) struct Range {
    pub law: &'static LawEntry,
    pub element: &'static ElementEntry,
    /// What an invocation computes.
    pub unit: Unit,
    /// How many of these there are.
    pub units: usize,
    /// The mesh's number of each element; of strips those of all first ones, then of the second and of the third ones.
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
    /// For stresses, made when some are asked for.
    pub output: Option<Memory>,
}

/// Elements whose slots fit into one binding, and the slots of each node.
pub(super) struct Page {
    pub ranges: Vec<Range>,
    pub incidence: Memory,
}

/// Some elements of a batch, in order.
#[derive(Clone, Copy)]
enum Units<'a> {
    Elements(&'a [u32]),
    Strips(&'a [[Member; MEMBERS]]),
}

/// A part of one batch.
type Part<'a> = (&'a LawBatch, Units<'a>);

impl<'a> Units<'a> {
    fn of(grouped: &'a Grouped) -> [Self; 2] {
        [Self::Strips(&grouped.strips), Self::Elements(&grouped.alone)]
    }

    fn unit(self) -> Unit {
        match self {
            Self::Elements(_) => Unit::Element,
            Self::Strips(_) => Unit::Strip,
        }
    }

    fn len(self) -> usize {
        match self {
            Self::Elements(places) => places.len(),
            Self::Strips(strips) => strips.len(),
        }
    }

    fn range(self, range: std::ops::Range<usize>) -> Self {
        match self {
            Self::Elements(places) => Self::Elements(&places[range]),
            Self::Strips(strips) => Self::Strips(&strips[range]),
        }
    }

    /// Elements of one, and its nodes.
    fn sizes(self, info: &ElementInfo) -> [usize; 2] {
        match self {
            Self::Elements(_) => [1, info.nodes],
            Self::Strips(_) => [MEMBERS, strip::NODES],
        }
    }

    /// The elements by their places in the batch, as [`Range::elements`].
    fn places(self) -> Vec<u32> {
        match self {
            Self::Elements(places) => places.to_vec(),
            Self::Strips(strips) => (0..MEMBERS).flat_map(|m| strips.iter().map(move |s| s[m].element)).collect(),
        }
    }

    /// The nodes of one after the other, by their numbers in the mesh.
    fn nodes(self, body: &Body, batch: &LawBatch) -> Vec<u32> {
        let of_element = |place: u32| &body.elements[batch.elements[place as usize] as usize];
        match self {
            Self::Elements(places) => places.iter().flat_map(|place| of_element(*place)).copied().collect(),
            Self::Strips(strips) => {
                let along = |strip: &[Member; MEMBERS], m: usize| {
                    let nodes = of_element(strip[m].element);
                    strip[m].along(m).map(|n| nodes[usize::from(n)])
                };
                let all = |strip: &[Member; MEMBERS]| {
                    let [[n0, n1, n2, n3], [.., n4], [.., n5]] = [0, 1, 2].map(|m| along(strip, m));
                    [n0, n1, n2, n3, n4, n5]
                };
                strips.iter().flat_map(all).collect()
            }
        }
    }

    /// The points at rest: point by point those of each one.
    fn rest(self, body: &Body, batch: &LawBatch) -> Vec<RestPoint<f64>> {
        let of_element = |place: u32| &body.rest[batch.elements[place as usize] as usize];
        match self {
            Self::Elements(places) => {
                let points = 0..batch.element.info.points.len();
                points.flat_map(|q| places.iter().map(move |place| of_element(*place)[q])).collect()
            }
            Self::Strips(strips) => {
                let member = |m: usize, member: Member| reordered(&of_element(member.element)[0], member.along(m));
                (0..MEMBERS).flat_map(|m| strips.iter().map(move |strip| member(m, strip[m]))).collect()
            }
        }
    }
}

/// The elements of some batches, in the order that is given for each, in pages whose buffers have at most `limit` bytes.
/// Nodes are given by their places in vectors.
///
/// # Errors
/// A buffer is larger than the device can bind.
pub(super) fn pages<'a>(
    recorder: &Recorder,
    (body, places): (&Body, &[u32]),
    batches: impl Iterator<Item = (&'a LawBatch, &'a Grouped)>,
    limit: u64,
) -> Result<Vec<Page>, DeviceError> {
    paged(batches, limit).iter().map(|parts| Page::new(recorder, (body, places), parts)).collect()
}

/// Bytes of one of a part in the largest of its buffers.
fn widest((batch, units): Part) -> u64 {
    let [elements, nodes] = units.sizes(batch.element.info).map(|size| size as u64);
    let rest = 48 * batch.element.info.points.len() as u64 * elements;
    let constants = if batch.per_element { 4 * batch.law.info.constants.len() as u64 * elements } else { 0 };
    (SLOT_BYTES * nodes).max(rest).max(constants)
}

fn paged<'a>(batches: impl Iterator<Item = (&'a LawBatch, &'a Grouped)>, limit: u64) -> Vec<Vec<Part<'a>>> {
    let mut pages = vec![];
    let (mut page, mut room) = (vec![], limit);
    for (batch, units) in batches.flat_map(|(batch, grouped)| Units::of(grouped).map(|units| (batch, units))) {
        // A range's rest data end with the slopes of its reference element.
        let (widest, table) = (widest((batch, units)), 16 * slopes(batch.element.info).len() as u64);
        let mut start = 0;
        while start < units.len() {
            let fits = (room.saturating_sub(table) / widest) as usize;
            if fits == 0 && !page.is_empty() {
                pages.push(std::mem::take(&mut page));
                room = limit;
                continue;
            }
            // A device that cannot bind one element cannot be used; the buffer's own error says so.
            let end = (start + fits.max(1)).min(units.len());
            page.push((batch, units.range(start..end)));
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
        let nodes = parts.iter().flat_map(|(batch, units)| units.nodes(body, batch));
        let nodes: Vec<usize> = nodes.map(|n| places[n as usize] as usize).collect();
        let incidence = Incidence::of_slots(body.masses.len(), nodes.into_iter());
        // Where lists begin is counted from the beginning of the buffer that holds them too.
        let before = incidence.offsets().len() as u32;
        let offsets = incidence.offsets().iter().map(|offset| before + offset);
        let lists: Vec<u32> = offsets.chain(incidence.slots().iter().copied()).collect();
        let (mut ranges, mut first_slot) = (vec![], 0);
        for part in parts {
            let range = Range::new(recorder, (body, places), *part, first_slot)?;
            first_slot += range.slots() as u32;
            ranges.push(range);
        }
        Ok(Self { ranges, incidence: recorder.filled(SLOTS, &lists)? })
    }

    /// Bytes of the slots of all its elements.
    pub fn slot_bytes(&self) -> u64 {
        SLOT_BYTES * self.ranges.iter().map(Range::slots).sum::<usize>() as u64
    }
}

impl Range {
    /// Slots of its elements.
    fn slots(&self) -> usize {
        match self.unit {
            Unit::Element => self.units * self.element.info.nodes,
            Unit::Strip => self.units * strip::NODES,
        }
    }

    fn new(
        recorder: &Recorder,
        (body, places): (&Body, &[u32]),
        (batch, units): Part,
        first_slot: u32,
    ) -> Result<Self, DeviceError> {
        let (info, count) = (batch.element.info, batch.law.info.constants.len());
        let in_batch = units.places();
        let constants: Vec<f32> = if batch.per_element {
            let of_element = |place: &u32| &batch.constants[*place as usize * count..][..count];
            in_batch.iter().flat_map(of_element).map(|c| *c as f32).collect()
        } else {
            batch.constants.iter().map(|c| *c as f32).collect()
        };
        let elements: Vec<u32> = in_batch.iter().map(|place| batch.elements[*place as usize]).collect();
        let [_, of_unit] = units.sizes(info);
        let nodes: Vec<u32> = units.nodes(body, batch).iter().map(|n| places[*n as usize]).collect();
        let nodes = by_fours(of_unit, nodes.chunks_exact(of_unit));
        let rest = units.rest(body, batch);
        let row = |points: &[RestPoint<f64>], k: usize| -> Vec<[f32; 4]> {
            let row = |point: &RestPoint<f64>| {
                let g = &point.inverse_jacobian[3 * k..3 * k + 3];
                [g[0] as f32, g[1] as f32, g[2] as f32, if k == 0 { point.weight as f32 } else { 0.0 }]
            };
            points.iter().map(row).collect()
        };
        let rows = rest.chunks(units.len()).flat_map(|points| (0..3).flat_map(move |k| row(points, k)));
        let rest: Vec<[f32; 4]> = rows.chain(slopes(info)).collect();
        // A law whose stress tells a margin has a domain.
        let has_margin = Pass::Force.function(batch.law).is_some_and(|f| f.field.is_some());
        let margins = match has_margin {
            true => Some(recorder.memory(MARGINS, 4 * elements.len() as u64)?),
            false => None,
        };
        Ok(Self {
            law: batch.law,
            element: batch.element,
            unit: units.unit(),
            units: units.len(),
            stride: if batch.per_element { count as u32 } else { 0 },
            nodes: recorder.filled(ELEMENT_NODES, &nodes)?,
            rest: recorder.filled(REST, &rest)?,
            constants: recorder.filled(CONSTANTS, &constants)?,
            first_slot,
            margins,
            output: None,
            elements,
        })
    }
}
