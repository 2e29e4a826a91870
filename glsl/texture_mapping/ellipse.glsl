// Steps A to D of paper 3: the weighted mean of the texels of an ellipse. Needs ellipse_level.glsl, weights.glsl,
// `float weight(vec2)` and the texture's `vec3 texel(ivec2 at, uint level)`.
layout(constant_id = 57) const uint AXES = 2;  // the index of the variant of `Axes`

// Limit on the iterations of each loop, whatever its bounds.
const int MAX_TURNS = 4096;

// 2^-100. A smaller sum of weights counts as 0. f32 loses weights below 2^-126, some devices all subnormal ones, so a
// smaller sum would have a device-dependent mean. Only footprints far smaller than a texel, with K near 0, are so
// small.
const float MIN_WEIGHTS = 7.8886091e-31;

struct EllipseMean {
    vec3 colour;
    uint fetched;
    bool empty;  // the weights' sum was below MIN_WEIGHTS; `colour` is the nearest texel's
    uint visited;
};

// A square root of V^-1. It maps texels to the unit disc: (x + y shear, y) times `scale`.
struct ToDisc {
    float shear;
    vec2 scale;
};

ToDisc to_disc(vec3 v, float det) {
    return ToDisc(-v.y / v.z, vec2(sqrt(v.z / det), inversesqrt(v.z)));
}

// Formula (4) as printed: one axis is `along`, a row or column of J. The other is perpendicular and as long as `other`.
// `k`: the reconstruction term.
mat2 printed(vec2 along, vec2 other, float scale, float k) {
    float length_of = length(along);
    vec2 turn = length_of > 0.0 ? along / length_of : vec2(1.0, 0.0);
    // If k is 0, an axis may have length 0. 1e-30 keeps its inverse finite; only texels on the other axis get a weight.
    vec2 axes = inversesqrt(max(vec2(dot(along, along), dot(other, other)) * scale + k, 1e-30));
    return mat2(vec2(turn.x * axes.x, -turn.y * axes.y), vec2(turn.y * axes.x, turn.x * axes.y));
}

// Filters `level` with the ellipse `finest` of level 0. `whole`: the level has one texel.
EllipseMean ellipse_mean(vec4 jacobian, Ellipse finest, uint level, bool whole, Spot spot) {
    float half_power = power_of_half(level);
    Ellipse ellipse = at_level(finest, level);
    vec2 offset = spot.within - 0.5;  // texel spot.texel + (i, j) lies at (i, j) - offset
    EllipseMean result = EllipseMean(texel(spot.texel, level), 1, !whole, 0);
    if (whole || !(ellipse.det > 0.0)) return result;

    ToDisc disc = to_disc(ellipse.v, ellipse.det);
    vec4 j = jacobian * RADIUS;
    mat2 weight_axes = AXES == 3 ? mat2(inversesqrt(eigenvalues(ellipse.v, ellipse.det).x))
                     : AXES == 0 ? printed(j.xy, j.zw, half_power * half_power, ellipse.k)
                                 : printed(j.xz, j.yw, half_power * half_power, ellipse.k);
    Ellipse reach_of = outer(ellipse);
    vec3 reach = reach_of.v;
    float rows = sqrt(reach.z);
    float width = ROW_SPAN == 1 ? sqrt(reach_of.det / reach.z) : sqrt(reach.x);
    ToDisc outer_disc = to_disc(reach, reach_of.det);
    float lean = ROW_SPAN == 1 ? reach.y / reach.z : 0.0;

    vec3 sum = vec3(0.0);
    vec3 first = vec3(0.0);
    float weights = 0.0;
    uint fetched = 0;
    uint visited = 0;
    int bottom = int(floor(offset.y + rows));
    int row = int(ceil(offset.y - rows));
    for (int turn = 0; turn < MAX_TURNS && row <= bottom; ++turn, ++row) {
        float dv = float(row) - offset.y;
        float span = ROW_SPAN == 1 ? width * sqrt(max(1.0 - dv * dv / reach.z, 0.0)) : width;
        int right = int(floor(offset.x + lean * dv + span));
        int column = int(ceil(offset.x + lean * dv - span));
        for (int step = 0; step < MAX_TURNS && column <= right; ++step, ++column) {
            float du = float(column) - offset.x;
            vec2 at = vec2(du + disc.shear * dv, dv) * disc.scale;
            float r = length(at);
            vec2 slope = vec2(at.x * disc.scale.x, disc.shear * at.x * disc.scale.x + at.y * disc.scale.y);
            float steepness = length(slope);
            float signed_distance = steepness > 0.0 ? (1.0 - r) * r / steepness : 1e6;
            float part = kept(signed_distance);
            // A row span already ends at the outer ellipse.
            vec2 in_outer = vec2(du + outer_disc.shear * dv, dv) * outer_disc.scale;
            if (ROW_SPAN == 0 && dot(in_outer, in_outer) > 1.0) part = 0.0;
            ++visited;
            if (part > 0.0) {
                float w = part * weight(AXES == 2 ? at : weight_axes * vec2(du, dv));
                vec3 value = texel(spot.texel + ivec2(column, row), level);
                // Sums differences from the first texel, so that a constant texture gives its exact value.
                if (fetched == 0) first = value;
                sum += w * (value - first);
                weights += w;
                ++fetched;
            }
        }
    }
    result.visited = visited;
    if (weights >= MIN_WEIGHTS) {
        result.colour = first + sum / weights;
        result.fetched = fetched;
        result.empty = false;
    }
    return result;
}
