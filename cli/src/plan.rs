//! `tensormass plan`: what a scene will compute, and what it leaves out.

use clap::Args;
use tensormass_runtime::device::{DeviceChoice, DeviceError};
use tensormass_runtime::model::build;
use tensormass_runtime::plan::{Layout, Per, Plan, PlannedPass, integrator_name, precision_name};
use tensormass_runtime::scene::Precision;
use tensormass_runtime::target::Target;

use crate::failure::Failure;
use crate::run::SceneArguments;
use crate::text;

/// Arguments of `plan`.
#[derive(Debug, Args)]
pub struct Arguments {
    #[command(flatten)]
    scene: SceneArguments,
    /// For which device: gpu plans for any GPU, whether there is one or not.
    #[arg(long, value_name = "auto|cpu|gpu|gpu:NAME", default_value_t = DeviceChoice::Auto)]
    device: DeviceChoice,
    /// Print the plan as JSON instead of text.
    #[arg(long)]
    json: bool,
}

/// Prints the plan of a scene.
pub fn call(arguments: &Arguments) -> Result<(), Failure> {
    let scene = arguments.scene.load(None)?;
    let model = build(&scene).map_err(|e| Failure::bad_input(e.to_string()))?;
    let layout = layout(&arguments.device, scene.solver.precision)
        .map_err(|e| Failure::bad_input(format!("--device {}: {e}", arguments.device)))?;
    let plan = Plan::new(&scene, &model, layout);
    if arguments.json {
        return text::print_json(&plan.to_json());
    }
    let mut out = format!(
        "{} nodes, {} elements; {}, {}, {}\n",
        model.mesh.nodes().len(),
        plan.elements,
        integrator_name(scene.solver.integrator),
        precision_name(scene.solver.precision),
        match layout {
            Layout::Cpu => "cpu",
            Layout::Gpu => "gpu",
        }
    );
    for line in plan.quality.to_string().lines() {
        out += &format!("  {line}\n");
    }
    for law in &plan.laws {
        let unreviewed = if law.info.reviewed { "" } else { " (unreviewed)" };
        let constants = if law.per_element { "one set of constants an element" } else { "one set of constants" };
        out += &format!(
            "law {}{unreviewed}: {} elements {}, {constants}\n",
            law.info.name, law.elements, law.element.name
        );
        let rows: Vec<Vec<String>> = law
            .kernels
            .iter()
            .map(|(name, operations)| vec![(*name).to_string(), format!("{operations} operations an element")])
            .collect();
        out += &text::columns("  ", &rows);
    }
    for per in Per::ALL {
        out += &passes(&plan, per);
    }
    let [in_steps, at_most] = plan.vectors;
    out += &format!("vectors over the nodes: {in_steps} from step to step, {at_most} at once at most\n");
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

/// The passes that run as often, with their least operations and bytes an element; nothing where there are none.
fn passes(plan: &Plan, per: Per) -> String {
    let here: Vec<_> = plan.passes.iter().filter(|pass| pass.per == per).collect();
    if here.is_empty() {
        return String::new();
    }
    let often = match per {
        Per::Step => "step",
        Per::Solution => "linear solution",
        Per::Iteration => "iteration of conjugate gradients",
        Per::Record => "record",
    };
    let cells = |flops: Option<f64>, bytes: Option<f64>| {
        let cell = |number: Option<f64>, unit: &str| match number {
            Some(number) => format!("{number:.0} {unit}"),
            None => format!("as many {unit} as the state asks for"),
        };
        [cell(flops, "operations"), cell(bytes, "bytes")]
    };
    let row = |pass: &&PlannedPass| -> Vec<String> {
        std::iter::once(pass.name.to_string()).chain(cells(pass.flops, pass.bytes)).collect()
    };
    let rows: Vec<Vec<String>> = here.iter().map(row).collect();
    let [flops, bytes] = plan.totals(per);
    format!(
        "passes of each {often}, {flops:.0} operations and {bytes:.0} bytes an element at the least\n{}",
        text::columns("  ", &rows)
    )
}

/// What a choice plans for. No device is opened but to find out what `auto` takes.
fn layout(choice: &DeviceChoice, precision: Precision) -> Result<Layout, DeviceError> {
    match (choice, precision) {
        (DeviceChoice::Cpu, _) => Ok(Layout::Cpu),
        (DeviceChoice::Gpu | DeviceChoice::Named(_), Precision::F32) => Ok(Layout::Gpu),
        (DeviceChoice::Gpu | DeviceChoice::Named(_), Precision::F64) => Err(DeviceError::Precision),
        (DeviceChoice::Auto, _) => Ok(match Target::open(choice, precision)? {
            Target::Cpu => Layout::Cpu,
            #[cfg(feature = "gpu")]
            Target::Gpu(..) => Layout::Gpu,
        }),
    }
}
