// The frame's camera, shared by every pass that draws the mesh.
// Positions are double-single world metres (high + low): an f32 alone has a step of 0.5 m at the Earth's radius.
layout(push_constant, scalar) uniform View {
    mat4 eye_to_clip;  // rotation and reversed-Z projection; the eye stands at the origin
    vec3 eye_high;     // metres
    vec3 eye_low;      // metres
    uint level_bias;   // levels added to the stored q where the caches are too small
    uint frame;        // its number; noise changes with it
} view;
