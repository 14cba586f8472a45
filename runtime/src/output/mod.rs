//! Results on disk: VTU frames, their PVD index, probe tables and JSON, never half-written under their final names.

mod atomic;
mod csv;
mod json;
mod pvd;
mod vtu;

pub use atomic::{OutputError, create_folder, remove_file, write_atomic};
pub use csv::ProbeTable;
pub use json::write_json_atomic;
pub use pvd::PvdWriter;
pub use vtu::{Cells, Field, FieldValues, write_vtu};
