// PCG in four dimensions (Jarzynski and Olano, "Hash Functions for GPU Rendering", JCGT 2020).
uvec4 stir(uvec4 v) {
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}
uvec4 hash(uvec4 v) {
    v = stir(v * 1664525u + 1013904223u);
    return stir(v ^ v >> 16);
}
