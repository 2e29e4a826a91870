// Lambert's cosine under a sun of 0.75, and a sky that lights every place by 0.25.
const float SKY = 0.25;

// Light that a place of this normal gets; both vectors along the same axes.
float light(vec3 normal, vec3 sun) {
    return SKY + (1.0 - SKY) * max(dot(normalize(normal), sun), 0.0);
}
