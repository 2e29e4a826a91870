// The camera, shared by every pass that draws a shape.
// Positions in the world are double-single metres (high + low): an f32 alone has a step of 0.5 m at the Earth's
// radius. Those of an object are relative to its centre; then eye_high and eye_low are 0.
layout(push_constant, scalar) uniform View {
    mat4 eye_to_clip;  // rotation and reversed-Z projection; the eye is at the origin
    vec3 eye_high;     // metres
    vec3 eye_low;      // metres
    uint level_bias;   // levels added to the stored q if the caches are too small
    uint frame;        // frame number; seeds noise
    vec3 sun;          // unit vector to the sun, along the axes of the positions; lit shapes only
    float limb;        // of a sphere: a pixel's side divided by the radius, per metre of clip w; 0 for other shapes
} view;
