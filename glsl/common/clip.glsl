// The clip-space position of a vertex. All passes share this function and declare `invariant gl_Position`, because a
// depth test for EQUAL must find the depth that another shader wrote. Needs view.glsl.
vec4 clip_position(vec3 position_high, vec3 position_low) {
    precise vec3 from_eye = (position_high - view.eye_high) + (position_low - view.eye_low);
    return view.eye_to_clip * vec4(from_eye, 1.0);
}
