// Constants of a row, computed in f64. The steps of `start` along the row and to the next row are the
// homography's columns.
struct RowConstants {
    vec3 start;     // numerators and denominator at the first pixel's centre
    vec2 dx;        // numerators of du/dx and dv/dx
    vec2 dy;        // numerators of du/dy and dv/dy at the first pixel's centre
    vec2 dy_step;   // step of `dy` along the row
};
