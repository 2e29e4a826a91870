// Linear light that a white surface reflects: sunlight by Lambert's cosine law, plus constant sky light.
layout(constant_id = 40) const float SUN_R = 0.75;
layout(constant_id = 41) const float SUN_G = 0.75;
layout(constant_id = 42) const float SUN_B = 0.75;
layout(constant_id = 43) const float SKY_R = 0.25;
layout(constant_id = 44) const float SKY_G = 0.25;
layout(constant_id = 45) const float SKY_B = 0.25;

// `normal` and `sun` are in the same coordinate system.
vec3 light(vec3 normal, vec3 sun) {
    float cosine = max(dot(normalize(normal), sun), 0.0);
    return vec3(SKY_R, SKY_G, SKY_B) + vec3(SUN_R, SUN_G, SUN_B) * cosine;
}
