// Depth and inverse depth from stored depth, as one program: most runs need both, and to load a program takes as long as either
// kernel takes for a large image.

#include "camera/linearize.cl"
#include "camera/inverse_depth.cl"
