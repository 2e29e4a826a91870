#version 460
// variants FORM: 0 1 2 3
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "common/form.glsl"
#include "common/view.glsl"
#include "common/exact.glsl"
#include "texture_mapping/footprint.glsl"
#include "texture_mapping/weights.glsl"
#include "common/hash.glsl"
#include "texture_mapping/ellipse_level.glsl"
#include "texture_mapping/baseline_level.glsl"
#include "texture_mapping/surface_filter_level.glsl"

// One plain texture, for surfaces without a virtual texture and as the baseline for virtual textures. The filter is the
// sampler with implicit derivatives, or a filter of paper 3.
const float MAX_REACH = 1024.0;

layout(binding = 0) uniform sampler2D plain;
layout(location = 0) flat in uvec2 triangle_origin;
layout(location = 1) in vec2 from_origin;
#if LIT
layout(location = 2) in vec3 normal;
#include "common/light.glsl"
#endif
layout(location = 0) out vec4 colour;

// Not textureSize(plain, level): lavapipe uses the first lane's level for all lanes.
ivec2 level_size(uint level) { return max(textureSize(plain, 0) >> int(level), ivec2(1)); }

// Columns wrap, as in the sampler; rows are clamped.
vec3 texel(ivec2 at, uint level) {
    ivec2 size = level_size(level);
    // The offset keeps the dividend positive: no footprint reaches 16384 texture widths to the west.
    int column = int(uint(at.x + 16384 * size.x) % uint(size.x));
    return texelFetch(plain, ivec2(column, clamp(at.y, 0, size.y - 1)), int(level)).rgb;
}

vec2 centre;  // the pixel's texture coordinate

Spot spot_at(uint level) {
    vec2 at = centre * vec2(level_size(level));
    return Spot(ivec2(floor(at)), at - floor(at));
}

#include "texture_mapping/surface_filter.glsl"

vec4 filtered() {
    vec2 size = vec2(textureSize(plain, 0)), dx = size * dFdxFine(from_origin), dy = size * dFdyFine(from_origin);
    // A helper invocation, beside an edge of the mesh, only gives derivatives. Its own footprint can be unbounded.
    if (gl_HelperInvocation) return vec4(0.0);
    uint coarsest = uint(textureQueryLevels(plain)) - 1;
    vec4 jacobian = vec4(dx.x, dy.x, dx.y, dy.y);
    if (BOUNDS_LIMB == 1) {
        float most = max_major_texels(view.limb / gl_FragCoord.w, size.y), across = sin(3.14159265 * centre.y);
        jacobian = limited(jacobian, most, max(across, 1e-3));
    }
    float det = jacobian.x * jacobian.w - jacobian.y * jacobian.z;
    if (FILTER == ELLIPSE) {
        Ellipse finest = ellipse_of(jacobian, det, float(MAX_ANISOTROPY));
        uint level = ellipse_level(finest, MAX_REACH, coarsest);
        return vec4(ellipse_mean(jacobian, finest, level, level == coarsest, spot_at(level)).colour, 1.0);
    }
    float level = baseline_level(jacobian, det, MAX_REACH, coarsest), part = fract(level);
    uvec3 seed = uvec3(gl_FragCoord.xy, view.noise);
    return vec4(baseline_mean(jacobian, det, MAX_REACH, uint(level), part, coarsest, seed), 1.0);
}

void main() {
    centre = vec2(triangle_origin) * exp2(-32.0) + from_origin;
    if (is_of_paper_3()) colour = filtered(); else colour = texture(plain, centre);
#if LIT
    colour.rgb *= light(normal, view.sun);
#endif
}
