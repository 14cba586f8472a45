//! `tensormass plan`: what a scene will compute, and what it leaves out.

use clap::Args;
use tensormass_runtime::model::build;
use tensormass_runtime::plan::{Plan, integrator_name, precision_name};

use crate::failure::Failure;
use crate::run::SceneArguments;
use crate::text;

/// Arguments of `plan`.
#[derive(Debug, Args)]
pub struct Arguments {
    #[command(flatten)]
    scene: SceneArguments,
    /// Print the plan as JSON instead of text.
    #[arg(long)]
    json: bool,
}

/// Prints the plan of a scene.
pub fn call(arguments: &Arguments) -> Result<(), Failure> {
    let scene = arguments.scene.load()?;
    let model = build(&scene).map_err(|e| Failure::bad_input(e.to_string()))?;
    let plan = Plan::new(&scene, &model);
    if arguments.json {
        return text::print_json(&plan.to_json());
    }
    let mut out = format!(
        "{} nodes, {} elements; {}, {}, cpu\n",
        model.mesh.nodes().len(),
        plan.elements,
        integrator_name(scene.solver.integrator),
        precision_name(scene.solver.precision)
    );
    for line in plan.quality.to_string().lines() {
        out += &format!("  {line}\n");
    }
    for law in &plan.laws {
        let unreviewed = if law.info.reviewed { "" } else { " (unreviewed)" };
        let constants = if law.per_element { "one set of constants an element" } else { "one set of constants" };
        out += &format!("law {}{unreviewed}: {} elements, {constants}\n", law.info.name, law.elements);
        let rows: Vec<Vec<String>> = law
            .kernels
            .iter()
            .map(|(name, operations)| vec![(*name).to_string(), format!("{operations} operations an element")])
            .collect();
        out += &text::columns("  ", &rows);
    }
    out += "passes of a step\n";
    for pass in &plan.passes {
        out += &format!("  {pass}\n");
    }
    out += &format!("buffers, {:.0} bytes an element\n", plan.bytes_per_element());
    let rows: Vec<Vec<String>> =
        plan.buffers.iter().map(|(name, bytes)| vec![(*name).to_string(), format!("{bytes} bytes")]).collect();
    out += &text::columns("  ", &rows);
    for (title, lines) in [("modelled", &plan.modelled), ("left out", &plan.left_out)] {
        out += &format!("{title}\n");
        for line in lines {
            out += &format!("  {line}\n");
        }
    }
    for warning in &model.warnings {
        eprintln!("warning: {warning}");
    }
    text::print(&out)
}
