//! Results on disk: VTU read back bit for bit, PVD, CSV and JSON to the letter, and nothing half-written.

use flate2::read::ZlibDecoder;
use std::collections::BTreeMap;
use std::fs;
use std::io::Read;
use std::path::Path;
use tempfile::{TempDir, tempdir};
use tensormass_runtime::mesh::beam;
use tensormass_runtime::output::{
    Cells, Field, FieldValues, OutputError, ProbeTable, PvdWriter, create_folder, write_atomic, write_json_atomic,
    write_vtu,
};

fn folder() -> TempDir {
    tempdir().expect("a temporary folder")
}

/// The names in a folder, sorted.
fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a readable folder");
    let mut names: Vec<String> =
        entries.map(|entry| entry.expect("an entry").file_name().into_string().expect("UTF-8")).collect();
    names.sort();
    names
}

/// An array of a VTU file: its type, components and inflated bytes.
#[derive(Debug, PartialEq)]
struct Array {
    kind: String,
    components: usize,
    bytes: Vec<u8>,
}

/// What a small independent reader finds in a VTU file: points, cells, and arrays by name.
struct Vtu {
    points: usize,
    cells: usize,
    arrays: BTreeMap<String, Array>,
}

fn attribute<'a>(element: &'a str, name: &str) -> &'a str {
    let start = element.find(&format!("{name}=\"")).unwrap_or_else(|| panic!("{element} lacks {name}"));
    element[start + name.len() + 2..].split('"').next().expect("split gives at least one part")
}

fn read_vtu(path: &Path) -> Vtu {
    let file = fs::read(path).expect("a file to read");
    let marker = b"<AppendedData encoding=\"raw\">\n_";
    let data = file.windows(marker.len()).position(|window| window == marker).expect("appended data") + marker.len();
    let xml = std::str::from_utf8(&file[..data]).expect("the header is UTF-8");
    for part in [
        "byte_order=\"LittleEndian\"",
        "header_type=\"UInt64\"",
        "compressor=\"vtkZLibDataCompressor\"",
        "version=\"1.0\"",
    ] {
        assert!(xml.contains(part), "{part} is missing in {xml}");
    }
    let piece = xml.lines().find(|line| line.contains("<Piece")).expect("a piece");
    let number = |at: usize| {
        usize::try_from(u64::from_le_bytes(file[at..at + 8].try_into().expect("eight bytes"))).expect("a small number")
    };
    let mut end = data;
    let mut arrays = BTreeMap::new();
    for element in xml.lines().filter(|line| line.contains("<DataArray")) {
        let start = data + attribute(element, "offset").parse::<usize>().expect("an offset");
        assert_eq!(start, end, "arrays follow each other without gaps");
        let (blocks, size, last) = (number(start), number(start + 8), number(start + 16));
        let mut from = start + 8 * (3 + blocks);
        let mut bytes = Vec::new();
        for block in 0..blocks {
            let compressed = number(start + 8 * (3 + block));
            let mut inflated = Vec::new();
            let mut decoder = ZlibDecoder::new(&file[from..from + compressed]);
            decoder.read_to_end(&mut inflated).expect("a zlib block");
            let expected = if block + 1 == blocks && last != 0 { last } else { size };
            assert_eq!(inflated.len(), expected, "block {block} of {element}");
            bytes.extend(inflated);
            from += compressed;
        }
        end = from;
        let (kind, components) = (attribute(element, "type").to_owned(), attribute(element, "NumberOfComponents"));
        let components = components.parse().expect("a number");
        arrays.insert(attribute(element, "Name").to_owned(), Array { kind, components, bytes });
    }
    assert_eq!(&file[end..], b"\n  </AppendedData>\n</VTKFile>\n");
    let count = |name| attribute(piece, name).parse().expect("a number");
    Vtu { points: count("NumberOfPoints"), cells: count("NumberOfCells"), arrays }
}

fn bytes<T: Copy, const N: usize>(values: &[T], to_bytes: fn(T) -> [u8; N]) -> Vec<u8> {
    values.iter().flat_map(|value| to_bytes(*value)).collect()
}

/// Tetrahedra as cells.
fn tetrahedra(tets: &[[u32; 4]]) -> Cells {
    let mut cells = Cells::default();
    tets.iter().for_each(|tet| cells.push(10, *tet));
    cells
}

#[test]
fn vtu_reads_back_bit_for_bit() {
    let folder = folder();
    // One cell; some; and one whose arrays take several blocks, the last one full or not.
    for cells in [[1, 1, 1], [3, 2, 2], [32, 16, 16]] {
        let mesh = beam([3.0, 1.0, 0.1], cells, [0.1; 3]).expect("a valid beam");
        let (points, elements) = (mesh.nodes().len(), mesh.tets().len());
        let tets: Vec<[u32; 4]> = mesh.tets().iter().map(|tet| tet.map(|node| node.0)).collect();
        let cells_of_file = tetrahedra(&tets);
        let special = [f64::NAN, f64::INFINITY, -0.0, 5e-324, f64::MIN_POSITIVE / 3.0, 1.0 / 3.0];
        let displacement: Vec<f64> = (0..3 * points).map(|i| special[i % 6] * (1.0 + i as f64)).collect();
        let pressure: Vec<f32> = (0..points).map(|i| (i as f32).sin()).collect();
        let stress: Vec<f64> = (0..9 * elements).map(|i| (i as f64).cos()).collect();
        let material: Vec<u32> = (0..elements as u32).map(|e| u32::MAX - e).collect();
        let point_fields = [
            Field { name: "displacement", components: 3, values: FieldValues::F64(&displacement) },
            Field { name: "p < 0 & \"odd\"", components: 1, values: FieldValues::F32(&pressure) },
        ];
        let cell_fields = [
            Field { name: "stress", components: 9, values: FieldValues::F64(&stress) },
            Field { name: "material", components: 1, values: FieldValues::U32(&material) },
        ];
        let path = folder.path().join("frame.vtu");
        write_vtu(&path, mesh.nodes(), &cells_of_file, &point_fields, &cell_fields).expect("a writable folder");
        let first = fs::read(&path).expect("a file");
        write_vtu(&path, mesh.nodes(), &cells_of_file, &point_fields, &cell_fields).expect("a writable folder");
        assert!(first == fs::read(&path).expect("a file"), "{cells:?}: the same input gives the same file");

        let vtu = read_vtu(&path);
        assert_eq!((vtu.points, vtu.cells), (points, elements), "{cells:?}");
        let offsets: Vec<i64> = (1..=elements).map(|cell| 4 * cell as i64).collect();
        let expected: [(&str, &str, usize, Vec<u8>); 8] = [
            ("displacement", "Float64", 3, bytes(&displacement, f64::to_le_bytes)),
            ("p &lt; 0 &amp; &quot;odd&quot;", "Float32", 1, bytes(&pressure, f32::to_le_bytes)),
            ("stress", "Float64", 9, bytes(&stress, f64::to_le_bytes)),
            ("material", "UInt32", 1, bytes(&material, u32::to_le_bytes)),
            ("Points", "Float64", 3, bytes(mesh.nodes().as_flattened(), f64::to_le_bytes)),
            ("connectivity", "UInt32", 1, bytes(tets.as_flattened(), u32::to_le_bytes)),
            ("offsets", "Int64", 1, bytes(&offsets, i64::to_le_bytes)),
            ("types", "UInt8", 1, vec![10; elements]),
        ];
        assert_eq!(vtu.arrays.len(), expected.len(), "{cells:?}");
        for (name, kind, components, bytes) in expected {
            let array = &vtu.arrays[name];
            assert_eq!((array.kind.as_str(), array.components), (kind, components), "{cells:?}: {name}");
            assert!(array.bytes == bytes, "{cells:?}: the values of {name} differ");
        }
        assert_eq!(names(folder.path()), ["frame.vtu"], "no temporary file is left");
    }
}

#[test]
fn vtu_refuses_fields_that_do_not_fit() {
    let folder = folder();
    let path = folder.path().join("frame.vtu");
    let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let check = |tets: &[[u32; 4]], point_fields: &[Field<'_>], cell_fields: &[Field<'_>], reason: &str| {
        let error =
            write_vtu(&path, &points, &tetrahedra(tets), point_fields, cell_fields).expect_err(reason).to_string();
        let remedy = "give every array the length that its points, elements or columns ask for";
        assert_eq!(error, format!("cannot write {}: {reason}; {remedy}", path.display()));
        assert!(names(folder.path()).is_empty(), "nothing is written");
    };
    let field = |name, components, values| Field { name, components, values: FieldValues::F64(values) };
    let one = [[0, 1, 2, 3]];
    let u = field("u", 3, &[0.0; 11]);
    check(&one, &[u], &[], "point field `u` has 11 values, 4 points of 3 components were expected");
    let s = field("s", 0, &[]);
    check(&one, &[], &[s], "cell field `s` has 0 values, 1 cells of 0 components were expected");
    let v = field("v", 1, &[0.0; 4]);
    check(&one, &[v, v], &[], "there are two point fields `v`");
    check(&[[0, 1, 2, 4]], &[], &[], "cell 0 names point 4, there are 4");
}

#[test]
fn pvd_lists_the_frames_written_so_far() {
    let folder = folder();
    let path = folder.path().join("frames.pvd");
    let start = "<?xml version=\"1.0\"?>\n\
                 <VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n  <Collection>\n";
    let end = "  </Collection>\n</VTKFile>\n";
    let check = |frames: &str| {
        assert_eq!(fs::read_to_string(&path).expect("a file"), format!("{start}{frames}{end}"));
        assert_eq!(names(folder.path()), ["frames.pvd"], "no temporary file is left");
    };
    fs::write(&path, "an index of an earlier run").expect("a writable folder");
    let mut pvd = PvdWriter::create(&path).expect("a writable folder");
    check("");
    pvd.push(0.0, "frames/0000.vtu").expect("a writable folder");
    let first = "    <DataSet timestep=\"0.0\" part=\"0\" file=\"frames/0000.vtu\"/>\n";
    check(first);
    pvd.push(0.1 + 0.2, "a<b & \"c\">\n.vtu").expect("a writable folder");
    let second =
        "    <DataSet timestep=\"0.30000000000000004\" part=\"0\" file=\"a&lt;b &amp; &quot;c&quot;&gt; .vtu\"/>\n";
    check(&format!("{first}{second}"));
}

#[test]
fn probe_rows_are_kept_as_they_come() {
    let folder = folder();
    let path = folder.path().join("probes.csv");
    let text = || fs::read_to_string(&path).expect("a file");
    let mut table = ProbeTable::create(&path, &["time_s", "tip, \"z\" (m)"]).expect("a writable folder");
    let header = "time_s,\"tip, \"\"z\"\" (m)\"\n";
    assert_eq!(text(), header);
    let rows = [[0.0, -0.0], [0.1 + 0.2, 1e-7], [f64::NAN, f64::NEG_INFINITY], [5e-324, f64::MAX], [1.0 / 3.0, 1e300]];
    for (count, row) in rows.iter().enumerate() {
        table.append(row).expect("a writable file");
        // The table is still open: a killed run would leave just this.
        let text = text();
        let lines: Vec<&str> = text.strip_prefix(header).expect("the header").lines().collect();
        assert!(text.ends_with('\n') && lines.len() == count + 1, "{text}");
        for (line, row) in lines.iter().zip(&rows) {
            let back: Vec<u64> = line.split(',').map(|cell| cell.parse::<f64>().expect("a number").to_bits()).collect();
            assert_eq!(back, row.map(f64::to_bits), "{line}");
        }
    }
    assert_eq!(text().lines().nth(2), Some("0.30000000000000004,1e-7"));
    let error = table.append(&[1.0]).expect_err("a short row").to_string();
    assert!(error.contains("probes.csv: a row has 1 values, the table has 2 columns; "), "{error}");
}

#[test]
fn json_keeps_every_bit() {
    let folder = folder();
    let path = folder.path().join("summary.json");
    let value = serde_json::json!({ "nodes": 8, "tip": 0.1 + 0.2 });
    write_json_atomic(&path, &value).expect("a writable folder");
    let text = fs::read_to_string(&path).expect("a file");
    assert_eq!(text, "{\n  \"nodes\": 8,\n  \"tip\": 0.30000000000000004\n}\n");
    assert_eq!(serde_json::from_str::<serde_json::Value>(&text).expect("JSON"), value);
}

#[test]
fn a_failed_write_leaves_the_old_file() {
    let folder = folder();
    let path = folder.path().join("state");
    fs::write(&path, "old").expect("a writable folder");
    let error = write_atomic(&path, |file| {
        std::io::Write::write_all(file, b"half of the n")?;
        Err(std::io::Error::from(std::io::ErrorKind::StorageFull))
    });
    let message = error.expect_err("the disk is full").to_string();
    assert!(message.ends_with("free some space, write fewer frames, or give a folder on another disk with --out"));
    assert_eq!(fs::read_to_string(&path).expect("a file"), "old");
    assert_eq!(names(folder.path()), ["state"], "no temporary file is left");
}

#[test]
fn unwritable_places_are_refused_with_a_remedy() {
    let folder = folder();
    let file = folder.path().join("file");
    fs::write(&file, "").expect("a writable folder");
    let missing = folder.path().join("missing");
    let write = |path: &Path| -> [Result<(), OutputError>; 4] {
        [
            write_vtu(path, &[], &Cells::default(), &[], &[]),
            PvdWriter::create(path).map(drop),
            ProbeTable::create(path, &["time_s"]).map(drop),
            write_json_atomic(path, &serde_json::Value::Null),
        ]
    };
    // Permissions are not tested: root, whom containers often run as, may write everywhere.
    for (path, remedy) in [
        (missing.join("result"), "(os error 2); create the folder, or give another one with --out"),
        (
            file.join("result"),
            "(os error 20); a file stands where a folder is needed: remove it, or give another folder with --out",
        ),
        (
            folder.path().to_owned(),
            "(os error 21); a folder stands where the file goes: remove it, or give another folder with --out",
        ),
    ] {
        for result in write(&path) {
            let message = result.expect_err(remedy).to_string();
            assert!(message.starts_with(&format!("cannot write {}: ", path.display())), "{message}");
            assert!(message.ends_with(remedy), "{message}");
        }
    }
    let error = create_folder(&file.join("out")).expect_err("a file is in the way").to_string();
    assert!(error.contains("a file stands where a folder is needed"), "{error}");
    create_folder(&missing).expect("a folder to create");
    create_folder(&missing).expect("one that exists is fine");
    assert_eq!(names(folder.path()), ["file", "missing"], "no temporary file is left");
}
