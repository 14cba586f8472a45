//! The lint of generated WGSL: for each refusal a text that is refused, beside the nearest one that is not.

use tensormass_testing::wgsl::{Refusal, check as lint};

/// A kernel with this body; `f` is what it reads and writes, `x` its first entry.
fn kernel(body: &str) -> String {
    format!(
        "@group(0) @binding(0) var<storage, read_write> f: array<f32>;
         @compute @workgroup_size(64)
         fn main(@builtin(local_invocation_index) i: u32) {{ let x = f[i]; {body} }}"
    )
}

/// A kernel that reads this many storage buffers and writes one of them.
fn buffers(n: usize) -> String {
    let declared: String =
        (0..n).map(|k| format!("@group(0) @binding({k}) var<storage, read_write> b{k}: array<f32>;\n")).collect();
    let sum = (0..n).map(|k| format!("b{k}[i]")).collect::<Vec<_>>().join(" + ");
    format!(
        "{declared} @compute @workgroup_size(64)
         fn main(@builtin(local_invocation_index) i: u32) {{ b0[i] = {sum}; }}"
    )
}

/// A kernel whose work group has this size and this many floats of memory, by the defaults of its constants.
fn group(size: u32, floats: u32) -> String {
    format!(
        "override size: u32 = {size}u;
         override floats: u32 = {floats}u;
         @group(0) @binding(0) var<storage, read_write> f: array<f32>;
         var<workgroup> shared_: array<f32, floats>;
         @compute @workgroup_size(size)
         fn main(@builtin(local_invocation_index) i: u32) {{ shared_[i] = f[i]; f[i] = shared_[i]; }}"
    )
}

/// Checks that `good` passes and `bad` is refused, for this reason.
fn check(good: &str, bad: &str, expected: &Refusal) {
    let passed = lint(good);
    assert!(passed.is_ok(), "{good}\n{passed:?}");
    let refusal = lint(bad).expect_err(bad);
    let same = match (&refusal, expected) {
        // What naga says of a text is naga's; that it says it at all is ours.
        (Refusal::Parse(said), Refusal::Parse(word)) | (Refusal::Invalid(said), Refusal::Invalid(word)) => {
            said.contains(word.as_str())
        }
        (refusal, expected) => refusal == expected,
    };
    assert!(same, "{bad}\n{refusal:?}, expected {expected:?}");
}

#[test]
fn refused() {
    let store = |value: &str| kernel(&format!("f[i] = {value};"));
    let good = store("sqrt(x) + fma(x, x, 1.0f)");
    let cases = [
        (store("x +"), Refusal::Parse("expected".into())),
        (store("f32(i64(x) + 1li)"), Refusal::Invalid("is invalid".into())),
        (format!("enable subgroups;\n{}", store("subgroupAdd(x)")), Refusal::Parse("subgroup".into())),
        (store("f32(f64(x) * 2.0lf)"), Refusal::Double),
        (kernel("let y: vec2<f64> = vec2<f64>(); f[i] = x;"), Refusal::Double),
        (format!("var<workgroup> n: atomic<u32>;\n{}", kernel("f[i] = f32(atomicAdd(&n, 1u));")), Refusal::Atomic),
        (store("select(0.0f, x, x == x)"), Refusal::NotANumber),
        (store("select(0.0f, x, f[i] != f[i])"), Refusal::NotANumber),
        (store("select(0.0f, x, isNan(x))"), Refusal::Parse("isNan".into())),
        (store("select(0.0f, x, isInf(x))"), Refusal::Parse("isInf".into())),
        (store("log(x)"), Refusal::Function("log".into())),
        (store("log2(x)"), Refusal::Function("log2".into())),
        (store("exp(x)"), Refusal::Function("exp".into())),
        (store("exp2(x)"), Refusal::Function("exp2".into())),
        (store("pow(x, 0.5f)"), Refusal::Function("pow".into())),
    ];
    for (bad, expected) in &cases {
        check(&good, bad, expected);
    }
    check(&store("select(0.0f, x, x == f[i + 1u])"), &store("select(0.0f, x, x >= x)"), &Refusal::NotANumber);
    check(&buffers(8), &buffers(9), &Refusal::StorageBuffers(9));
    check(&group(256, 256), &group(257, 256), &Refusal::WorkGroup(257));
    check(&group(64, 4096), &group(64, 4097), &Refusal::WorkGroupBytes(16388));
}
