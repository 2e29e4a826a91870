// A: the ellipse of a footprint, symmetric matrices as (11, 12, 22).

// Beyond this many texels the footprint's mean is the texture's: squares of more do not fit f32.
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

// Towards a sphere's limb the surface bends away under a pixel, and the plane of a facet goes on: its footprint has no bound. A
// pixel p wide sees a sphere of radius R at its limb over sqrt(2 p R), where the surface has fallen by p; on average over a
// pixel sqrt(p R) a pixel. `limb` is p / R; the result in texels of a texture of longitude and latitude, 0 where there is no bound.
float most_major_texels(float limb, float rows) { return sqrt(limb) * rows * 0.31830989; }

// J with its major axis, on the sphere, no longer than `most`. `across`: the cosine of the latitude.
vec4 limited(vec4 j, float most, float across) {
    if (!(most > 0.0)) return j;
    j.xy *= across;
    vec3 v = spread(j);
    float det = j.x * j.w - j.y * j.z;
    vec2 values = eigenvalues(v, det * det);
    // A footprint that is not finite stays as it is.
    if (values.x > most * most && values.x < 1e36) {
        // e e^T = (V - smaller I) / (larger - smaller), e the major axis.
        float part = (1.0 - most * inversesqrt(values.x)) / (values.x - values.y);
        vec2 s = (v.x - values.y) * j.xy + v.y * j.zw, t = v.y * j.xy + (v.z - values.y) * j.zw;
        j -= part * vec4(s, t);
    }
    j.xy /= across;
    return j;
}

// Where in a level the pixel's centre is: in which texel, and where in that, [0, 1).
struct Spot {
    ivec2 texel;
    vec2 within;
};
