// Prefix sums over a workgroup in shared memory. Include after local_size.
shared uint prefix_sums[gl_WorkGroupSize.x];

// Returns the exclusive prefix sum of `value` (x) and the sum over the workgroup (y). All invocations must call it.
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
