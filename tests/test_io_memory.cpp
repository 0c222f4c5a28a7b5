// What a control group allows, from trees of /proc and /sys as systemd, Docker and Slurm make them.
#include "io_files.hpp"

#include "io/memory.hpp"

#include <fstream>

#include <unistd.h>

using namespace fathom::test;

namespace {

constexpr std::size_t mib = std::size_t{1} << 20;

struct Tree {
    std::string groups;                        ///< /proc/self/cgroup
    std::map<std::string, std::string> files;  ///< below /sys/fs/cgroup
    std::optional<std::size_t> limit_mib = {}; ///< none: the machine's
};

std::size_t memory_of(const Tree& tree) {
    const TempFolder folder;
    const auto put = [&](const fs::path& file, const std::string& text) {
        fs::create_directories((folder.path() / file).parent_path());
        std::ofstream(folder.path() / file) << text;
    };
    if (!tree.groups.empty())
        put("proc/self/cgroup", tree.groups);
    for (const auto& [file, text] : tree.files)
        put("sys/fs/cgroup/" + file, text);
    return fathom::usable_memory(folder.path());
}

} // namespace

TEST_CASE("memory: the least limit of the control group and those around it, of version 1 and 2", "[io]") {
    const std::size_t machine =
        static_cast<std::size_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<std::size_t>(sysconf(_SC_PAGE_SIZE));
    const std::string job = "slurm/uid_0/job_7/memory.", none = "9223372036854771712\n";
    const Tree trees[] = {
        {"", {}},
        {"0::/a/b\n", {{"a/b/memory.max", "67108864\n"}}, 64},
        {"0::/a/b\n", {{"a/b/memory.max", "max\n"}, {"a/memory.max", "33554432\n"}}, 32},
        {"0::/a/b\n", {{"a/b/memory.max", "67108864\n"}, {"a/memory.max", "33554432\n"}}, 32},
        {"0::/a/b\n", {{"a/b/memory.max", "33554432\n"}, {"a/memory.max", "67108864\n"}}, 32},
        {"0::/\n", {{"memory.max", "67108864\n"}}, 64}, // a container's own namespace
        {"0::/../other\n", {{"memory.max", "67108864\n"}}, 64},
        {"0::/a/b\n", {{"a/b/memory.max", "max\n"}}},
        {"0::/a/b\n", {{"a/b/memory.max", "none of your business\n"}}},
        {"0::/a/b\n", {{"a/b/memory.max", "67108864x\n"}}},
        {"0::/a/b\n", {{"a/b/memory.max", "-67108864\n"}}},
        {"0::/a/b\n", {{"a/b/memory.max", "99999999999999999999999\n"}}},
        {"0::/a/b\n", {{"a/b/memory.max", "0\n"}}},
        {"0::/a/b\n", {{"a/b/memory.max", ""}}},
        {"0::/a/b\n", {{"a/b/memory.max/folder", ""}}},
        {"0:/a/b", {{"a/b/memory.max", "67108864\n"}}},
        {"0::/docker/c\n", {{"memory.max", "67108864\n"}}, 64}, // a container that sees its path from outside
        {"0::/docker/c/job\n", {{"memory.max", "67108864\n"}, {"job/memory.max", "33554432\n"}}, 32},
        // Version 1: its word for no limit is a number.
        {"4:memory:/slurm/uid_0/job_7\n", {{"memory/" + job + "limit_in_bytes", "67108864\n"}}, 64},
        {"4:cpu,memory:/slurm/uid_0/job_7\n", {{"memory/" + job + "limit_in_bytes", "67108864\n"}}, 64},
        {"4:memory:/slurm/uid_0/job_7\n",
         {{"memory/" + job + "limit_in_bytes", none}, {"memory/slurm/memory.limit_in_bytes", "33554432\n"}},
         32},
        {"4:memory:/docker/c\n", {{"memory/memory.limit_in_bytes", "67108864\n"}}, 64},
        {"4:memory:/slurm/uid_0/job_7\n", {{"memory/" + job + "limit_in_bytes", none}}},
        {"4:cpu:/slurm/uid_0/job_7\n0::/x\n", {{"memory/" + job + "limit_in_bytes", "67108864\n"}}},
        // Both at once.
        {"4:memory:/v1\n0::/v2\n",
         {{"memory/v1/memory.limit_in_bytes", "67108864\n"}, {"v2/memory.max", "33554432\n"}},
         32},
    };
    for (const Tree& tree : trees) {
        INFO(tree.groups << (tree.files.empty() ? "" : tree.files.begin()->first + " " + tree.files.begin()->second));
        CHECK(memory_of(tree) == (tree.limit_mib ? *tree.limit_mib * mib : machine));
    }
}
