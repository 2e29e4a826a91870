// One vertex for each block of 2^p x 2^p texels of a picture is the whole draw (paper 1, sections 2.2 and 2.3).
layout(push_constant, scalar) uniform Blocks {
    uvec2 size;      // texels of the picture that is cut into blocks
    uint columns;    // blocks in a row
} blocks;
