// A textured plane (src/paper/texture_mapping/plane.rs): texture coordinates and their derivatives.
layout(push_constant, scalar) uniform PlanePush {
    vec3 u_row;  // u = (u_row . (x, y, 1)) / (w_row . (x, y, 1)), in texels of level 0
    vec3 v_row;
    vec3 w_row;
    // Derivatives times the squared denominator, as (constant, slope): u_x and v_x are linear in y, u_y and v_y in x.
    vec2 u_x;
    vec2 u_y;
    vec2 v_x;
    vec2 v_y;
    float det;  // of the three rows
    vec2 middle;  // the picture's centre, in pixels
    uint frame;  // seeds random numbers
    vec2 low;  // bounds of the plane, in texels
    vec2 high;
} plane;

struct Pixel {
    bool seen;
    vec2 centre;  // texels of level 0
    vec4 jacobian;  // u_x, u_y, v_x, v_y
    float det;  // of the jacobian
};

Pixel pixel_at(vec2 place) {
    vec2 at = place - plane.middle;
    vec3 x = vec3(at, 1.0);
    float w = dot(plane.w_row, x);
    float reciprocal = 1.0 / w;
    vec4 derivatives = vec4(plane.u_x.x + plane.u_x.y * at.y, plane.u_y.x + plane.u_y.y * at.x,
                            plane.v_x.x + plane.v_x.y * at.y, plane.v_y.x + plane.v_y.y * at.x);
    vec2 centre = vec2(dot(plane.u_row, x), dot(plane.v_row, x)) * reciprocal;
    bool inside = all(greaterThanEqual(centre, plane.low)) && all(lessThanEqual(centre, plane.high));
    return Pixel(w > 0.0 && inside, centre, derivatives * (reciprocal * reciprocal),
                 plane.det * (reciprocal * reciprocal * reciprocal));
}
