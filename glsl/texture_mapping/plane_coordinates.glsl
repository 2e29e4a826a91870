// Computes a pixel of the plane with the selected variant of `Coordinates` (method.rs). Needs plane.glsl.
#include "texture_mapping/coordinates_row.glsl"

layout(constant_id = 3) const uint COORDINATES = 0;  // the index of the variant of `Coordinates`
const uint ANALYTIC = 0, TEXTBOOK = 1, ROWS = 2, INCREMENTAL = 3;

layout(binding = 3, scalar) readonly buffer Rows { RowConstants of[]; } rows;

vec3 textbook(vec2 at) {
    return vec3(dot(plane.u_row, vec3(at, 1.0)), dot(plane.v_row, vec3(at, 1.0)), dot(plane.w_row, vec3(at, 1.0)));
}

// (u_x, u_y, v_x, v_y) as differences to the coordinates of the right and the lower neighbour.
vec4 differences(vec2 centre, vec3 right, vec3 down) {
    vec2 dx = right.xy / right.z - centre, dy = down.xy / down.z - centre;
    return vec4(dx.x, dy.x, dx.y, dy.y);
}

Pixel pixel_by_coordinates(vec2 place) {
    if (COORDINATES == ANALYTIC) return pixel_at(place);
    vec2 at = place - plane.middle;
    vec3 step_x = vec3(plane.u_row.x, plane.v_row.x, plane.w_row.x);
    vec3 step_y = vec3(plane.u_row.y, plane.v_row.y, plane.w_row.y);
    vec3 terms;
    vec4 jacobian;
    if (COORDINATES == TEXTBOOK) {
        terms = textbook(at);
        jacobian = differences(terms.xy / terms.z, textbook(at + vec2(1, 0)), textbook(at + vec2(0, 1)));
    } else {
        RowConstants row = rows.of[uint(place.y)];
        vec2 n = vec2(floor(place.x));
        terms = fma(step_x, n.xxx, row.start);
        if (COORDINATES == ROWS) {
            jacobian = differences(terms.xy / terms.z, terms + step_x, terms + step_y);
        } else {
            vec2 below = terms.z * (terms.z + vec2(step_x.z, step_y.z));
            jacobian = vec4(row.dx / below.x, fma(row.dy_step, n, row.dy) / below.y).xzyw;
        }
    }
    return Pixel(terms.z > 0.0, terms.xy / terms.z, jacobian, jacobian.x * jacobian.w - jacobian.y * jacobian.z);
}
