#version 460
// variants DUMP: 0 1
#extension GL_GOOGLE_include_directive : require
#include "common/extensions.glsl"
#include "texture_mapping/plane.glsl"
#include "texture_mapping/plane_coordinates.glsl"
#include "texture_mapping/filtered.glsl"
#include "texture_mapping/footprint.glsl"
#include "texture_mapping/weights.glsl"
#include "texture_mapping/ellipse_level.glsl"
#define MAP_BINDING 1
#include "texture_mapping/weight_map.glsl"
#include "texture_mapping/ellipse.glsl"

layout(constant_id = 1) const float MAX_RATIO = 64.0;
layout(constant_id = 2) const float MAX_REACH = 1024.0;

void main() {
    Pixel pixel = pixel_by_coordinates(gl_FragCoord.xy);
    if (!pixel.seen) {
        store(pixel, Filtered(vec3(0.0), 0, 0, false, 0));
        return;
    }
    Ellipse finest = ellipse_of(pixel.jacobian, pixel.det, MAX_RATIO);
    uint level = ellipse_level(finest, MAX_REACH, COARSEST);
    vec2 centre = pixel.centre * power_of_half(level);
    Spot spot = Spot(ivec2(floor(centre)), centre - floor(centre));
    EllipseMean mean = ellipse_mean(pixel.jacobian, finest, level, level == COARSEST, spot);
    store(pixel, Filtered(mean.colour, mean.fetched, level, mean.empty, mean.visited));
}
