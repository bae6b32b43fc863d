// Reads a table once, texel by texel as rays do, and does nothing with it but add.

@group(0) var table: texture_2d<u32>;
// One a thread: without them nothing would have to be read.
@group(0) var<storage, read_write> sums: array<u32>;

const WORKGROUP: u32 = {{ WORKGROUP }};
// Of one thread. Those of a workgroup lie in one row next to each other, so that it reads whole cache lines.
const TEXELS: u32 = {{ TEXELS_A_THREAD }};

@compute @workgroup_size({{ WORKGROUP }})
fn main(
    @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let first = group.x * WORKGROUP * TEXELS + lane;
    var sum = vec4u(0u);
    for (var i = 0u; i < TEXELS; i++) {
        sum += textureLoad(table, vec2u(first + i * WORKGROUP, group.y), 0);
    }
    sums[(group.y * groups.x + group.x) * WORKGROUP + lane] = sum.x + sum.y + sum.z + sum.w;
}
