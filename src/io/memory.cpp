#include "memory.hpp"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <unistd.h>

namespace fs = std::filesystem;

namespace fathom {
namespace {

constexpr std::uint64_t least = 1 << 20; // no process fits into less, so that it is no limit

std::vector<std::string> split(const std::string& text, char separator) {
    std::vector<std::string> parts;
    std::istringstream stream(text);
    for (std::string part; std::getline(stream, part, separator);)
        parts.push_back(part);
    return parts;
}

bool holds(const std::vector<std::string>& parts, const std::string& wanted) {
    return std::ranges::find(parts, wanted) != parts.end();
}

/// A path as mountinfo writes it: blanks and backslashes are three octal figures.
std::string unescaped(const std::string& text) {
    std::string plain;
    for (std::size_t i = 0; i < text.size(); ++i) {
        int code = 0;
        if (text[i] == '\\' && i + 4 <= text.size() &&
            std::from_chars(&text[i + 1], &text[i + 4], code, 8).ptr == &text[i + 4]) {
            plain += static_cast<char>(code);
            i += 3;
        } else {
            plain += text[i];
        }
    }
    return plain;
}

/// The limit that a file holds, or `most`.
std::uint64_t limit_in(const fs::path& file, std::uint64_t most) {
    std::string word;
    std::ifstream(file) >> word;
    std::uint64_t limit = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), limit);
    const bool is_number = error == std::errc{} && end == word.data() + word.size();
    return is_number && limit >= least ? std::min(limit, most) : most;
}

/// The group of this process in the hierarchy of version 2, or in that of version 1 which limits memory.
std::string group_of(const fs::path& root, bool second) {
    std::ifstream groups(root / "proc/self/cgroup"); // 4:memory:/path and 0::/path
    for (std::string line; std::getline(groups, line);) {
        const std::size_t first = line.find(':'), next = line.find(':', first + 1);
        if (first == std::string::npos || next == std::string::npos)
            continue;
        const std::string controllers = line.substr(first + 1, next - first - 1);
        if (second ? line.starts_with("0:") && controllers.empty() : holds(split(controllers, ','), "memory"))
            return line.substr(next + 1);
    }
    return {};
}

} // namespace

std::size_t usable_memory(const fs::path& root) {
    std::uint64_t memory =
        static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<std::uint64_t>(sysconf(_SC_PAGE_SIZE));
    std::ifstream mounts(root / "proc/self/mountinfo");
    for (std::string line; std::getline(mounts, line);) {
        // ID, parent, device, root within the file system, mount point, options ..., "-", type, source, options of the type
        const std::vector<std::string> words = split(line, ' ');
        const auto dash = std::ranges::find(words, "-");
        if (words.end() - dash < 4 || dash - words.begin() < 5)
            continue;
        const bool second = dash[1] == "cgroup2";
        if (!second && (dash[1] != "cgroup" || !holds(split(dash[3], ','), "memory")))
            continue;
        const std::string group = group_of(root, second), top = unescaped(words[3]);
        const fs::path mounted = root / fs::path(unescaped(words[4])).relative_path();
        // A container may see the group's path from outside, and only the group itself within.
        const bool below = top == "/" || group == top || group.starts_with(top + "/");
        fs::path folder = below ? fs::path(top == "/" ? group : group.substr(top.size())).relative_path() : fs::path();
        for (;; folder = folder.parent_path()) {
            memory = limit_in(mounted / folder / (second ? "memory.max" : "memory.limit_in_bytes"), memory);
            if (folder.empty())
                break;
        }
    }
    return memory;
}

} // namespace fathom
