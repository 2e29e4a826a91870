// The clip-space position of a vertex. All passes share this function and declare `invariant gl_Position`, because a
// depth test for EQUAL must find the depth that another shader wrote. With `invariant`, Vulkan guarantees equal results
// of equal expressions; `precise` also forbids contractions, for drivers that break this guarantee. Needs view.glsl.
vec4 clip_position(vec3 position_high, vec3 position_low) {
    precise vec3 from_eye = (position_high - view.eye_high) + (position_low - view.eye_low);
    precise vec4 clip = view.eye_to_clip * vec4(from_eye, 1.0);
    return clip;
}
