
var<workgroup> terms: array<f32, work_group_size>;

@compute @workgroup_size(work_group_size)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    if stopped() {
        return;
    }
    let g = group.y * groups.x + group.x;
    let i = g * work_group_size + local;
    // No return beyond the last: every invocation of a group has to meet the barriers.
    var own = 0.0f;
    if i < numbers.count {
        own = term(i);
    }
    terms[local] = own;
    workgroupBarrier();
    for (var width = work_group_size / 2u; width > 0u; width /= 2u) {
        if local < width {
            terms[local] = joined(terms[local], terms[local + width]);
        }
        workgroupBarrier();
    }
    if local == 0u {
        partials[numbers.k + g] = terms[0];
    }
}
