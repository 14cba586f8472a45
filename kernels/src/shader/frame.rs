//! What every element pass has around the computation of one element.

/// The parameters of every element pass.
pub(super) const OVERRIDES: &str = "\
override work_group_size: u32 = 64u;
// Elements that one invocation computes, one after the other.
override elements_per_invocation: u32 = 1u;
";

/// That of passes which read constants.
pub(super) const STRIDE: &str = "\
// Constants between one element's set and the next; 0 where all share one, which a compiler can then load once.
override constants_stride: u32 = 0u;
";

/// The entry point, which calls `element` for each element of an invocation.
pub(super) fn entry_point(gated: bool) -> String {
    let gate = if gated { "    if gate[0] == 0.0f {\n        return;\n    }\n" } else { "" };
    format!(
        "
@compute @workgroup_size(work_group_size)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {{
{gate}    let invocations = groups.x * groups.y * work_group_size;
    let e = (group.y * groups.x + group.x) * work_group_size + local;
    if e < element_pass.elements {{
        element(e);
    }}
    // Not one loop for all: where an invocation has one element, nothing of a loop may be left.
    for (var i = 1u; i < elements_per_invocation; i++) {{
        let next = e + i * invocations;
        if next < element_pass.elements {{
            element(next);
        }}
    }}
}}
"
    )
}
