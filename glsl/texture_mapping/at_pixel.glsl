// The plane's texture around one pixel, for baselines.glsl. Needs plane.glsl, filtered.glsl and footprint.glsl.
Pixel here;  // set by main
const float ANY_REACH = 1e30;

Spot spot_at(uint level) {
    vec2 centre = here.centre * power_of_half(level);
    return Spot(ivec2(floor(centre)), centre - floor(centre));
}

vec3 trilinear(vec2 offset, float level) {
    return textureLod(texture_of, (here.centre + offset) / float(1u << COARSEST), level).rgb;
}
