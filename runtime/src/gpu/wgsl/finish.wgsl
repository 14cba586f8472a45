
var<workgroup> terms: array<f32, work_group_size>;

// One work group: partial sums in a fixed order.
@compute @workgroup_size(work_group_size)
fn main(@builtin(local_invocation_index) local: u32) {
    var own = 0.0f;
    for (var i = local; i < numbers.count; i += work_group_size) {
        own += partials[i];
    }
    terms[local] = own;
    workgroupBarrier();
    for (var width = work_group_size / 2u; width > 0u; width /= 2u) {
        if local < width {
            terms[local] += terms[local + width];
        }
        workgroupBarrier();
    }
    if local == 0u {
        finish(terms[0]);
    }
}
