// What stands before an invocation in its group, by shared memory. Include after local_size.
shared uint prefix_sums[gl_WorkGroupSize.x];

// The sum of `value` over the invocations before this one, and over all. Called by the whole group.
uvec2 group_prefix(uint value) {
    uint self = gl_LocalInvocationIndex;
    prefix_sums[self] = value;
    barrier();
    for (uint reach = 1; reach < gl_WorkGroupSize.x; reach <<= 1) {
        uint before = self >= reach ? prefix_sums[self - reach] : 0u;
        barrier();
        prefix_sums[self] += before;
        barrier();
    }
    return uvec2(prefix_sums[self] - value, prefix_sums[gl_WorkGroupSize.x - 1u]);
}
