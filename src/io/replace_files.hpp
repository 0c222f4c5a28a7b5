#pragma once

#include "camera_file/file.hpp"

#include <span>

namespace fathom::io {

/// What a file is to hold.
struct NewFile {
    std::filesystem::path file;
    Bytes bytes;
};

/// Replaces files' contents, or makes them: whoever looks sees the old file or the new one, never a part. The first takes
/// its place only once all of them lie complete on their disks: whatever goes wrong before (no such folder, no permission,
/// a full disk), the old ones stay and nothing else is left behind.
void replace_files(std::span<const NewFile> files);

} // namespace fathom::io
