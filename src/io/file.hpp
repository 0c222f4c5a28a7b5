#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace fathom::io {

using Bytes = std::vector<unsigned char>;

/// Throws `fathom::Error`, one line: the file, then what is wrong with it and what would be right.
[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& what);

/// Images beyond this are taken for damage: 32768 × 32768.
inline constexpr long long most_pixels = 1LL << 30;

/// Refuses a size that no depth image has, before memory is asked for.
void check_size(const std::filesystem::path& file, long long width, long long height);

/// Refuses what cannot be read as a file: missing, a directory, empty, no permission.
void check_readable(const std::filesystem::path& file);

/// The whole file.
Bytes read_file(const std::filesystem::path& file);

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
