//! Node passes: one invocation a node sums the partial forces of its elements.

use super::Shader;
use super::binding::{Binding, declarations};

fn shader(what: &str, bindings: &[Binding], body: &str) -> Shader {
    let declarations = declarations(bindings);
    let text = format!("{what}\noverride work_group_size: u32 = 64u;\n\n{declarations}{SUM_OF_SLOTS}{body}");
    Shader { text, bindings: bindings.to_vec() }
}

/// Adds to each node's vector the sum of its slots.
pub fn node_sum() -> Shader {
    let bindings = [Binding::NodePass, Binding::Slots, Binding::Incidence, Binding::Sum];
    shader("// Adds to each node's vector a multiple of the sum of its slots.\n", &bindings, NODE_SUM)
}

/// The product of the operator with an increment at each node, and its scalar product with the increment.
pub fn node_product() -> Shader {
    let bindings = [
        Binding::NodePass,
        Binding::Slots,
        Binding::Incidence,
        Binding::Increment,
        Binding::Masses,
        Binding::Product,
        Binding::Partials,
        Binding::Gate,
    ];
    let what = "\
// The product y = (a M + b K) x at each node, from slots that hold the elements' parts of K x, and a partial sum of x . y
// for each work group. Components that are imposed stay 0. The size of a work group is a power of two.
";
    shader(what, &bindings, NODE_PRODUCT)
}

const SUM_OF_SLOTS: &str = "
// In the order of the slots, whatever the device.
fn sum_of_slots(i: u32) -> vec3<f32> {
    var s = vec3<f32>(0.0f, 0.0f, 0.0f);
    let end = incidence[i + 1u];
    for (var k = incidence[i]; k < end; k++) {
        s += slots[incidence[k]].xyz;
    }
    return s;
}
";

const NODE_SUM: &str = "
@compute @workgroup_size(work_group_size)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let i = (group.y * groups.x + group.x) * work_group_size + local;
    if i < node_pass.nodes {
        let old = sum[i];
        sum[i] = vec4<f32>(old.xyz + node_pass.factor * sum_of_slots(i), old.w);
    }
}
";

const NODE_PRODUCT: &str = "
// y at one node; returns its scalar product with x.
fn node_product(i: u32) -> f32 {
    let x = increment[i];
    var y: vec3<f32>;
    if node_pass.first != 0u {
        y = node_pass.mass_factor * masses[i].xyz * x.xyz;
    } else {
        y = product[i].xyz;
    }
    y += node_pass.factor * sum_of_slots(i);
    let imposed = (vec3<u32>(u32(x.w)) & vec3<u32>(1u, 2u, 4u)) != vec3<u32>(0u, 0u, 0u);
    y = select(y, vec3<f32>(0.0f, 0.0f, 0.0f), imposed);
    product[i] = vec4<f32>(y, x.w);
    return dot(x.xyz, y);
}

var<workgroup> terms: array<f32, work_group_size>;

@compute @workgroup_size(work_group_size)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    if gate[0] == 0.0f {
        return;
    }
    let g = group.y * groups.x + group.x;
    let i = g * work_group_size + local;
    // No return for nodes beyond the last: every invocation of a group has to meet the barriers.
    var term = 0.0f;
    if i < node_pass.nodes {
        term = node_product(i);
    }
    terms[local] = term;
    workgroupBarrier();
    for (var width = work_group_size / 2u; width > 0u; width /= 2u) {
        if local < width {
            terms[local] += terms[local + width];
        }
        workgroupBarrier();
    }
    if local == 0u {
        partials[g] = terms[0];
    }
}
";
