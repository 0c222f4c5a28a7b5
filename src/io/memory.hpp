#pragma once

#include <cstddef>
#include <filesystem>

namespace fathom {

/// Bytes of memory that this process may use: those of the machine, or the least limit of its control group and the groups
/// around it, of version 1 and 2, as containers and batch systems set it. A limit that cannot be read or is none does not
/// count. `root`: where /proc and /sys lie; the groups lie in /sys/fs/cgroup, as systemd has them. Source: Linux, "Control Group v2" and
/// cgroups(7).
std::size_t usable_memory(const std::filesystem::path& root = "/");

} // namespace fathom
