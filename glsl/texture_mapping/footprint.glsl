// A: the ellipse of a footprint, symmetric matrices as (11, 12, 22).

// Beyond so many texels the footprint's mean is the texture's: squares of more do not fit f32.
const float MOST_MAJOR_TEXELS = 1048576.0;

// J J^T.
vec3 spread(vec4 j) {
    return vec3(dot(j.xy, j.xy), dot(j.xy, j.zw), dot(j.zw, j.zw));
}

// The larger and the smaller eigenvalue.
vec2 eigenvalues(vec3 v, float det) {
    float larger = 0.5 * (v.x + v.z) + length(vec2(0.5 * (v.x - v.z), v.y));
    return vec2(larger, larger > 0.0 ? det / larger : 0.0);
}

// The minor axis stretched until the ratio of the axes is `most_ratio`; det is updated.
vec3 widened(vec3 v, inout float det, float most_ratio) {
    vec2 values = eigenvalues(v, det);
    float least = values.x / (most_ratio * most_ratio);
    if (values.y >= least) return v;
    float part = (least - values.y) / (values.x - values.y);
    det = values.x * least;
    return vec3(v.x + part * (values.x - v.x), v.y - part * v.y, v.z + part * (values.x - v.z));
}
