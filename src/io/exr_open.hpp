#pragma once

#include <OpenEXR/ImfMultiPartInputFile.h>

#include <cstdint>
#include <filesystem>

namespace fathom::io {

/// The file, once the lengths in its header were compared with its own. Throws: Error, and what OpenEXR does.
Imf::MultiPartInputFile open_exr(const std::filesystem::path& file);

/// Bytes of a file that is there.
std::uint64_t size_of_file(const std::filesystem::path& file);

} // namespace fathom::io
