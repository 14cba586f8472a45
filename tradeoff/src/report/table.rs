//! runs.csv: a row a setting.

use crate::experiment::{Measured, Status};
use crate::space::{Axis, Space};

/// The table.
pub(super) fn csv(space: &Space, measured: &[Measured]) -> String {
    let axes = Axis::ALL.map(Axis::name).join(",");
    let mut text = format!(
        "{axes},status,error_displacement,error_greatest,error_probes,error_energy,wall_s,runs,evaluations,kernels,bytes,steps,\
         elements\n"
    );
    for m in measured {
        let names: Vec<String> = space.names(&m.setting).into_iter().map(quoted).collect();
        let status = match &m.status {
            Status::Done => "done".to_string(),
            Status::TooSlow => "too slow".to_string(),
            Status::Failed(reason) => quoted(reason),
        };
        let errors = m.errors.map_or_else(
            || ",,,".to_string(),
            |e| format!("{:e},{:e},{:e},{:e}", e.displacement, e.greatest, e.probes, e.energy),
        );
        text += &format!(
            "{},{status},{errors},{},{},{},{},{},{},{}\n",
            names.join(","),
            if m.walls.is_empty() { String::new() } else { m.wall().to_string() },
            m.walls.len(),
            m.evaluations,
            m.kernels,
            m.bytes,
            m.steps,
            m.elements
        );
    }
    text
}

/// Text in quotation marks where it has characters that separate.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_string() }
}
