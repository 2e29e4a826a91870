#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"

// The picture in the window: one, or two side by side in the same place, or how far they are apart; a part of it
// enlarged.
layout(binding = 0) uniform texture2D left;   // as bytes
layout(binding = 1) uniform texture2D right;
layout(push_constant, scalar) uniform Present {
    uint split;      // first column of the right picture
    float gain;      // 0: pictures; else their difference times this
    ivec2 magnified; // the pixel in the middle of the magnifier
    ivec2 lens_at;   // first column and row of the magnifier in the window
    uint lens_side;  // pixels; 0: no magnifier
    uint zoom;       // pixels of the window for one of the picture
} present;

layout(location = 0) out vec4 colour;  // sRGB bytes, as the window takes them

// The divider is 2 pixels wide.
const vec3 DIVIDER = vec3(1.0, 0.72, 0.1);

vec3 shown(ivec2 at) {
    ivec2 inside = clamp(at, ivec2(0), textureSize(left, 0) - 1);
    if (present.gain > 0.0) {
        vec3 apart = abs(texelFetch(left, inside, 0).rgb - texelFetch(right, inside, 0).rgb);
        return min(apart * present.gain, 1.0);
    }
    if (at.x < int(present.split)) return texelFetch(left, inside, 0).rgb;
    return texelFetch(right, inside, 0).rgb;
}

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    ivec2 in_lens = at - present.lens_at;
    int side = int(present.lens_side), zoom = int(present.zoom);
    colour.a = 1.0;
    if (all(greaterThanEqual(in_lens, ivec2(0))) && all(lessThan(in_lens, ivec2(side)))) {
        ivec2 from_middle = (in_lens - side / 2) / zoom - ivec2(lessThan(in_lens, ivec2(side / 2)));
        bool edge = any(lessThan(in_lens, ivec2(1))) || any(greaterThanEqual(in_lens, ivec2(side - 1)));
        colour.rgb = edge ? DIVIDER : shown(present.magnified + from_middle);
        return;
    }
    bool divides = present.gain == 0.0 && abs(at.x - int(present.split)) < 1;
    colour.rgb = divides ? DIVIDER : shown(at);
}
