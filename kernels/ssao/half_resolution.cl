// What ssao needs for blocks at half resolution, as one program: see camera/decode.cl.

#include "ssao/ssao_blocks.cl"
#include "ssao/ssao_kinds.cl"
#include "ssao/joint_upsample.cl"
