//! The committed derivations: those of this build's laws, and what a build without Symbolica says without them.

use std::path::Path;

use tensormass_kernels::laws;
use tensormass_testing::codegen::derivation::Derivation;
use tensormass_testing::codegen::generate::generate_committed;
use tensormass_testing::{derivation_text, root};

/// Generates from a folder with one law and, where given, a derivation of it; returns the error, or nothing.
fn check(law: &str, text: &str, derivation: Option<&str>, expected: Option<&str>) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (laws, out) = (folder.path().join("laws"), folder.path().join("out"));
    std::fs::create_dir_all(laws.join("derived")).expect("a new folder");
    std::fs::create_dir_all(&out).expect("a new folder");
    std::fs::write(laws.join(format!("{law}.rs")), text).expect("a new file");
    if let Some(derivation) = derivation {
        std::fs::write(laws.join(format!("derived/{law}.ir")), derivation).expect("a new file");
    }
    let message = generate_committed(&laws, &out).err().map(|e| e.to_string());
    assert_eq!(message.as_deref(), expected, "law {law}");
    assert_eq!(out.join("kernels.rs").exists(), expected.is_none(), "kernels are written or not at all");
}

fn read(path: impl AsRef<Path>) -> String {
    std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.as_ref().display()))
}

#[test]
fn fresh_derivations_are_the_committed_ones() {
    let mut unreviewed = 0;
    for law in laws() {
        let name = law.info.name;
        if !law.info.reviewed {
            unreviewed += 1;
            continue;
        }
        let fresh = Path::new(env!("TENSORMASS_GENERATED")).join(format!("derived/{name}.ir"));
        assert_eq!(fresh.exists(), cfg!(feature = "derive"), "{}", fresh.display());
        if fresh.exists() {
            let committed = root().join(format!("laws/derived/{name}.ir"));
            assert!(
                std::fs::read(&fresh).expect("checked above") == std::fs::read(&committed).expect("a reviewed law"),
                "{name}: differentiating gives another text than {}; `cargo xtask law accept {name}` and review",
                committed.display()
            );
        }
    }
    eprintln!("skipped {unreviewed} unreviewed laws");
}

#[test]
fn a_derivation_is_its_text() {
    for law in laws() {
        let name = law.info.name;
        let text = derivation_text(env!("TENSORMASS_GENERATED"), name);
        let read = Derivation::from_text(&text).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert!(read.to_text() == text, "{name}: reading its derivation and writing it again gives another text");
        assert_eq!((read.law.as_str(), read.hash), (name, law.info.hash));
    }
}

#[test]
fn a_law_without_its_derivation_is_refused() {
    for law in laws().iter().filter(|law| law.info.reviewed) {
        let name = law.info.name;
        let refusal = |state: &str| {
            format!(
                "laws/{name}.rs: its derivation laws/derived/{name}.ir is {state}, and this build cannot differentiate. \
                 Remedies: build with `--features derive` (differentiates at build time), or `cargo xtask law accept \
                 {name}` (writes the derivation)"
            )
        };
        let text = read(root().join(format!("laws/{name}.rs")));
        let ir = read(root().join(format!("laws/derived/{name}.ir")));
        check(name, &text, Some(&ir), None);
        // Another checkout's line ends are no other text.
        check(name, &text.replace('\n', "\r\n"), Some(&ir), None);
        check(name, &text, None, Some(&refusal("missing")));
        check(name, &format!("{text}\n"), Some(&ir), Some(&refusal("stale (derived from another text of the law)")));
        let other = ir.replacen(&format!("law {name}\n"), "law other\n", 1);
        check(name, &text, Some(&other), Some(&refusal("stale (derived from another text of the law)")));
        let cut = "unreadable (line 1: expected `# tensormass derivation 2`)";
        check(name, &text, Some(""), Some(&refusal(cut)));
        // With what follows it.
        let (without_last, _) = ir.split_once("kernel cauchy\n").expect("a derivation has it");
        let left = Derivation::from_text(&ir).expect("checked above").kernels;
        let left: Vec<String> =
            left.iter().map(|k| k.ir().name.clone()).take_while(|k| !k.starts_with("cauchy")).collect();
        let five = format!(
            "unreadable (expected the kernels material, energy, force, dforce, diagonal, cauchy, found {})",
            left.join(", ")
        );
        check(name, &text, Some(without_last), Some(&refusal(&five)));
    }
}
