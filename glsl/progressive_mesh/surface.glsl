// Constants of an instance, shared by both vertex shaders and the fragment shader.
layout(push_constant, scalar) uniform SurfaceView {
    mat4 object_to_clip;   // from object units, relative to the model's centre; the eye was subtracted in f64
    vec3 sun;              // unit vector towards the sun, along the object's axes
    float wanted_log2;     // log2 of the chosen error (surface/pace.rs) in object units; -1000: no vertex moves
    float band_log2;       // a vertex moves from its birth until the chosen error has fallen by the factor 2^band_log2
} view;
