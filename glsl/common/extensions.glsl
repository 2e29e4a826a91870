// Extensions of all our shaders.
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_samplerless_texture_functions : require
#extension GL_KHR_memory_scope_semantics : require

// For words and texels that other invocations change at the same time: a plain load would be a data race.
#define ATOMIC_LOAD(word) atomicLoad(word, gl_ScopeDevice, gl_StorageSemanticsNone, gl_SemanticsRelaxed)
#define IMAGE_ATOMIC_LOAD(image, at) \
    imageAtomicLoad(image, at, gl_ScopeDevice, gl_StorageSemanticsNone, gl_SemanticsRelaxed)
