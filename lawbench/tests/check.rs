//! A derivation with one slip in it fails the findings that the slip is about.

use tensormass_codegen::derivation::{DAMPING_KERNELS, Derivation};
use tensormass_codegen::ir::{KernelIr, Op};
use tensormass_kernels::laws;
use tensormass_lawbench::check::check;
use tensormass_lawbench::extremes::Options;
use tensormass_lawbench::subject::Subject;

const ENERGY: &str = "force is the derivative of energy";
const FORCE: &str = "dforce is the derivative of force";
const SYMMETRY: &str = "symmetric tangent";
const OTHERS: &str = "diagonal and Cauchy stress agree with tangent and stress";
const DISSIPATION: &str = "damping is the derivative of dissipation";
const DAMPING: &str = "ddamping is the derivative of damping";
const SYMMETRIC_DAMPING: &str = "symmetric damping";
const ACCURATE: &str = "accurate in f32, f64 and WGSL";

/// A slip: the kernel, what happens to it, and the findings that have to fail.
type Slip = (&'static str, fn(&mut KernelIr), &'static [&'static str]);

/// Two components of the first output change places.
fn swapped(ir: &mut KernelIr) {
    ir.outputs[0].1.swap(1, 2);
}

/// The last multiplication is an addition.
fn altered(ir: &mut KernelIr) {
    let last = ir.values.iter_mut().rev().find(|d| matches!(d.op, Op::Mul(..))).expect("a kernel multiplies");
    if let Op::Mul(a, b) = last.op {
        last.op = Op::Add(a, b);
    }
}

const SLIPS: [Slip; 8] = [
    ("energy", altered, &[ENERGY]),
    ("force", swapped, &[ENERGY, FORCE]),
    ("dforce", swapped, &[FORCE, SYMMETRY]),
    ("diagonal", swapped, &[OTHERS]),
    ("cauchy", swapped, &[OTHERS]),
    ("dissipation", altered, &[DISSIPATION]),
    ("damping", swapped, &[DISSIPATION, DAMPING]),
    ("ddamping", swapped, &[DAMPING, SYMMETRIC_DAMPING]),
];

fn failed(subject: &Subject, samples: usize) -> Vec<&'static str> {
    let options = Options { samples, seed: 5 };
    check(subject, options, Err("not asked for".into())).expect("a material").failed()
}

#[test]
fn a_slip_is_found() {
    // Every third, and those with a dissipation: each takes seconds.
    let chosen = laws().iter().enumerate().filter(|(k, law)| k % 3 == 0 || law.damping.is_some());
    for (_, entry) in chosen {
        for (kernel, slip, wanted) in SLIPS {
            let mut subject = Subject::of_build(entry);
            let Derivation { kernels, .. } = &mut subject.derivation;
            // The form that is not split is the one that is judged.
            let far = format!("{kernel}_far");
            let names: Vec<String> = kernels.iter().map(|k| k.ir().name.clone()).collect();
            let name = if names.contains(&far) { far.as_str() } else { kernel };
            let Some(at) = names.iter().position(|n| n == name) else {
                assert!(entry.damping.is_none() && DAMPING_KERNELS.contains(&kernel), "{}: {kernel}", entry.info.name);
                continue;
            };
            let mut ir = kernels[at].ir().clone();
            // Those of principal axes take minutes in 448 bits.
            if ir.values.len() > 1000 {
                continue;
            }
            slip(&mut ir);
            kernels[at] = ir.validate().expect("a slip leaves a kernel a kernel");
            let found = failed(&subject, 0);
            assert!(wanted.iter().all(|w| found.contains(w)), "{}, {kernel}: {found:?}", entry.info.name);
        }
    }
}

#[test]
fn lost_digits_are_found() {
    let [law, derivation] = [include_str!("data/loses_digits.rs"), include_str!("data/derived/loses_digits.ir")];
    let subject = Subject::from_texts("loses_digits.rs", law, derivation).expect("a law and its derivation");
    assert_eq!(failed(&subject, 1), [ACCURATE]);
}
