//! Entities, nodes and elements of version 4.1: in blocks, one a geometric entity.

use super::element_type::kind;
use super::lines::{Lines, Problem, Words};
use super::{Raw, RawElement, RawNode, SAVE, Sets};
use std::collections::BTreeMap;

/// The physical groups of each geometric entity, by dimension and tag; `None` if the file has no `$Entities`.
#[derive(Default)]
pub(super) struct Entities(Option<BTreeMap<(usize, i32), u32>>);

/// Reads `$Entities`: points, curves, surfaces and volumes with their physical tags.
pub(super) fn entities(lines: &mut Lines<'_>, sets: &mut Sets) -> Result<Entities, Problem> {
    let mut words = lines.expect("the numbers of entities")?.words();
    let mut counts = [0_u64; 4];
    for (count, what) in counts.iter_mut().zip(["points", "curves", "surfaces", "volumes"]) {
        *count = words.read(&format!("the number of {what}"))?;
    }
    words.end()?;
    let mut entities = BTreeMap::new();
    for (dimension, count) in counts.into_iter().enumerate() {
        for _ in 0..count {
            let line = lines.expect("an entity")?;
            let mut words = line.words();
            let tag = words.read("an entity tag")?;
            // A point has a position, the others a bounding box.
            for _ in 0..if dimension == 0 { 3 } else { 6 } {
                let _: f64 = words.read("a coordinate")?;
            }
            let physical: u64 = words.read("the number of physical tags")?;
            let mut set = Vec::new();
            for _ in 0..physical {
                set.push(words.read("a physical tag")?);
            }
            // The bounding entities that follow say nothing about the mesh.
            entities.insert((dimension, tag), sets.intern(set));
        }
    }
    Ok(Entities(Some(entities)))
}

/// The numbers that head `$Nodes` and `$Elements`: blocks and entries; the least and the greatest tag are not needed.
fn header(lines: &mut Lines<'_>, what: &str) -> Result<(u64, u64), Problem> {
    let mut words = lines.expect(&format!("the numbers of blocks and {what}"))?.words();
    let counts = (words.read("the number of blocks")?, words.read(&format!("the number of {what}"))?);
    let _: u64 = words.read("the least tag")?;
    let _: u64 = words.read("the greatest tag")?;
    words.end()?;
    Ok(counts)
}

/// The entity that heads a block.
fn block(words: &mut Words<'_>) -> Result<(usize, i32), Problem> {
    Ok((words.read("the entity's dimension")?, words.read("the entity's tag")?))
}

/// Refuses a section whose blocks hold another number of entries than its header says.
fn check_total(lines: &Lines<'_>, what: &str, claimed: u64, found: u64) -> Result<(), Problem> {
    if claimed == found {
        return Ok(());
    }
    Err(lines.problem_here(format!("the header announces {claimed} {what}, the blocks hold {found}"), SAVE))
}

/// Reads `$Nodes`: in each block first the tags, then the positions.
pub(super) fn nodes(lines: &mut Lines<'_>, raw: &mut Raw) -> Result<(), Problem> {
    let (blocks, total) = header(lines, "nodes")?;
    raw.nodes.reserve_exact(lines.capacity(total, "1\n0 0 0\n".len()));
    for _ in 0..blocks {
        let line = lines.expect("a block of nodes")?;
        let mut words = line.words();
        let (dimension, _) = block(&mut words)?;
        let parametric: u8 = words.read("0 or 1 (parametric)")?;
        let count: u64 = words.read("the number of nodes in the block")?;
        words.end()?;
        let first = raw.nodes.len();
        for _ in 0..count {
            let line = lines.expect("a node tag")?;
            let mut words = line.words();
            let tag = words.read("a node tag")?;
            words.end()?;
            raw.nodes.push(RawNode { tag, position: [0.0; 3], line: line.number_u32(), on_point: dimension == 0 });
        }
        for node in &mut raw.nodes[first..] {
            let line = lines.expect("a node's coordinates")?;
            let mut words = line.words();
            node.position =
                [words.read("a coordinate x")?, words.read("a coordinate y")?, words.read("a coordinate z")?];
            // Parametric coordinates follow the position.
            if parametric == 0 {
                words.end()?;
            }
            node.line = line.number_u32();
        }
    }
    check_total(lines, "nodes", total, raw.nodes.len() as u64)
}

/// Reads `$Elements`: blocks of one entity and one type, an element a line.
pub(super) fn elements(lines: &mut Lines<'_>, entities: &Entities, raw: &mut Raw) -> Result<(), Problem> {
    let (blocks, total) = header(lines, "elements")?;
    for _ in 0..blocks {
        let line = lines.expect("a block of elements")?;
        let mut words = line.words();
        let entity = block(&mut words)?;
        let kind = kind(&line, words.read("an element type")?)?;
        let dimension = kind.dimension();
        let count: u64 = words.read("the number of elements in the block")?;
        words.end()?;
        if entity.0 != dimension {
            return Err(line.problem(
                format!("elements of dimension {dimension} on an entity of dimension {}", entity.0),
                "correct the block's first or third number, or save the mesh again",
            ));
        }
        let set = match &entities.0 {
            None => raw.sets.intern([]),
            Some(entities) => *entities.get(&entity).ok_or_else(|| {
                line.problem(format!("entity {} of dimension {dimension} is not in $Entities", entity.1), SAVE)
            })?,
        };
        raw.elements[dimension].reserve_exact(lines.capacity(count, "1 1\n".len()));
        for _ in 0..count {
            let line = lines.expect("an element")?;
            let mut words = line.words();
            let _tag: u64 = words.read("an element tag")?;
            let mut nodes = vec![0; kind.nodes()];
            for node in &mut nodes {
                *node = words.read("a node tag")?;
            }
            words.end()?;
            raw.elements[dimension].push(RawElement { kind: kind.element, nodes, set, line: line.number_u32() });
        }
    }
    check_total(lines, "elements", total, raw.elements.iter().map(|kind| kind.len() as u64).sum())
}
