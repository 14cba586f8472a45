//! `tensormass devices` and `--device`, called as a user calls them, with the drivers of this machine and with none.
#![cfg(feature = "gpu")]

use std::io::Write;
use std::process::Command;

use serde_json::Value;

/// Exit status, standard output and error output; without drivers if so asked (Linux: the Vulkan loader is told so).
fn call(arguments: &[&str], drivers: bool) -> (Option<i32>, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tensormass"));
    command.args(arguments).current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    if !drivers {
        // Loaders know the one or the other.
        command.env("VK_DRIVER_FILES", "/dev/null").env("VK_ICD_FILENAMES", "/dev/null");
    }
    let output = command.output().expect("the binary starts");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

fn json(drivers: bool) -> Value {
    let (status, out, err) = call(&["devices", "--json"], drivers);
    assert_eq!(status, Some(0), "{err}");
    serde_json::from_str(&out).unwrap_or_else(|e| panic!("{e}: {out}"))
}

/// Says that a test is skipped for want of an adapter, or fails if one is required.
fn skipped(test: &str) {
    let required = std::env::var("TENSORMASS_REQUIRE_GPU").is_ok_and(|v| !matches!(v.trim(), "" | "0"));
    assert!(!required, "TENSORMASS_REQUIRE_GPU is set, and there is no GPU adapter");
    // Not eprintln: the test harness would keep the line of a test that passes to itself.
    let _ = writeln!(std::io::stderr(), "skipped: no GPU adapter (install mesa-vulkan-drivers), 1 test: {test}");
}

/// Runs a scene in f32 on this device: the exit status and the error output.
fn run_on(device: &str, drivers: bool) -> (Option<i32>, String) {
    let out = tempfile::tempdir().expect("a temporary folder");
    let results = out.path().join("results");
    let results_text = results.to_str().expect("a temporary folder's name is text");
    let (status, out, err) = call(
        &["run", "scenes/traction.toml", "--precision", "f32", "--device", device, "--out", results_text],
        drivers,
    );
    assert_eq!(out, "");
    assert!(!results.exists(), "a refused run writes nothing");
    (status, err)
}

#[test]
fn json_and_text_show_the_same_devices() {
    let shown = json(true);
    let (status, text, err) = call(&["devices"], true);
    assert_eq!(status, Some(0), "{err}");
    let devices = shown["devices"].as_array().expect("a list of devices");
    for device in devices {
        for key in ["name", "kind", "backend", "driver", "driver_info"] {
            assert!(device[key].is_string(), "{key}: {device}");
        }
        for key in [
            "storage_buffers_per_stage",
            "invocations_per_workgroup",
            "workgroup_bytes",
            "storage_binding_bytes",
            "buffer_bytes",
            "workgroups_per_dimension",
        ] {
            assert!(device["limits"][key].is_u64(), "{key}: {device}");
        }
        for key in ["shader_f64", "subgroup", "shader_float32_atomic", "timestamp_query"] {
            assert!(device["features"][key].is_boolean(), "{key}: {device}");
        }
        let usable = if device["unusable"].is_null() { "yes" } else { "no: " };
        let block = format!("{}\n  type      {}", str(&device["name"]), str(&device["kind"]));
        assert!(text.contains(&block) && text.contains(&format!("\n  usable    {usable}")), "{text}");
    }
    assert_eq!(text.matches("\n  usable ").count(), devices.len(), "{text}");
    let last = text.lines().last().unwrap_or_default();
    match str(&shown["auto"]).strip_prefix("gpu:") {
        None => {
            assert_eq!(shown["auto"], "cpu");
            assert!(last.starts_with("--device auto: the CPU; "), "{last}");
        }
        Some(name) => {
            let picked = devices.iter().find(|d| d["name"] == name).unwrap_or_else(|| panic!("{shown}"));
            assert!(picked["kind"] != "software" && picked["unusable"].is_null(), "{picked}");
            assert!(last.starts_with(&format!("--device auto: {name} ")), "{last}");
        }
    }
}

fn str(value: &Value) -> &str {
    value.as_str().unwrap_or_else(|| panic!("{value} is no text"))
}

#[cfg(target_os = "linux")]
#[test]
fn without_a_driver_everything_is_said_and_auto_is_the_cpu() {
    assert_eq!(json(false), serde_json::json!({ "devices": [], "auto": "cpu" }));
    let (status, out, _) = call(&["devices"], false);
    assert_eq!(status, Some(0));
    let found = "no GPU is found (a GPU needs its Vulkan driver; Debian: mesa-vulkan-drivers)";
    assert_eq!(out, format!("--device auto: the CPU; {found}\n"));
    for device in ["gpu", "gpu:llvmpipe"] {
        let (status, err) = run_on(device, false);
        assert_eq!(status, Some(2), "{err}");
        let message = format!(
            "error: --device {device}: no GPU can be used: there is none\n  = help: install a Vulkan driver (Debian: \
             mesa-vulkan-drivers), or choose --device cpu\n"
        );
        assert!(err.ends_with(&message), "{err}");
    }
}

#[test]
fn a_name_that_no_gpu_has_ends_with_2_and_the_names_there_are() {
    let shown = json(true);
    let Some(first) = shown["devices"].get(0) else {
        skipped("a_name_that_no_gpu_has");
        return;
    };
    let (status, err) = run_on("gpu:no such device", true);
    assert_eq!(status, Some(2), "{err}");
    assert!(err.contains("error: --device gpu:no such device: no GPU is named `no such device`\n  = help: "), "{err}");
    assert!(err.contains(&format!("`{}`", str(&first["name"]))), "{err}");
}

/// A run on a GPU, a software one too: the summary names it, and a software one is warned of.
#[test]
fn a_run_on_a_gpu_names_the_device() {
    let shown = json(true);
    let Some(first) = shown["devices"].as_array().and_then(|all| all.iter().find(|d| d["unusable"].is_null())) else {
        skipped("a_run_on_a_gpu");
        return;
    };
    let out = tempfile::tempdir().expect("a temporary folder");
    let folder = out.path().to_str().expect("a temporary folder's name is text");
    let arguments = ["run", "scenes/traction.toml", "--device", "gpu", "--out", folder];
    let coarse = ["--set", "mesh.beam.cells=[5, 2, 2]", "--set", "solver.duration=0.08"];
    let (status, text, err) = call(&[&arguments[..], &coarse].concat(), true);
    assert_eq!(status, Some(0), "{err}");
    assert!(text.starts_with("done: 2 steps"), "{text}");
    let summary = std::fs::read_to_string(out.path().join("summary.json")).expect("a run writes its summary");
    let summary: Value = serde_json::from_str(&summary).expect("JSON");
    assert_eq!((&summary["device"], &summary["precision"]), (&first["name"], &"f32".into()));
    assert!(summary["device_counts"]["dispatches"].as_u64() > Some(0), "{summary}");
    assert_eq!(err.contains("is a software device"), first["kind"] == "software", "{err}");
}
