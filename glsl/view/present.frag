#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"

// Draws the magnifier and one picture, two pictures beside a divider, or the difference of two pictures.
layout(binding = 0) uniform texture2D left;   // sRGB codes, not decoded
layout(binding = 1) uniform texture2D right;
layout(binding = 2) uniform utexture2D words;  // overlay data, written by shown.frag, faces.frag or relief_surface.frag
layout(constant_id = 0) const uint PLAIN = 0;  // 1: one picture without overlay and without magnifier
layout(push_constant, scalar) uniform Present {
    uint split;      // first column of the right picture
    float gain;      // factor of the difference between both pictures; 0: the pictures themselves
    ivec2 magnified; // the pixel in the centre of the magnifier
    ivec2 lens_at;   // first column and row of the magnifier in the window
    uint lens_side;  // in pixels; 0: no magnifier
    uint zoom;       // window pixels per picture pixel
    uint overlay;    // one of the constants below
} present;

const uint NONE = 0;       // the picture alone
const uint LEVELS = 1;     // requested levels as colours, tile edges as lines
const uint SHORTFALL = 2;  // shown level minus requested level
const uint COLLAPSE = 3;   // faces by the level below which they collapse
const uint STEPS = 5;      // steps of each pixel's ray through a relief
const uint MISSES = 4;     // faces by their vertex-cache misses

layout(location = 0) out vec4 colour;  // sRGB codes, as the window's format stores them

// Colour of the divider, which is 1 pixel wide, and of the magnifier's edge.
const vec3 DIVIDER = vec3(1.0, 0.72, 0.1);

// A hue for each level, as in src/view/streamed.rs.
vec3 level_colour(uint level) {
    float hue = 6.0 * fract(float(level) * 0.618034);
    vec3 pure = clamp(abs(mod(hue + vec3(0.0, 4.0, 2.0), 6.0) - 3.0) - 1.0, 0.0, 1.0);
    return 0.9 * mix(vec3(1.0), pure, 0.65);
}

uvec4 word(ivec2 at) { return texelFetch(words, min(at, textureSize(words, 0) - 1), 0); }

vec3 with_grid(vec3 picture, ivec2 at) {
    uvec3 here = word(at).xyz;
    bool edge = here != word(at + ivec2(1, 0)).xyz || here != word(at + ivec2(0, 1)).xyz;
    vec3 hue = level_colour(here.x);
    return edge ? hue : mix(picture, hue, 0.4);
}

// Blue: the requested level is shown. Yellow to red: 1 to 3 levels coarser. Green: finer.
vec3 with_shortfall(vec3 picture, ivec2 at) {
    uvec4 here = word(at);
    int missing = int(here.w) - int(here.x);
    vec3 hue = missing == 0 ? vec3(0.1, 0.2, 0.8)
             : missing < 0  ? vec3(0.1, 0.7, 0.2)
                            : vec3(1.0, 1.0 - min(float(missing), 3.0) / 3.0, 0.0);
    return mix(picture, hue, 0.6);
}

vec3 with_faces(vec3 picture, ivec2 at) {
    uint face = word(at).w, missed = face & 3u;
    float share = float(face >> 8 & 255u) / 255.0;
    vec3 hue = present.overlay == COLLAPSE ? mix(vec3(0.1, 0.3, 1.0), vec3(1.0, 0.2, 0.0), share)
             : missed == 0                 ? vec3(0.0, 0.7, 0.2)
                                           : vec3(1.0, 1.0 - float(missed - 1) / 2.0, 0.0);
    bool edge = (face >> 16 & 1u) == 1;
    return mix(picture, edge ? 0.5 * hue : hue, 0.7);
}

// One step: blue; 16: green; 256 and more: red.
vec3 with_steps(vec3 picture, ivec2 at) {
    float share = clamp(log2(float(max(word(at).x, 1u))) / 8.0, 0.0, 1.0);
    vec3 hue = clamp(vec3(2.0 * share - 1.0, 1.0 - abs(2.0 * share - 1.0), 1.0 - 2.0 * share), 0.0, 1.0);
    return mix(picture, hue, 0.7);
}

vec3 with_overlay(vec3 picture, ivec2 at) {
    if (present.overlay == NONE || word(at).x == 0xffffffffu) return picture;
    return present.overlay == LEVELS      ? with_grid(picture, at)
           : present.overlay == SHORTFALL ? with_shortfall(picture, at)
           : present.overlay == STEPS     ? with_steps(picture, at)
                                          : with_faces(picture, at);
}

vec3 shown(ivec2 at) {
    ivec2 inside = clamp(at, ivec2(0), textureSize(left, 0) - 1);
    if (present.gain > 0.0) {
        vec3 apart = abs(texelFetch(left, inside, 0).rgb - texelFetch(right, inside, 0).rgb);
        return min(apart * present.gain, 1.0);
    }
    if (at.x < int(present.split)) {
        return with_overlay(texelFetch(left, inside, 0).rgb, inside);
    }
    return texelFetch(right, inside, 0).rgb;
}

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    if (PLAIN == 1) {
        // A software device executes all branches below for every pixel. On lavapipe, that takes 63 ms at 1920 x 1080.
        colour = vec4(texelFetch(left, min(at, textureSize(left, 0) - 1), 0).rgb, 1.0);
        return;
    }
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
