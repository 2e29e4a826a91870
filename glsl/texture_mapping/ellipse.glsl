// A to D: the weighted mean of the texels of an ellipse.
layout(constant_id = 1) const uint AXES = 2;  // the order of `Axes`
layout(constant_id = 2) const uint ALL_POSITIVE = 1;
layout(constant_id = 3) const float K = 0.0;
layout(constant_id = 4) const uint ROW_SPAN = 1;
layout(constant_id = 5) const float MINOR_TEXELS = 0.0;
layout(constant_id = 6) const float MOST_RATIO = 64.0;
layout(constant_id = 7) const float RADIUS = 1.0;
layout(constant_id = 8) const float MOST_VISITED = 16384.0;

// Loops end after so many turns whatever their bounds are.
const int MOST_TURNS = 4096;

struct Ellipse {
    vec3 v;
    float det;
    uint level;
    bool whole;  // the level of one texel
};

Ellipse ellipse_of(Pixel pixel) {
    vec3 v = spread(pixel.jacobian * RADIUS);
    float det = pixel.det * (RADIUS * RADIUS);
    det *= det;
    if (!(v.x + v.z < MOST_MAJOR_TEXELS * MOST_MAJOR_TEXELS)) return Ellipse(vec3(1.0), 1.0, COARSEST, true);
    v = widened(v, det, MOST_RATIO);
    float smaller = eigenvalues(v, det).y;
    float wanted = MINOR_TEXELS > 0.0 ? floor(log2(sqrt(max(smaller, 1e-30)) / MINOR_TEXELS)) : 0.0;
    float visited = ROW_SPAN == 1 ? 4.0 * sqrt(det) : 4.0 * sqrt(v.x * v.z);
    wanted = max(wanted, ceil(0.5 * log2(max(4.0 * visited / MOST_VISITED, 1e-30))));
    wanted = max(wanted, ceil(log2(max(sqrt(max(v.x, v.z)) / 1024.0, 1e-30))));
    uint level = uint(clamp(wanted, 0.0, float(COARSEST)));
    if (level == COARSEST) return Ellipse(vec3(1.0), 1.0, COARSEST, true);
    float scale = power_of_half(level) * power_of_half(level);
    v *= scale;
    // All terms are positive: det(V + k I).
    det = det * (scale * scale) + K * (v.x + v.z) + K * K;
    v += vec3(K, 0.0, K);
    if (ALL_POSITIVE == 0) det = v.x * v.z - v.y * v.y;
    return Ellipse(v, det, level, false);
}

// A square root of V^-1: maps texels to the unit disc by (x + y shear, y) and scales.
struct ToDisc {
    float shear;
    vec2 scale;
};

ToDisc to_disc(vec3 v, float det) {
    return ToDisc(-v.y / v.z, vec2(sqrt(v.z / det), inversesqrt(v.z)));
}

// (4) as printed: along the row or the column (x, y) of J, and as deep as the other is long.
mat2 printed(vec2 along, vec2 other, float scale) {
    float length_of = length(along);
    vec2 turn = length_of > 0.0 ? along / length_of : vec2(1.0, 0.0);
    vec2 axes = inversesqrt(vec2(dot(along, along), dot(other, other)) * scale + K);
    return mat2(vec2(turn.x * axes.x, -turn.y * axes.y), vec2(turn.y * axes.x, turn.x * axes.y));
}

Filtered ellipse_filtered(Pixel pixel) {
    Ellipse ellipse = ellipse_of(pixel);
    float half_power = power_of_half(ellipse.level);
    vec2 centre = pixel.centre * half_power;
    ivec2 base = ivec2(floor(centre));
    vec2 offset = centre - floor(centre) - 0.5;  // texel base + (i, j) lies at (i, j) - offset
    Filtered result = Filtered(texel(base, ellipse.level), 1, ellipse.level, !ellipse.whole, 0);
    if (ellipse.whole || !(ellipse.det > 0.0)) return result;

    ToDisc disc = to_disc(ellipse.v, ellipse.det);
    vec4 j = pixel.jacobian * RADIUS;
    mat2 weight_axes = AXES == 3 ? mat2(inversesqrt(eigenvalues(ellipse.v, ellipse.det).x))
                     : AXES == 0 ? printed(j.xy, j.zw, half_power * half_power)
                                 : printed(j.xz, j.yw, half_power * half_power);
    // The ellipse that holds all texels of which an edge may keep a part: a sum of the ellipse and a disc of half a texel.
    vec3 reach = ellipse.v;
    float reach_det = ellipse.det;
    if (EDGE == 0) {
        // No span ends before a texel that is just inside.
        reach *= 1.0001;
        reach_det *= 1.0002;
    } else {
        float t = 2.0 * sqrt(eigenvalues(ellipse.v, ellipse.det).y);
        float a = 1.0 + 1.0 / t;
        float b = 0.25 * (1.0 + t);
        reach = reach * a + vec3(b, 0.0, b);
        reach_det = a * a * reach_det + a * b * (ellipse.v.x + ellipse.v.z) + b * b;
    }
    float rows = sqrt(reach.z);
    float width = ROW_SPAN == 1 ? sqrt(reach_det / reach.z) : sqrt(reach.x);
    ToDisc outer = to_disc(reach, reach_det);
    float lean = ROW_SPAN == 1 ? reach.y / reach.z : 0.0;

    vec3 sum = vec3(0.0);
    vec3 first = vec3(0.0);
    float weights = 0.0;
    uint fetched = 0;
    uint visited = 0;
    int bottom = int(floor(offset.y + rows));
    int row = int(ceil(offset.y - rows));
    for (int turn = 0; turn < MOST_TURNS && row <= bottom; ++turn, ++row) {
        float dv = float(row) - offset.y;
        float span = ROW_SPAN == 1 ? width * sqrt(max(1.0 - dv * dv / reach.z, 0.0)) : width;
        int right = int(floor(offset.x + lean * dv + span));
        int column = int(ceil(offset.x + lean * dv - span));
        for (int step = 0; step < MOST_TURNS && column <= right; ++step, ++column) {
            float du = float(column) - offset.x;
            vec2 at = vec2(du + disc.shear * dv, dv) * disc.scale;
            float r = length(at);
            vec2 slope = vec2(at.x * disc.scale.x, disc.shear * at.x * disc.scale.x + at.y * disc.scale.y);
            float steepness = length(slope);
            float signed_distance = steepness > 0.0 ? (1.0 - r) * r / steepness : 1e6;
            float part = kept(signed_distance);
            // A row's span ends there by itself.
            vec2 in_outer = vec2(du + outer.shear * dv, dv) * outer.scale;
            if (ROW_SPAN == 0 && dot(in_outer, in_outer) > 1.0) part = 0.0;
            ++visited;
            if (part > 0.0) {
                float w = part * weight(AXES == 2 ? at : weight_axes * vec2(du, dv));
                vec3 value = texel(base + ivec2(column, row), ellipse.level);
                // Differences from the first texel: a constant texture comes out exactly.
                if (fetched == 0) first = value;
                sum += w * (value - first);
                weights += w;
                ++fetched;
            }
        }
    }
    result.visited = visited;
    if (weights > 0.0) {
        result.colour = first + sum / weights;
        result.fetched = fetched;
        result.empty = false;
    }
    return result;
}
