// Constants of a row, from f64. Steps along the row, and to the next one, are the homography's columns.
struct Row {
    vec3 start;     // numerators and denominator at the first pixel's centre
    vec2 dx;        // numerators of du/dx and dv/dx
    vec2 dy;        // numerators of du/dy and dv/dy at the first pixel's centre
    vec2 dy_step;   // and their step along the row
};
