#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace fathom::cli {

/// The XXH3 hash of 128 bits of what all parts together hold, as `xxhsum -H2` prints it.
std::string content_hash(std::span<const std::span<const unsigned char>> parts);

/// That of files, one after the other.
/// Throws: Error for a file that cannot be read.
std::string hash_of_files(const std::vector<std::filesystem::path>& files);

} // namespace fathom::cli
