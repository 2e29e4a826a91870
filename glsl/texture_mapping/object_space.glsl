// Object-space texturing: object_space/mod.rs has the steps.
layout(push_constant, scalar) uniform ObjectSpace {
    uvec2 size;       // pixels of the picture
    float camera;     // pixels from the eye to the projection plane: z_c
    float spacing;    // pixels between fragments on a rotated polygon
    uint triangles;
    uint capacity;    // fragments
    uint coarsest;    // the level that has one texel
} object;

// Corners in pixels, z towards the eye, the origin in the picture's centre; texture coordinates in texels of level 0.
struct Triangle {
    vec3 corners[3];
    vec2 texels[3];
};

// A triangle rotated parallel to the screen, and the lattice of its fragments. Fragment (i, j) lies at
// (first + (i, j)) * spacing.
struct RotatedTriangle {
    vec4 turn;      // cos a, sin a, cos b, sin b
    float z;        // of the rotated plane, pixels
    ivec2 first;
    ivec2 count;    // columns and rows of the triangle's bounding box; 0: not drawn
    vec3 edges[3];  // linear forms in (i, j, 1), at least 0 inside
    vec3 u;         // linear form in (i, j, 1), texels of the level
    vec3 v;
    uint level;
    vec3 nearness;  // linear form in (X, Y, 1) from the picture's centre: 1 / w
    vec2 range;     // of 1 / w over the corners
};

// w of a point at depth z; positive in front of the eye.
float denominator(float z) { return 1.0 - z / object.camera; }

// Column and row of a fragment.
vec2 lattice(uint place) { return vec2(place & 0xffffu, place >> 16); }
// A linear form in (at, 1); `precise`, so that every stage gets the same value.
float form(vec3 of, vec2 at) {
    precise float sum = of.x * at.x + (of.y * at.y + of.z);
    return sum;
}
