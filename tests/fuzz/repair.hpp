#pragma once

#include "targets.hpp"

/// What a mutation breaks and a reader looks at first, made right again: check sums, lengths and offsets. Nothing is made
/// longer. The first byte is the target's choice and stays.
namespace fathom::fuzz {

void repair_png(Bytes& input);  ///< lengths and sums of the chunks
void repair_tiff(Bytes& input); ///< the first directory, and where its strips lie
void repair_exr(Bytes& input);  ///< the table of chunks, their places and sizes, of a file of one part

} // namespace fathom::fuzz
