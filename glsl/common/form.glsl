// The forms of a shader that filters a surface: 0 and 2 are unlit, 1 and 3 are lit. In 2 and 3 a weight map replaces
// the Gaussian. Forms, not constants, because a binding that a shader declares must be bound.
#define LIT (FORM & 1)
#define WEIGHT_MAP (FORM >> 1)
