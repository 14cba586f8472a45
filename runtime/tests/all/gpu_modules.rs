//! The WGSL that is not generated from laws: valid without optional capabilities, within every device's limits, and free
//! of what devices compute differently.
#![cfg(feature = "gpu")]

use tensormass_runtime::gpu::modules;
use tensormass_testing::wgsl;

#[test]
fn every_module_keeps_the_rules() {
    let modules = modules();
    assert!(modules.len() > 16, "operations and a solver's updates, not {}", modules.len());
    for (name, text) in modules {
        let bound = wgsl::check(&text).unwrap_or_else(|refusal| panic!("{name}: {refusal:?}\n{text}"));
        for b in &bound[1..] {
            assert!(b.used && !b.uniform, "{name}: {} is bound and not used\n{text}", b.name);
        }
        assert!(bound[0].uniform, "{name}: the uniform is binding 0");
    }
}
