//! The text of docs/reproduction.md: what was done, the tables, the experiments.

use super::chain::{Rounding, Stored, traction, way_error};
use super::conclusions;
use super::experiments::Experiment;
use super::paper::{AVERAGES, ELONGATION, ROWS, Row, Scheme, TABLE_4_TOTAL, YOUNG, averages};
use super::runs::{DURATION, POISSON, RAMP};
use super::series::wave_period;
use super::{OnDevice, Results};

/// The whole page.
pub fn document(results: &Results) -> String {
    let critical = results.cpu.rows[0].measured.critical;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let device = match &results.gpu {
        Ok(gpu) => format!("Device rows: {}. {}", gpu.name, software_note(&gpu.name)),
        Err(reason) => format!("No device rows: there was no device ({reason})."),
    };
    let mut text = format!(
        "<!-- Made by `cargo xtask reproduce tables-1-2`. Do not edit: change xtask/src/reproduce/ and make it again. -->\n\
         # Tables 1 and 2 of Faure et al. 2012\n\n\
         `cargo xtask reproduce tables-1-2` writes this page: the traction test of section 4.1 of Faure, Zara, Jaillet and \
         Moreau, *An implicit tensor-mass solver on the GPU for soft bodies simulation* (VRIPHYS 2012), run by \
         `tensormass run scenes/traction.toml`. `--device cpu` leaves out the GPU.\n\n\
         This page was made on a CPU with {cores} cores, which other work may have shared: its run times are of one \
         occasion. {device}\n\n\
         ## What the paper leaves open\n\n\
         Printed: a beam of 5 x 1 x 1 m, 1000 kg/m3, 100 MPa, 12,000 tetrahedra, stretched by 5 % at a constant velocity. \
         Not printed, and chosen here:\n\n\
         - Poisson's ratio {POISSON}: the explicit step 0.0002 s must be stable. On 20 x 10 x 10 hexahedra of 6 tetrahedra \
         the critical step at {POISSON} is {critical:.3e} s; at 0.25 and with these ends it is already below 0.0002 s.\n\
         - End conditions: free to contract sideways, so that the modulus to find is Young's, whatever Poisson's ratio.\n\
         - A ramp of {RAMP} s, then a hold until {DURATION} s: both are a whole number of every step. Table 4 suggests this \
         length: if its {TABLE_4_TOTAL} s were one implicit step of this beam, Table 2's 1 s at a step of 0.16 s would be \
         {:.0} steps, and a duration of about 1 s. The paper does not say that they are.\n\
         - f32, no damping, conjugate gradients to 1e-6.\n\n\
         The modulus is (reaction of the moved end / area) / (imposed strain). It is read at the end, as the paper seems to \
         do, and as a mean over the last whole wave periods (of {:.4} s) in the second half of the hold. *Amplitude* is half of what \
         it varies by over these, *left* the same over the last period alone (where a period has steps enough).\n\n",
        1.0 / TABLE_4_TOTAL,
        wave_period(),
    );
    text += "## The moduli\n\n";
    text += &moduli(results);
    let errors: Vec<f64> = ROWS[..3].iter().map(Row::error).collect();
    let (signed, plain) = averages(&errors);
    text += &format!(
        "\nThe average rows are the paper's, and ours beside them. An average over rows is no measure of precision: errors of \
         both signs cancel in it, as in Table 1 ({} %, where the mean of the magnitudes is {} %) and in our last values, and \
         nobody computes with three steps at once. The rows are what counts.\n\n",
        signed_percent(signed),
        percent(plain)
    );
    text += "## Run time\n\n";
    text += &run_times(results);
    text += "\nThe paper prints totals only. They are proportional to 1/h within a table, so every row has the same unknown \
             duration T, and a step takes (total x h) / T: the third column divided by T in s. Ratios of steps do not \
             need T: *relative* is in semi-implicit steps, of which the paper's is the mean of three. The totals of the \
             last three rows are printed in whole seconds, so their ratios are known to 10, 25 and 50 %.\n\n\
             Ours are of the first 500 steps at most, the fastest of three runs, without probes (a probe of the modulus costs one force evaluation a \
             step), less the time of a run of one step, and still move with what else the machine does. *Products* are those of the tangent \
             with a vector, in each step.\n\n";
    text +=
        "## One axis at a time\n\nOn the CPU; what is not said is as in the tables. Errors are relative to 100 MPa.\n";
    let experiments = &results.experiments;
    for experiment in
        [&experiments.precision, &experiments.ramp, &experiments.no_hold, &experiments.damping, &experiments.tolerance]
    {
        text += &table_of(experiment);
    }
    text += &stored_positions();
    text += "\n## What explains the paper's errors\n\n";
    text += &conclusions::conclusions(results);
    wrapped(&text)
}

fn software_note(name: &str) -> &'static str {
    let name = name.to_lowercase();
    if ["llvmpipe", "lavapipe", "swiftshader"].iter().any(|software| name.contains(software)) {
        "It is software: its rows show correctness, never a GPU's speed."
    } else {
        "Its rows are to be compared with the paper's GPU of 2012 with that in mind."
    }
}

/// Of a ratio, in percent, with its sign.
pub fn signed_percent(ratio: f64) -> String {
    let sign = if ratio >= 0.0 { "+" } else { "-" };
    if ratio.is_nan() { "-".to_string() } else { format!("{sign}{}", percent(ratio.abs())) }
}

/// Of a magnitude, in percent.
pub fn percent(ratio: f64) -> String {
    match 100.0 * ratio {
        p if p.is_nan() => "-".to_string(),
        p if p < 1e-3 => format!("{p:.6}"),
        p => format!("{p:.4}"),
    }
}

/// Prose in lines of at most 120 characters; tables, headings and comments as they are.
fn wrapped(page: &str) -> String {
    let mut text = String::new();
    for line in page.lines() {
        let mut length = 0;
        let indent = if line.starts_with("- ") { "  " } else { "" };
        let whole = line.starts_with(['|', '#', '<']);
        for word in line.split(' ') {
            let size = word.chars().count();
            if length == 0 {
                text += word;
                length = size;
            } else if whole || length + 1 + size <= 120 {
                text = text + " " + word;
                length += 1 + size;
            } else {
                text = text + "\n" + indent + word;
                length = indent.len() + size;
            }
        }
        text.push('\n');
    }
    text
}

/// A Markdown table.
fn table(headings: &[&str], rows: &[Vec<String>]) -> String {
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    let headings: Vec<String> = headings.iter().map(ToString::to_string).collect();
    let rule = vec!["---".to_string(); headings.len()];
    [headings, rule].iter().chain(rows).map(|cells| line(cells)).collect()
}

fn grouped(young: f64) -> String {
    let digits = format!("{young:.0}");
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

fn place(row: &Row) -> String {
    let table = if row.scheme == Scheme::SemiImplicit { 1 } else { 2 };
    format!("{table}, {}", row.scheme.words())
}

fn moduli(results: &Results) -> String {
    let mut rows = Vec::new();
    for (block, first) in ROWS.chunks(3).zip([0, 3, 6]) {
        for (i, row) in block.iter().enumerate() {
            let mut cells = vec![place(row), row.step.to_string(), grouped(row.young), signed_percent(row.error())];
            let read = results.cpu.rows[first + i].measured.young;
            cells.extend([grouped(read.end), signed_percent(read.end / YOUNG - 1.0)]);
            cells.extend([signed_percent(read.mean / YOUNG - 1.0), percent(read.amplitude / YOUNG)]);
            cells.push(percent(read.left / YOUNG));
            if let Ok(gpu) = &results.gpu {
                let read = gpu.rows[first + i].measured.young;
                cells.extend([signed_percent(read.end / YOUNG - 1.0), signed_percent(read.mean / YOUNG - 1.0)]);
            }
            rows.push(cells);
        }
        let mean = |of: &dyn Fn(usize) -> f64| (first..first + 3).map(of).sum::<f64>() / 3.0;
        let ours = |on: &OnDevice| {
            let end = mean(&|i| on.rows[i].measured.young.end);
            (end, end / YOUNG - 1.0, mean(&|i| on.rows[i].measured.young.mean) / YOUNG - 1.0)
        };
        let (paper, (end, error, hold)) = (AVERAGES[first / 3], ours(&results.cpu));
        let mut cells = vec![place(&block[0]), "average".to_string(), grouped(paper)];
        cells.extend([signed_percent(paper / YOUNG - 1.0), grouped(end), signed_percent(error), signed_percent(hold)]);
        cells.extend([String::new(), String::new()]);
        if let Ok(gpu) = &results.gpu {
            let (_, error, hold) = ours(gpu);
            cells.extend([signed_percent(error), signed_percent(hold)]);
        }
        rows.push(cells);
    }
    let mut headings = vec!["table", "step s", "paper Pa", "paper error %", "ours at the end Pa", "error at the end %"];
    headings.extend(["error of the mean %", "amplitude %", "left %"]);
    if results.gpu.is_ok() {
        headings.extend(["device: error at the end %", "device: error of the mean %"]);
    }
    table(&headings, &rows)
}

fn run_times(results: &Results) -> String {
    let reference = paper_reference();
    let ours_reference = |on: &OnDevice| on.rows[..3].iter().map(|r| r.step_time).sum::<f64>() / 3.0;
    let rows = ROWS.iter().enumerate().map(|(i, row)| {
        let mut cells = vec![place(row), row.step.to_string(), format!("{:.1}", row.step_cost())];
        cells.extend([format!("{}", row.seconds), format!("{:.1}", row.step_cost() / reference)]);
        for on in std::iter::once(&results.cpu).chain(&results.gpu) {
            let ours = &on.rows[i];
            let total = ours.step_time * ours.measured.steps as f64 / 1e3;
            cells.extend([format!("{:.3}", ours.step_time), format!("{total:.1}")]);
            cells.push(format!("{:.1}", ours.step_time / ours_reference(on)));
        }
        let measured = &results.cpu.rows[i].measured;
        cells.extend([measured.steps.to_string(), format!("{:.1}", measured.products)]);
        cells
    });
    let mut headings = vec!["table", "step s", "paper ms a step x T in s", "paper total s", "paper relative"];
    headings.extend(["CPU ms a step", "CPU total s", "CPU relative"]);
    if results.gpu.is_ok() {
        headings.extend(["device ms a step", "device total s", "device relative"]);
    }
    headings.extend(["steps", "products"]);
    table(&headings, &rows.collect::<Vec<_>>())
}

/// The paper's semi-implicit step in ms, times T in s.
pub fn paper_reference() -> f64 {
    ROWS[..3].iter().map(Row::step_cost).sum::<f64>() / 3.0
}

fn table_of(experiment: &Experiment) -> String {
    let rows = experiment.runs.iter().map(|(what, spec, measured)| {
        let read = measured.young;
        let mut cells = vec![what.clone(), spec.scheme.words().to_string(), spec.step.to_string()];
        cells.extend([signed_percent(read.end / YOUNG - 1.0), signed_percent(read.mean / YOUNG - 1.0)]);
        cells.extend([percent(read.amplitude / YOUNG), percent(read.left / YOUNG)]);
        cells.push(format!("{:.1}", measured.products));
        cells
    });
    let headings = ["run", "scheme", "step s", "at the end %", "mean %", "amplitude %", "left %", "products a step"];
    format!("\n### {}\n\n{}\n\n{}", experiment.title, experiment.text, table(&headings, &rows.collect::<Vec<_>>()))
}

/// The model of a solver that stores positions.
fn stored_positions() -> String {
    let ulp = f64::from(f32::EPSILON) * 4.0;
    let mut text = format!(
        "\n### Stored positions\n\n\
         The paper's Table 3 lists positions P(t0) and P(t), and no displacements. Between 4 and 8 m an f32 has a unit of \
         {ulp:.2e} m. If the moved end, at 5 m, is advanced by x + h v, each step rounds its way by up to half a unit, and a \
         constant velocity rounds it the same way in every step: the error adds up over the ramp's {RAMP}/h steps, to at \
         most {:.1e} s / h of the 5 % for a ramp of {RAMP} s (to nearest), or twice that, always short (towards zero). Our \
         runtime stores displacements and imposes them by time, so this is asked of a model in f32: the sum itself, for all \
         steps and three ramps, and an undamped chain of 20 masses for the explicit ones.\n\n\
         Error of the end's way in %; it is the error of the modulus if the strain is taken to be 5 %:\n\n",
        0.5 * ulp / ELONGATION * RAMP
    );
    let mut rows = Vec::new();
    for row in &ROWS[3..] {
        let mut cells = vec![row.step.to_string(), signed_percent(row.error())];
        for rounding in [Rounding::Nearest, Rounding::TowardsZero] {
            cells
                .extend([RAMP, 2.0 * RAMP, 5.0 * RAMP].map(|ramp| signed_percent(way_error(row.step, ramp, rounding))));
        }
        rows.push(cells);
    }
    let ramps = [RAMP, 2.0 * RAMP, 5.0 * RAMP].map(|ramp| format!("{ramp} s"));
    let mut headings = vec!["step s".to_string(), "paper's Table 2 %".to_string()];
    for rounding in [Rounding::Nearest, Rounding::TowardsZero] {
        headings.extend(ramps.iter().map(|ramp| format!("{}, ramp {ramp}", rounding.words())));
    }
    text += &table(&headings.iter().map(String::as_str).collect::<Vec<_>>(), &rows);
    text += "\nThe chain's mean over the hold, error in %, with the strain taken as 5 % and as it resulted:\n\n";
    let mut rows = Vec::new();
    let kinds = [
        ("positions, end by x + h v", Stored::Position, Rounding::Nearest),
        ("positions, end by x + h v", Stored::Position, Rounding::TowardsZero),
        ("positions, end imposed by time", Stored::PositionEndImposed, Rounding::Nearest),
        ("positions, end imposed by time", Stored::PositionEndImposed, Rounding::TowardsZero),
        ("displacements, end by u + h v", Stored::Displacement, Rounding::Nearest),
    ];
    for (what, stored, rounding) in kinds {
        let mut cells = vec![what.to_string(), rounding.words().to_string()];
        for row in &ROWS[..3] {
            let (nominal, resulting) = traction(row.step, RAMP, DURATION, stored, rounding);
            let mean = |series: super::series::Series| series.hold(RAMP, wave_period()).mean / YOUNG - 1.0;
            cells.push(format!("{} / {}", signed_percent(mean(nominal)), signed_percent(mean(resulting))));
        }
        rows.push(cells);
    }
    let headings = ["stored", "rounding", "0.00005 s: 5 % / resulting", "0.0001 s", "0.0002 s"];
    text + &table(&headings, &rows)
}

#[cfg(test)]
mod tests {
    use super::super::Ours;
    use super::super::experiments::Experiments;
    use super::super::runs::{Measured, Spec};
    use super::super::series::Series;
    use super::*;

    /// Runs that all read a modulus 1 % too high, on a device.
    fn measured() -> Measured {
        let mut series = Series::default();
        for k in 1..=4800 {
            series.push(f64::from(k) * 0.0002, 1.01 * YOUNG);
        }
        Measured { young: series.hold(RAMP, wave_period()), series, steps: 4800, products: 7.0, critical: 2e-4 }
    }

    fn on(name: &str) -> OnDevice {
        let rows = ROWS.iter().map(|_| Ours { measured: measured(), step_time: 0.5 }).collect();
        OnDevice { name: name.to_string(), rows }
    }

    fn results(gpu: Result<OnDevice, String>) -> Results {
        let experiment = |steps: &[f64]| Experiment {
            title: "Axis",
            text: String::new(),
            runs: steps.iter().map(|&h| ("run".to_string(), Spec::new(Scheme::SemiImplicit, h), measured())).collect(),
        };
        let three = || experiment(&[0.00005, 0.0001, 0.0002]);
        let experiments =
            Experiments { precision: three(), ramp: three(), no_hold: three(), damping: three(), tolerance: three() };
        Results { cpu: on("cpu"), gpu, experiments }
    }

    #[test]
    fn every_row_of_a_table_has_its_headings_cells() {
        for gpu in [Err("none here".to_string()), Ok(on("llvmpipe"))] {
            let with_device = gpu.is_ok();
            let page = document(&results(gpu));
            let mut expected = None;
            for line in page.lines() {
                let cells = line.starts_with('|').then(|| line.matches('|').count());
                assert!(cells.is_none() || expected.is_none() || cells == expected, "{line}");
                expected = cells;
            }
            assert_eq!(page.contains("device ms a step"), with_device);
            assert_eq!(page.contains("no device (none here)"), !with_device);
            // Nine rows of the moduli and three averages, all 1 % too high at the end.
            assert_eq!(page.matches("| 101,000,000 | +1.0000 |").count(), 12);
            assert!(page.starts_with("<!-- Made by `cargo xtask reproduce tables-1-2`"));
        }
    }

    #[test]
    fn numbers_and_tables_read_well() {
        assert_eq!(grouped(98_775_400.4), "98,775,400");
        assert_eq!(grouped(123.0), "123");
        assert_eq!(signed_percent(-0.0122), "-1.2200");
        assert_eq!(signed_percent(0.000_000_34), "+0.000034");
        assert_eq!(percent(f64::NAN), "-");
        assert_eq!(wrapped(&"- abc def".repeat(20)).lines().map(str::len).max(), Some(118));
        assert_eq!(table(&["a", "b"], &[vec!["1".into(), "2".into()]]), "| a | b |\n| --- | --- |\n| 1 | 2 |\n");
    }

    #[test]
    fn a_software_device_is_called_one() {
        assert!(software_note("llvmpipe (LLVM 19.1.7, 256 bits)").contains("never a GPU's speed"));
        assert!(!software_note("GeForce GTX 560").contains("software"));
    }
}
