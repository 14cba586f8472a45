//! Measurements as comma-separated values.

use crate::extremes::Extremes;

/// A text of these columns and rows; numbers are the shortest text that reads back to the same bits.
pub fn csv(columns: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let mut text = columns.join(",");
    text.push('\n');
    for row in rows {
        text += &row.join(",");
        text.push('\n');
    }
    text
}

/// One row a cell. A cell without states has empty errors.
pub fn extremes(extremes: &Extremes) -> String {
    let columns = ["machine", "quantity", "poisson", "strain", "rotation", "states", "gate", "relative"];
    let rows = extremes.cells.iter().map(|c| {
        let number = |x: f64| if c.states == 0 { String::new() } else { format!("{x:e}") };
        let poisson = extremes.materials[c.material].moduli.poisson();
        vec![
            c.machine.name().to_string(),
            c.quantity.name().to_string(),
            format!("{poisson:.4}"),
            format!("{:e}", c.strain),
            c.rotation.to_string(),
            c.states.to_string(),
            number(c.gate),
            number(c.relative),
        ]
    });
    csv(&columns, rows)
}
