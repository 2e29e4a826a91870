// Step A of paper 3: the ellipse of a footprint. Symmetric matrices are stored as (11, 12, 22).

// A footprint with a longer semi-axis gets the texture's mean. No texture has a longer side.
const float MAX_MAJOR_TEXELS = 1048576.0;

// J J^T.
vec3 spread(vec4 j) {
    return vec3(dot(j.xy, j.xy), dot(j.xy, j.zw), dot(j.zw, j.zw));
}

// The larger and the smaller eigenvalue.
vec2 eigenvalues(vec3 v, float det) {
    float larger = 0.5 * (v.x + v.z) + length(vec2(0.5 * (v.x - v.z), v.y));
    return vec2(larger, larger > 0.0 ? det / larger : 0.0);
}

// Stretches the minor axis so that the axis ratio is at most `max_ratio`, and updates det.
vec3 widened(vec3 v, inout float det, float max_ratio) {
    vec2 values = eigenvalues(v, det);
    float least = values.x / (max_ratio * max_ratio);
    if (values.y >= least) return v;
    float part = (least - values.y) / (values.x - values.y);
    det = values.x * least;
    return vec3(v.x + part * (values.x - v.x), v.y - part * v.y, v.z + part * (values.x - v.z));
}

// The longest useful footprint at a sphere's limb. There the sphere curves away within a pixel, but the plane of a
// facet does not, so the facet's footprint is unbounded. A sphere of radius R falls by the width p of a pixel over an
// arc of sqrt(2 p R) at the limb. The bound is the footprint in the middle of that pixel, where the surface has fallen
// by p / 2: sqrt(p R). `limb` is p / R. The result is in texels of a longitude-latitude texture with `rows` rows; 0: no
// bound.
float max_major_texels(float limb, float rows) { return sqrt(limb) * rows * 0.31830989; }

// Shortens J's major axis, measured on the sphere, to at most `most` texels. `across`: the cosine of the latitude.
vec4 limited(vec4 j, float most, float across) {
    if (!(most > 0.0)) return j;
    j.xy *= across;
    vec3 v = spread(j);
    float det = j.x * j.w - j.y * j.z;
    vec2 values = eigenvalues(v, det * det);
    // A footprint that is not finite stays unchanged.
    if (values.x > most * most && values.x < 1e36) {
        // e e^T = (V - smaller I) / (larger - smaller), e the major axis.
        float part = (1.0 - most * inversesqrt(values.x)) / (values.x - values.y);
        vec2 s = (v.x - values.y) * j.xy + v.y * j.zw, t = v.y * j.xy + (v.z - values.y) * j.zw;
        j -= part * vec4(s, t);
    }
    j.xy /= across;
    return j;
}

// The pixel's centre in a level: its texel, and the position within that texel, in [0, 1).
struct Spot {
    ivec2 texel;
    vec2 within;
};
