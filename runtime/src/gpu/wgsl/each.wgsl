
@compute @workgroup_size(work_group_size)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let i = (group.y * groups.x + group.x) * work_group_size + local;
    if i < numbers.count {
        each(i);
    }
}
