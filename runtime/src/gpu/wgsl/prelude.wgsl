override work_group_size: u32 = 256u;

struct Numbers {
    // What the pass runs over: nodes, constrained nodes, elements, or partial sums.
    count: u32,
    // Where something begins, or which register is meant.
    k: u32,
    // A factor.
    a: f32,
    // Where values of motions begin.
    base: u32,
}
@group(0) @binding(0) var<uniform> numbers: Numbers;
