#include "memory.hpp"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <fstream>
#include <string>

#include <unistd.h>

namespace fs = std::filesystem;

namespace fathom {
namespace {

constexpr std::uint64_t least = 1 << 20; // no process fits into less, so that it is no limit

/// The limit that a file holds, or `most`.
std::uint64_t limit_in(const fs::path& file, std::uint64_t most) {
    std::string word;
    std::ifstream(file) >> word;
    std::uint64_t limit = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), limit);
    const bool is_number = error == std::errc{} && end == word.data() + word.size();
    return is_number && limit >= least ? std::min(limit, most) : most;
}

} // namespace

std::size_t usable_memory(const fs::path& root) {
    std::uint64_t memory =
        static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<std::uint64_t>(sysconf(_SC_PAGE_SIZE));
    std::ifstream groups(root / "proc/self/cgroup"); // 4:memory:/path in version 1 and 0::/path in version 2
    for (std::string line; std::getline(groups, line);) {
        const std::size_t first = line.find(':'), next = line.find(':', first + 1);
        if (first == std::string::npos || next == std::string::npos)
            continue;
        const bool second = line.starts_with("0::");
        const std::string controllers = "," + line.substr(first + 1, next - first - 1) + ",";
        if (!second && controllers.find(",memory,") == std::string::npos)
            continue;
        // A container may see the group's path from outside, and only a group of its own and those in it within.
        const fs::path mounted = root / (second ? "sys/fs/cgroup" : "sys/fs/cgroup/memory");
        std::string group = fs::path(line.substr(next + 1)).relative_path();
        for (std::error_code unknown; !group.empty() && !fs::exists(mounted / group, unknown);)
            group.erase(0, std::min(group.find('/'), group.size() - 1) + 1);
        for (fs::path folder = group;; folder = folder.parent_path()) {
            memory = limit_in(mounted / folder / (second ? "memory.max" : "memory.limit_in_bytes"), memory);
            if (folder.empty())
                break;
        }
    }
    return memory;
}

} // namespace fathom
