//! Sizes of a GPU's buffers that follow from how passes are recorded: for those who make them, and for plans, which need none.

use crate::body::Body;
use crate::contact::NUMBERS;

/// Invocations of a work group that runs over nodes; a power of two, and WebGPU's default limit.
pub const GROUP: u32 = 256;
/// Invocations of a work group of the element and node passes, unless someone chooses others.
pub const WORK_GROUP: u32 = 64;
/// Distance of the numbers of two passes: WebGPU's alignment of uniform offsets.
pub const ALIGNMENT: u64 = 256;
/// Passes with numbers of their own in one submission.
pub const PASSES: u64 = 1024;

/// Partial sums of a body where work groups are of this size: one a group, and a few more, since groups have two dimensions.
pub fn partial_sums(body: &Body, work_group_size: u32) -> usize {
    let largest = body.masses.len().max(body.elements.len());
    largest.div_ceil(work_group_size.min(GROUP) as usize) + (1 << 16) + body.batches.len()
}

/// Values of motions that one submission takes: room for several impositions, and for the ways of obstacles.
pub fn motions(body: &Body) -> usize {
    let of_contact = body.contact.as_ref().map_or(0, |contact| NUMBERS * contact.obstacles.len());
    (4 * (body.motions.len() + of_contact)).max(1024)
}

/// Bytes of a buffer for this many: an empty one cannot be bound.
pub fn bytes(wanted: u64) -> u64 {
    wanted.max(16).next_multiple_of(4)
}
