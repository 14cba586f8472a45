//! VTU frames: cells of any kinds with point and cell data, as appended raw blocks compressed by zlib.

use super::atomic::{OutputError, escape_xml, write_atomic};
use flate2::{Compression, write::ZlibEncoder};
use rayon::prelude::*;
use std::fmt::Write as _;
use std::io::{self, Write};
use std::path::Path;

/// The values of a field, component after component of one point or cell, then the next.
#[derive(Debug, Clone, Copy)]
pub enum FieldValues<'a> {
    /// Single precision.
    F32(&'a [f32]),
    /// Double precision.
    F64(&'a [f64]),
    /// Whole numbers, such as material numbers.
    U32(&'a [u32]),
}

/// A named field over the points or over the cells.
#[derive(Debug, Clone, Copy)]
pub struct Field<'a> {
    /// The name that ParaView shows; by convention with the unit, e.g. `displacement_m`.
    pub name: &'a str,
    /// Values a point or cell: 1 a scalar, 3 a vector, 9 a tensor row by row.
    pub components: usize,
    /// `components` values for each point or cell.
    pub values: FieldValues<'a>,
}

impl FieldValues<'_> {
    fn len(&self) -> usize {
        match self {
            FieldValues::F32(values) => values.len(),
            FieldValues::F64(values) => values.len(),
            FieldValues::U32(values) => values.len(),
        }
    }
}

/// Bytes of a block before compression: large enough for zlib's window (32 KiB), small enough to spread over threads.
const BLOCK: usize = 256 * 1024;

/// The cells of a mesh.
#[derive(Debug, Clone, Default)]
pub struct Cells {
    /// The points of one cell after the other, in VTK's order.
    pub points: Vec<u32>,
    /// Where each cell's points end.
    pub ends: Vec<i64>,
    /// VTK's number of each cell's type.
    pub types: Vec<u8>,
}

impl Cells {
    /// Adds a cell.
    pub fn push(&mut self, kind: u8, points: impl IntoIterator<Item = u32>) {
        self.points.extend(points);
        self.ends.push(self.points.len() as i64);
        self.types.push(kind);
    }
}

/// Writes one frame, complete or not at all: `points` (m), cells, and fields over both.
///
/// The bytes depend on nothing but the arguments, whatever the number of threads.
///
/// # Errors
/// [`OutputError::Shape`] if a field's length or a cell does not fit the points and cells, or if two fields have
/// the same name; [`OutputError::Io`] if the file cannot be written.
pub fn write_vtu(
    path: &Path,
    points: &[[f64; 3]],
    cells: &Cells,
    point_fields: &[Field<'_>],
    cell_fields: &[Field<'_>],
) -> Result<(), OutputError> {
    check(points.len(), cells, point_fields, cell_fields).map_err(|reason| OutputError::shape(path, reason))?;

    let mut arrays = Appended::default();
    let mut xml = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" \
         header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\">\n  <UnstructuredGrid>\n",
    );
    let say = "writing to a String cannot fail";
    writeln!(xml, "    <Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">", points.len(), cells.types.len())
        .expect(say);
    for (section, fields) in [("PointData", point_fields), ("CellData", cell_fields)] {
        writeln!(xml, "      <{section}>").expect(say);
        for field in fields {
            let (name, components) = (escape_xml(field.name), field.components);
            xml.push_str(&match field.values {
                FieldValues::F32(values) => arrays.add("Float32", &name, components, values, f32::to_le_bytes),
                FieldValues::F64(values) => arrays.add("Float64", &name, components, values, f64::to_le_bytes),
                FieldValues::U32(values) => arrays.add("UInt32", &name, components, values, u32::to_le_bytes),
            });
        }
        writeln!(xml, "      </{section}>").expect(say);
    }
    xml.push_str("      <Points>\n");
    xml.push_str(&arrays.add("Float64", "Points", 3, points.as_flattened(), f64::to_le_bytes));
    xml.push_str("      </Points>\n      <Cells>\n");
    xml.push_str(&arrays.add("UInt32", "connectivity", 1, &cells.points, u32::to_le_bytes));
    xml.push_str(&arrays.add("Int64", "offsets", 1, &cells.ends, i64::to_le_bytes));
    xml.push_str(&arrays.add("UInt8", "types", 1, &cells.types, u8::to_le_bytes));
    // The underscore marks where the raw bytes begin.
    xml.push_str("      </Cells>\n    </Piece>\n  </UnstructuredGrid>\n  <AppendedData encoding=\"raw\">\n_");
    write_atomic(path, |file| {
        file.write_all(xml.as_bytes())?;
        arrays.write(file)?;
        file.write_all(b"\n  </AppendedData>\n</VTKFile>\n")
    })
}

/// What is wrong with the shapes, if anything.
fn check(points: usize, cells: &Cells, point_fields: &[Field<'_>], cell_fields: &[Field<'_>]) -> Result<(), String> {
    if let Some(at) = cells.points.iter().position(|&p| p as usize >= points) {
        let cell = cells.ends.partition_point(|end| *end <= at as i64);
        return Err(format!("cell {cell} names point {}, there are {points}", cells.points[at]));
    }
    for (fields, kind, count) in [(point_fields, "point", points), (cell_fields, "cell", cells.types.len())] {
        for (place, field) in fields.iter().enumerate() {
            let (name, components, len) = (field.name, field.components, field.values.len());
            if components == 0 || components.checked_mul(count) != Some(len) {
                return Err(format!(
                    "{kind} field `{name}` has {len} values, {count} {kind}s of {components} components were expected"
                ));
            }
            if fields[..place].iter().any(|earlier| earlier.name == name) {
                return Err(format!("there are two {kind} fields `{name}`"));
            }
        }
    }
    Ok(())
}

/// The arrays of the appended section, compressed.
#[derive(Default)]
struct Appended {
    arrays: Vec<CompressedArray>,
    bytes: u64,
}

struct CompressedArray {
    /// Number of blocks, bytes of a block, bytes of the last one if it is shorter (else 0), then the compressed sizes.
    header: Vec<u64>,
    blocks: Vec<Vec<u8>>,
}

impl Appended {
    /// Compresses an array and returns the XML element that points to it.
    fn add<T: Copy + Sync, const N: usize>(
        &mut self,
        vtk_type: &str,
        name: &str,
        components: usize,
        values: &[T],
        to_bytes: fn(T) -> [u8; N],
    ) -> String {
        // Blocks are compressed on all threads, but cut and collected in order: the file is always the same.
        let blocks: Vec<Vec<u8>> = values.par_chunks(BLOCK / N).map(|block| compress(block, to_bytes)).collect();
        let mut header = vec![blocks.len() as u64, BLOCK as u64, (values.len() * N % BLOCK) as u64];
        header.extend(blocks.iter().map(|block| block.len() as u64));

        let offset = self.bytes;
        self.bytes += 8 * header.len() as u64 + header[3..].iter().sum::<u64>();
        self.arrays.push(CompressedArray { header, blocks });
        format!(
            "        <DataArray type=\"{vtk_type}\" Name=\"{name}\" NumberOfComponents=\"{components}\" \
             format=\"appended\" offset=\"{offset}\"/>\n"
        )
    }

    fn write(&self, file: &mut impl Write) -> io::Result<()> {
        for array in &self.arrays {
            for number in &array.header {
                file.write_all(&number.to_le_bytes())?;
            }
            for block in &array.blocks {
                file.write_all(block)?;
            }
        }
        Ok(())
    }
}

/// One block, compressed at the fastest level: the low digits of a simulation do not compress, at any level.
fn compress<T: Copy, const N: usize>(values: &[T], to_bytes: fn(T) -> [u8; N]) -> Vec<u8> {
    let bytes: Vec<u8> = values.iter().flat_map(|value| to_bytes(*value)).collect();
    let mut encoder = ZlibEncoder::new(Vec::with_capacity(bytes.len() / 2), Compression::fast());
    encoder.write_all(&bytes).expect("writing to a Vec cannot fail");
    encoder.finish().expect("writing to a Vec cannot fail")
}
