//! Nodes and elements of version 2.2: one a line.

use super::element_type::kind;
use super::lines::{Lines, Problem};
use super::{Raw, RawElement, RawNode};

/// Reads `$Nodes`: their number, then a tag and three coordinates a line.
pub(super) fn nodes(lines: &mut Lines<'_>, raw: &mut Raw) -> Result<(), Problem> {
    let count = lines.count("the number of nodes")?;
    raw.nodes.reserve_exact(lines.capacity(count, "1 0 0 0\n".len()));
    for _ in 0..count {
        let line = lines.expect("a node")?;
        let mut words = line.words();
        let tag = words.read("a node tag")?;
        let position = [words.read("a coordinate x")?, words.read("a coordinate y")?, words.read("a coordinate z")?];
        words.end()?;
        raw.nodes.push(RawNode { tag, position, line: line.number_u32(), on_point: false });
    }
    Ok(())
}

/// Reads `$Elements`: their number, then `number type tags .. nodes ..` a line; the first tag is the physical group.
pub(super) fn elements(lines: &mut Lines<'_>, raw: &mut Raw) -> Result<(), Problem> {
    let count = lines.count("the number of elements")?;
    for _ in 0..count {
        let line = lines.expect("an element")?;
        let mut words = line.words();
        let _number: u64 = words.read("an element number")?;
        let kind = kind(&line, words.read("an element type")?)?;
        let tags: u64 = words.read("the number of tags")?;
        let mut physical = 0;
        for tag in 0..tags {
            let value: i32 = words.read("a tag")?;
            if tag == 0 {
                physical = value;
            }
        }
        let mut nodes = vec![0; kind.nodes()];
        for node in &mut nodes {
            *node = words.read("a node tag")?;
        }
        words.end()?;
        let set = raw.sets.intern([physical]);
        raw.elements[kind.dimension()].push(RawElement { kind: kind.element, nodes, set, line: line.number_u32() });
    }
    merge_repeated(raw);
    Ok(())
}

/// Merges elements that differ in their physical group only: version 2.2 has one tag for it, so that Gmsh writes an
/// element of several groups several times.
fn merge_repeated(raw: &mut Raw) {
    let Raw { elements, sets, .. } = raw;
    if sets.list.len() < 2 {
        return;
    }
    for elements in elements {
        let mut keys: Vec<(Vec<u64>, usize)> = elements
            .iter()
            .enumerate()
            .map(|(place, element)| {
                let mut nodes = element.nodes.clone();
                nodes.sort_unstable();
                (nodes, place)
            })
            .collect();
        keys.sort_unstable();
        let mut keep = vec![true; elements.len()];
        for run in keys.chunk_by(|a, b| a.0 == b.0).filter(|run| run.len() > 1) {
            let mut union: Vec<u32> =
                run.iter().flat_map(|(_, place)| sets.list[elements[*place].set as usize].clone()).collect();
            union.sort_unstable();
            union.dedup();
            // Elements without a group, or twice in the same one, are true repetitions, which the mesh refuses.
            if union.len() != run.len() {
                continue;
            }
            // Tags were i32 without a sign, so that they fit again.
            elements[run[0].1].set = sets.intern(union.into_iter().map(|tag| tag as i32));
            for (_, place) in &run[1..] {
                keep[*place] = false;
            }
        }
        let mut keep = keep.into_iter();
        elements.retain(|_| keep.next().unwrap_or(true));
    }
}
