#version 460
// `ortelius doctor`: two points for each even vertex, none for an odd one.
layout(points) in;
layout(points, max_vertices = 2) out;
layout(location = 0) flat in uint index[];
layout(location = 0, xfb_buffer = 0, xfb_stride = 4, xfb_offset = 0) flat out uint value;

void main() {
    if ((index[0] & 1u) == 1u) return;
    for (uint n = 0; n < 2; n++) {
        value = 2 * index[0] + n;
        EmitVertex();
        EndPrimitive();
    }
}
