// A draw with one vertex for each block of 2^p x 2^p texels of an image (paper 1, sections 2.2 and 2.3).
layout(push_constant, scalar) uniform Blocks {
    uvec2 size;      // of the image, in texels
    uint columns;    // blocks per row
} blocks;
