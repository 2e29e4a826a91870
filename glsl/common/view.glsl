// The camera, shared by every pass that draws a shape.
// Positions in the world are double-single metres (high + low), because an f32 has steps of 0.5 m at the Earth's
// radius. An object's positions are in its own axes, relative to its centre. eye_to_clip then also contains the
// object's placement relative to the eye, and eye_high and eye_low are 0.
layout(push_constant, scalar) uniform View {
    mat4 eye_to_clip;  // rotation and reversed-Z projection
    vec3 eye_high;     // metres
    vec3 eye_low;      // metres
    uint level_bias;   // levels added to the stored q: variant.level_bias, or more if the caches are too small
    uint noise;        // seeds the random numbers of stochastic filters
    vec3 sun;          // unit vector to the sun, in the positions' coordinate system; lit shapes only
    float limb;        // on a sphere: pixel width / sphere radius, per metre of clip w; otherwise 0
} view;
