//! What the measurement finds: lost digits where a kernel loses them, none where it keeps them, the same on every run.

use tensormass_kernels::laws;
use tensormass_lawbench::extremes::{Adapter, Extremes, Options, extremes};
use tensormass_lawbench::gate::{Machine, Quantity};
use tensormass_lawbench::states::{ROTATIONS, STRAINS};
use tensormass_lawbench::subject::{Subject, SubjectError};
use tensormass_lawbench::wgsl::{Device, DeviceError};
use tensormass_lawbench::{csv, heat_map, table};
use tensormass_runtime::device::DeviceChoice;

const OPTIONS: Options = Options { samples: 2, seed: 4 };

fn measured(subject: &Subject) -> Extremes {
    extremes(subject, OPTIONS, Err("not asked for".into())).expect("a material")
}

/// The hand-written derivation, and the same with its sums of 1 taken out: what a derivation without a cancellation does.
fn by_hand(repaired: bool) -> Subject {
    let [law, derivation] = [include_str!("data/loses_digits.rs"), include_str!("data/derived/loses_digits.ir")];
    let derivation = if repaired { derivation.replace(" = const 1\n", " = const 0\n") } else { derivation.to_string() };
    Subject::from_texts("loses_digits.rs", law, &derivation).expect("a law and its derivation")
}

#[test]
fn lost_digits_are_found_and_kept_ones_pass() {
    let lossy = measured(&by_hand(false));
    for (machine, quantity) in [(Machine::F32, Quantity::P), (Machine::F64, Quantity::P), (Machine::F32, Quantity::W)] {
        let worst =
            lossy.worst().into_iter().find(|c| (c.machine, c.quantity) == (machine, quantity)).expect("measured");
        // 1 + G rounds a strain of 1e-8 away: the error is the value, and the bound a few round-offs of it.
        assert!(worst.gate > 1e5 && worst.strain < 1e-6, "{worst:?}");
    }
    assert!(lossy.failures().iter().any(|f| f.contains("unrotated")), "{:?}", lossy.failures());
    // The Cauchy kernel of the repaired text is none, and is not measured.
    assert_eq!(measured(&by_hand(true)).failures(), Vec::<String>::new());
}

#[test]
fn every_law_is_measured_everywhere_and_keeps_its_digits() {
    for entry in laws() {
        let found = measured(&Subject::of_build(entry));
        assert_eq!(found.wgsl, Adapter::Skipped("not asked for".into()));
        assert_eq!(found.cells.len(), 2 * 3 * found.materials.len() * STRAINS.len() * ROTATIONS.len());
        // A textbook form that cancels is off by 1e5 times the gate and more. What is left above it is a matter of single
        // roundings, and `law extremes --all` shows it. Fibres and principal stretches have more to lose.
        let text = &entry.source.law;
        if !entry.info.structure.uses_fibres && !text.contains("stretch_sum") {
            let worst = found.cells.iter().map(|c| c.gate).fold(0.0, f64::max);
            assert!(worst <= 2.0, "{}: {worst} times the gate; {:?}", entry.info.name, found.failures());
        }
        // States up to a strain of 0.3 are inside every law's domain, and their values normal numbers.
        let small = found.cells.iter().filter(|c| c.strain <= 0.3);
        for cell in small {
            // A law's selections may be undecided at some.
            let selects = entry.info.operations.iter().any(|o| o.kernel == "force_far" && o.selects > 0);
            assert!(cell.states == OPTIONS.samples || selects, "{}: {cell:?}", entry.info.name);
        }
    }
    let first = &laws()[0];
    assert_eq!(measured(&Subject::of_build(first)), measured(&Subject::of_build(first)), "{}", first.info.name);
}

#[test]
fn writers_have_every_cell() {
    let found = measured(&by_hand(false));
    assert_eq!(csv::extremes(&found).lines().count(), 1 + found.cells.len());
    let svg = heat_map::heat_map(&found);
    assert_eq!(svg.matches("<title>").count(), found.cells.len());
    assert!(svg.starts_with("<svg ") && svg.trim_end().ends_with("</svg>"));
    let text = table::extremes(&found, &["c".into()]);
    assert!(STRAINS.iter().all(|s| text.contains(&format!("\n{s:e} "))), "{text}");
    assert!(text.contains("above the gate: P in f32") && text.contains("c = "), "{text}");
}

#[test]
fn an_adapter_computes_what_the_interpreter_computes() {
    let device = match Device::open(&DeviceChoice::Gpu) {
        Ok(device) => device.expect("a GPU was asked for, not the CPU"),
        Err(DeviceError::NoAdapter { .. } | DeviceError::NoGpuSupport) => {
            eprintln!("skipped: no GPU adapter");
            return;
        }
        Err(error) => panic!("{error}"),
    };
    // One law of this build, and one that is printed now.
    for subject in [Subject::of_build(&laws()[0]), by_hand(true)] {
        let found = extremes(&subject, OPTIONS, Ok(&device)).expect("measured");
        assert_eq!(found.wgsl, Adapter::Device(device.name().to_string()));
        let of = |machine| found.cells.iter().filter(move |c| c.machine == machine);
        assert_eq!(of(Machine::Wgsl).count(), of(Machine::F32).count());
        for (wgsl, single) in of(Machine::Wgsl).zip(of(Machine::F32)) {
            assert_eq!((wgsl.states, wgsl.strain, wgsl.rotation), (single.states, single.strain, single.rotation));
            assert!(wgsl.states == 0 || wgsl.quantity != Quantity::DP || wgsl.gate <= 1.0, "{wgsl:?}");
        }
    }
}

#[test]
fn what_is_no_law_is_refused() {
    let near = Subject::open("hoke").expect_err("no law").to_string();
    assert!(near.contains("did you mean `hooke`"), "{near}");
    assert!(matches!(Subject::open("nowhere/law.rs"), Err(SubjectError::Unreadable { .. })));
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("new.rs");
    std::fs::write(&path, include_str!("data/loses_digits.rs")).expect("written");
    // Cargo may build these tests with differentiation; a test process never runs it.
    if !tensormass_codegen::worker::available() {
        let error = Subject::open(path.to_str().expect("UTF-8")).expect_err("no derivation").to_string();
        assert!(error.contains("--features derive") && error.contains("derived"), "{error}");
    }
    std::fs::write(&path, "nonsense").expect("written");
    assert!(matches!(Subject::open(path.to_str().expect("UTF-8")), Err(SubjectError::Law(_))));
}
