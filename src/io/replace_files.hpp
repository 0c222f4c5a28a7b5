#pragma once

#include "camera_file/file.hpp"

#include <fathom/io.hpp>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <vector>

namespace fathom::io {

/// What a file is to hold.
struct NewFile {
    std::filesystem::path file;
    Bytes bytes;
};

/// What tells a file from another one that takes its place: its size, and when it was written, in the file system's own count.
struct FileState {
    std::uintmax_t size;
    std::filesystem::file_time_type::rep time;
};

/// Nothing where there is no such file.
std::optional<FileState> state_of(const std::filesystem::path& file);

/// Another file beside some, which is made of what these will be.
using LastFile = std::function<NewFile(const std::vector<FileState>&)>;

/// Replaces, in this order, files' contents, or makes them: whoever looks sees the old file or the new one, never a part. The first takes
/// its place only once all of them lie complete on their disks: whatever goes wrong before (no such folder, no permission,
/// a full disk), the old ones stay and nothing else is left behind.
///
/// Until then each content lies beside its file as `.fathom-TARGET-PROCESS-NUMBER.tmp`. `last`: one more file, which takes its place
/// last.
void replace_files(std::span<const NewFile> files, const LastFile& last = {});

/// `write_images`, and one more file in the end.
void write_images_and(const std::vector<ImageFile>& images, const LastFile& last);

} // namespace fathom::io
