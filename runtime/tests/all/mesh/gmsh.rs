//! The Gmsh reader: both versions give the same mesh, every fault is refused with its line, and no text makes it panic.

use super::{faces, two_tets};
use std::path::Path;
use tensormass_runtime::mesh::gmsh::{MeshFile, parse, read};
use tensormass_runtime::mesh::{ElementId, NodeId, Orientation};

/// The two elements of `two_tets` with sparse tags out of order, an arc's centre, and groups of all dimensions. The
/// triangle points inward, and the first element is in two physical volumes (hence twice, with two numbers).
const V2: &str = "\
$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
6
0 3 \"tip\"
0 4 \"centre\"
1 1 \"edge\"
2 1 \"base plate\"
3 2 \"body\"
3 9 \"unused\"
$EndPhysicalNames
$Nodes
6
50 1 1 1
7 0.5 0.5 -3
10 0 0 0
20 1.0 0 0

30 0 1e0 0
40 0 0 1
$EndNodes
$Elements
7
1 15 2 3 3 50
2 15 2 4 4 7
3 1 2 1 1 10 20
4 2 2 1 1 10 20 30
5 4 2 2 1 10 20 30 40
6 4 2 5 1 10 20 30 40
7 4 2 5 2 20 30 40 50
$EndElements
";

const V4: &str = "\
$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
6
0 3 \"tip\"
0 4 \"centre\"
1 1 \"edge\"
2 1 \"base plate\"
3 2 \"body\"
3 9 \"unused\"
$EndPhysicalNames
$Entities
2 1 1 2
3 1 1 1 1 3
4 0.5 0.5 -3 1 4
1 0 0 0 1 0 0 1 1 2 1 -2
1 0 0 0 1 1 0 1 -1 1 1
1 0 0 0 1 1 1 2 2 5 1 1
2 0 0 0 1 1 1 1 5 1 1
$EndEntities
$Nodes
3 6 7 50
0 3 0 1
50
1 1 1
0 4 0 1
7
0.5 0.5 -3
2 1 1 4
10
20
30
40
0 0 0 0 0
1.0 0 0 1 0
0 1e0 0 0 1
0 0 1 0.5 0.5
$EndNodes
$Elements
6 6 1 6
0 3 15 1
1 50
0 4 15 1
2 7
1 1 1 1
3 10 20
2 1 2 1
4 10 20 30
3 1 4 1
5 10 20 30 40
3 2 4 1
7 20 30 40 50
$EndElements
$NodeData
1
\"anything\"
$EndNodeData
";

fn parsed(text: &str) -> Result<MeshFile, String> {
    parse(Path::new("two.msh"), text.as_bytes(), Orientation::Refuse).map_err(|error| error.to_string())
}

#[test]
fn both_versions_give_the_same_mesh() {
    for (version, text) in [("2.2", V2.to_owned()), ("4.1", V4.to_owned()), ("CRLF", V4.replace('\n', "\r\n"))] {
        let MeshFile { mesh, warnings } = parsed(&text).expect(version);
        assert_eq!(mesh.nodes(), two_tets().nodes(), "{version}");
        assert_eq!(mesh.tets(), two_tets().tets(), "{version}");
        let nodes = |name| mesh.node_group(name).map(|group| group.iter().map(|node| node.0).collect::<Vec<_>>());
        assert_eq!(mesh.node_group_names().collect::<Vec<_>>(), ["base plate", "edge", "tip"], "{version}");
        assert_eq!(nodes("base plate"), Some(vec![0, 1, 2]), "{version}");
        assert_eq!(nodes("edge"), Some(vec![0, 1]), "{version}");
        assert_eq!(mesh.groups().edges["edge"], [[NodeId(0), NodeId(1)]], "{version}");
        assert_eq!(nodes("tip"), Some(vec![4]), "{version}");
        assert_eq!(mesh.face_group_names().collect::<Vec<_>>(), ["base plate"], "{version}");
        assert_eq!(mesh.face_group("base plate"), Some(&faces(&[[0, 2, 1]])[..]), "{version}: outward");
        assert_eq!(mesh.element_group_names().collect::<Vec<_>>(), ["body", "volume_5"], "{version}");
        assert_eq!(mesh.element_group("body"), Some(&[ElementId(0)][..]), "{version}");
        assert_eq!(mesh.element_group("volume_5"), Some(&[ElementId(0), ElementId(1)][..]), "{version}");
        let (line, expected_line) = if version == "2.2" { (16, 11) } else { (29, 11) };
        assert_eq!(
            warnings,
            [
                format!("left out 1 node that only geometry points use, first is Gmsh node 7 at line {line}"),
                "physical point `centre` has no nodes that elements use; it gives no group".to_owned(),
                "physical volume 5 has no name; its group is called `volume_5`".to_owned(),
                format!("physical volume `unused` (line {expected_line}) has no elements; it gives no group"),
            ],
            "{version}"
        );
    }
}

#[test]
fn files_are_read_and_missing_ones_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("two.msh");
    std::fs::write(&path, V4).expect("a writable folder");
    assert_eq!(read(&path, Orientation::Refuse).expect("a valid file"), parsed(V4).expect("a valid file"));

    let missing = read(Path::new("/nonexistent/x.msh"), Orientation::Refuse).expect_err("no such file").to_string();
    assert_eq!(
        missing,
        "cannot read the mesh /nonexistent/x.msh: No such file or directory (os error 2); \
         check its name and that you may read it"
    );
}

#[test]
fn orientation_is_repaired_on_request() {
    let turned = V2.replace("20 30 40 50", "30 20 40 50");
    let repaired = parse(Path::new("two.msh"), turned.as_bytes(), Orientation::Repair).expect("a valid file").mesh;
    assert_eq!(repaired.tets()[1], [2, 3, 1, 4].map(NodeId), "second and third node swapped");
    assert!((repaired.total_volume() - 0.5).abs() < 1e-15);
}

const SAVE: &str =
    "save it again as ASCII version 4.1: gmsh OLD.msh -save -format msh41 -setnumber Mesh.Binary 0 -o NEW.msh";

/// Base text, what to replace, by what, and the message.
const REFUSED: &[(&str, &str, &str, &str)] = &[
    (V4, "4.1 0 8", "4.1 1 8", "two.msh:2: the file is binary; {SAVE}"),
    (V4, "4.1 0 8", "4 0 8", "two.msh:2: the version of the format is `4`; 2.2 and 4.1 can be read; {SAVE}"),
    (
        V4,
        "$MeshFormat\n",
        "$NOD\n",
        "two.msh:1: a Gmsh file starts with $MeshFormat, this one with `$NOD`; \
         check that it is a Gmsh mesh; if it is an old one, {SAVE}",
    ),
    (
        V2,
        "7 4 2 5 2 20 30 40 50",
        "7 7 2 5 2 20 30 40 50 10",
        "two.msh:31: a pyramid (Gmsh element type 7); \
         mesh it otherwise, for instance into tetrahedra; {KNOWN}",
    ),
    (
        V4,
        "3 2 4 1",
        "3 2 29 1",
        "two.msh:52: a tetrahedron of higher order (Gmsh element type 29); \
         mesh to first or second order (gmsh MODEL.geo -3 -order 2); {KNOWN}",
    ),
    (
        V4,
        "3 2 4 1",
        "3 2 77 1",
        "two.msh:52: an element of unknown shape (Gmsh element type 77); \
         mesh it otherwise, for instance into tetrahedra; {KNOWN}",
    ),
    (V4, "3 2 4 1", "3 3 4 1", "two.msh:52: entity 3 of dimension 3 is not in $Entities; {SAVE}"),
    (
        V4,
        "3 2 4 1",
        "2 1 4 1",
        "two.msh:52: elements of dimension 3 on an entity of dimension 2; \
         correct the block's first or third number, or save the mesh again",
    ),
    (
        V2,
        "40 0 0 1",
        "40 0 0 l",
        "two.msh:21: expected a coordinate z, found `l`; correct the line or save the mesh again",
    ),
    (
        V2,
        "40 0 0 1",
        "40 0 0",
        "two.msh:21: the line ends where a coordinate z was expected; complete the line or save the mesh again",
    ),
    (
        V2,
        "40 0 0 1",
        "40 0 0 1 1",
        "two.msh:21: the line goes on with `1` where it should end; correct the line or save the mesh again",
    ),
    (V2, "40 0 0 1", "30 0 0 1", "two.msh:21: node 30 is given twice, also at line 20; give each node its own tag"),
    (
        V2,
        "7 4 2 5 2 20 30 40 50",
        "7 4 2 5 2 20 30 40 60",
        "two.msh:31: the element names node 60, which $Nodes does not give; \
         correct the node's tag, or save the mesh again",
    ),
    (
        V2,
        "$Nodes\n6",
        "$Nodes\n5",
        "two.msh:21: expected $EndNodes, found `40 0 0 1`; check the counts of $Nodes, or save the mesh again",
    ),
    (
        V2,
        "$Elements\n7",
        "$Elements\n1000000000000000000",
        "two.msh:32: expected an element number, found `$EndElements`; \
         the section's count is larger than its content: correct it, or save the mesh again",
    ),
    (
        V4,
        "3 6 7 50",
        "3 1000000000000000000 7 50",
        "two.msh:38: the header announces 1000000000000000000 nodes, the blocks hold 6; {SAVE}",
    ),
    (
        V4,
        "$EndElements\n$NodeData\n1\n\"anything\"\n$EndNodeData\n",
        "",
        "two.msh:53: the file ends where $EndElements was expected; \
         it is truncated, or a count is too large: save it again",
    ),
    (
        V4,
        "$EndNodeData\n",
        "",
        "two.msh:57: the file ends within $NodeData, which starts at line 55; it is truncated: save it again",
    ),
    (V4, "$NodeData", "$Nodes", "two.msh:55: a second $Nodes section (the first is at line 22); {SAVE}"),
    (
        V4,
        "$NodeData",
        "$PartitionedEntities",
        "two.msh:55: the mesh is partitioned; \
         mesh it again without -part, or save it as 2.2: gmsh OLD.msh -save -format msh22 -o NEW.msh",
    ),
    (
        V2,
        "0 3 \"tip\"",
        "0 3 tip",
        "two.msh:6: expected a name in double quotes, found `0 3 tip`; write: dimension tag \"name\"",
    ),
    (
        V2,
        "20 30 40 50",
        "30 20 40 50",
        "two.msh:31: 1 element is inverted, first is element 1 with volume -3.333e-1 m3 and nodes 2, 1, 3, 4; \
         swap two of its nodes, or set `orient = true` to have that done for every such element",
    ),
    (
        V2,
        "7 4 2 5 2 20 30 40 50",
        "7 4 2 2 1 10 20 30 40",
        "two.msh:30: 2 elements have the nodes of an earlier one, first is element 1, which repeats element 0; \
         remove one of them",
    ),
    (
        V2,
        "50 1 1 1",
        "50 1 nan 1",
        "two.msh:15: 1 node has a coordinate that is not finite, first is node 4 at (1, NaN, 1); \
         correct its coordinates",
    ),
    (
        V2,
        "2 15 2 4 4 7",
        "2 15 2 4 4 50",
        "two.msh:16: 1 node is used by no element, first is node 0; \
         a node without an element has no mass: remove it",
    ),
    (
        V2,
        "4 2 2 1 1 10 20 30",
        "4 2 2 1 1 10 20 50",
        "two.msh:28: 1 face of face group `base plate` is not a face of any element, first is (0, 1, 4); \
         take faces whose nodes are those of one face of an element, or remove the group",
    ),
    (
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n1\n1 0 0 0\n$EndNodes\n",
        "",
        "",
        "two.msh:7: the file ends without a $Elements section; it is truncated or holds no mesh: save it again",
    ),
    (
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n0\n$EndNodes\n$Elements\n0\n$EndElements\n",
        "",
        "",
        "two.msh:7: the mesh has no elements; give at least one tetrahedron (a surface mesh has none: fill it first)",
    ),
    (
        "",
        "",
        "",
        "two.msh:1: the file ends where $MeshFormat was expected; \
         it is truncated, or a count is too large: save it again",
    ),
];

#[test]
fn faults_are_refused_with_their_line() {
    let bodies = tensormass_kernels::elements().iter().map(|e| e.info).filter(|info| info.dimension > 1);
    let known = format!("elements of this build: {}", bodies.map(|info| info.name).collect::<Vec<_>>().join(", "));
    for (text, from, to, expected) in REFUSED {
        assert!(text.contains(from), "the case `{from}` -> `{to}` spoils nothing");
        let spoilt = if from.is_empty() { (*text).to_owned() } else { text.replacen(from, to, 1) };
        let found = parsed(&spoilt).expect_err(expected);
        let expected = expected.replace("{SAVE}", SAVE).replace("{KNOWN}", &known);
        assert_eq!(found, expected, "case `{from}` -> `{to}`");
    }
    let latin1 = [V2.as_bytes()[..60].to_vec(), vec![0xe9, b'\n']].concat();
    let error = parse(Path::new("two.msh"), &latin1, Orientation::Refuse).expect_err("not UTF-8").to_string();
    assert!(error.starts_with("two.msh:6: the line is not UTF-8 text; "), "{error}");
}

/// Refused with a line, or read; what matters is that it returns.
fn survives(text: &str) {
    if let Err(message) = parsed(text) {
        let line = message.strip_prefix("two.msh:").and_then(|rest| rest.split(':').next()).unwrap_or_default();
        let line: usize = line.parse().unwrap_or_else(|_| panic!("`{message}` has no line number"));
        assert!((1..=text.lines().count().max(1)).contains(&line), "`{message}`: no such line");
        assert!(message.contains("; ") || message.contains(": "), "`{message}` has no remedy");
    }
}

#[test]
fn truncated_files_are_refused() {
    for text in [V2, V4] {
        let end = text.find("$EndElements").expect("the section's end") + "$EndElements".len();
        for cut in 0..end {
            assert!(parsed(&text[..cut]).is_err(), "cut after {cut} bytes");
            survives(&text[..cut]);
        }
    }
}

#[test]
fn garbled_files_never_panic() {
    let garbage =
        ["-1", "0", "4", "nan", "1e308", "x", "\u{e9}", "", "1000000000000000000", "18446744073709551615", "$End"];
    for text in [V2, V4] {
        let words: Vec<(usize, &str)> =
            text.split_ascii_whitespace().map(|word| (word.as_ptr() as usize - text.as_ptr() as usize, word)).collect();
        for (start, word) in &words {
            for wrong in garbage {
                survives(&format!("{}{wrong}{}", &text[..*start], &text[start + word.len()..]));
            }
        }
        let lines: Vec<&str> = text.lines().collect();
        for place in 0..lines.len() {
            let mut changed = lines.clone();
            changed.remove(place);
            survives(&changed.join("\n"));
            changed = lines.clone();
            changed.insert(place, lines[place]);
            survives(&changed.join("\n"));
            changed = lines.clone();
            changed.swap(place, (place * 7 + 3) % lines.len());
            survives(&changed.join("\n"));
        }
    }
}
