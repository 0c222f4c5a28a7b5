#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace fathom::io {

using Bytes = std::vector<unsigned char>;

/// Text that does no harm on a terminal: control characters become spaces, bytes that are no UTF-8 become \xNN.
std::string printable(std::string_view text);

/// Throws `fathom::Error`, one printable line: the file, then what is wrong with it and what would be right.
[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& what);

/// Refuses what cannot be read as a file: missing, a directory, empty, no permission.
void check_readable(const std::filesystem::path& file);

/// The whole file.
Bytes read_file(const std::filesystem::path& file);

} // namespace fathom::io
