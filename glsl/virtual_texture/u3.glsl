// U3 as shaders write it.
#ifndef U3_BINDING
#define U3_BINDING 1
#endif

layout(binding = U3_BINDING, scalar) buffer U3 {
    uint count;  // triples that the frame has, also where there is no room for them
    uvec3 triples[];
} u3;

void put(uint at, uvec3 triple) {
    if (at < u3.triples.length()) u3.triples[at] = triple;
}
