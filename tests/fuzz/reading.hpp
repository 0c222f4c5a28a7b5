#pragma once

#include "targets.hpp"

#include <fathom/error.hpp>

#include <filesystem>
#include <string>
#include <string_view>

/// What the targets share.
namespace fathom::fuzz {

/// Ends the run: the input has shown a mistake.
void expect(bool good, const std::string& what);

/// A message is one printable line that holds `subject`.
void check_line(std::string_view line, std::string_view subject);

/// A file with this name and content, in a folder of this process that lies in memory.
std::filesystem::path file_with(const std::string& name, Input content);

inline std::string_view text_of(Input input) {
    return {reinterpret_cast<const char*>(input.data()), input.size()};
}

/// The first byte, which chooses among ways to read the rest; 0 of an empty input.
inline unsigned taken_choice(Input& input) {
    const unsigned choice = input.empty() ? 0 : input.front();
    input = input.subspan(input.empty() ? 0 : 1);
    return choice;
}

/// Reads a file, or is refused in a line that names it.
template <typename Read>
void read_or_refuse(const std::filesystem::path& file, const Read& read) {
    try {
        read();
    } catch (const Error& refused) {
        check_line(refused.what(), file.native());
    }
}

} // namespace fathom::fuzz
