#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"

layout(binding = 4) uniform texture2D depth;  // of the finished picture
layout(location = 0) flat in uvec4 face;
layout(location = 1) in vec3 corner;
layout(location = 0) out uvec4 words;  // as in faces.vert; bit 16 of the last word is set at the face's edge

void main() {
    // Discards faces behind nearer surfaces. With reversed Z, the factor 0.999 is a margin of a thousandth of the
    // distance. This is far above the rounding difference between faces.vert and the vertex shader of the picture.
    if (gl_FragCoord.z < 0.999 * texelFetch(depth, ivec2(gl_FragCoord.xy), 0).x) discard;
    vec3 pixels = corner / max(fwidth(corner), vec3(1e-12));
    bool edge = min(pixels.x, min(pixels.y, pixels.z)) < 1.0;
    words = uvec4(face.xyz, face.w | (edge ? 1u << 16 : 0u));
}
