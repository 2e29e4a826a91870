#version 460
// variants LIT: 0 1
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "common/view.glsl"

// One plain texture with implicit derivatives: what a surface without a virtual texture shows, and the yardstick for
// one with.
layout(binding = 0) uniform sampler2D plain;
layout(location = 0) flat in uvec2 triangle_origin;
layout(location = 1) in vec2 from_origin;
#if LIT
layout(location = 2) in vec3 normal;
#include "common/light.glsl"
#endif
layout(location = 0) out vec4 colour;

void main() {
    colour = texture(plain, vec2(triangle_origin) * exp2(-32.0) + from_origin);
#if LIT
    colour.rgb *= light(normal, view.sun);
#endif
}
