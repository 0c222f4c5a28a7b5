// Disks that do not answer: a few of the faults of tests/faults/run, which tries all of them. strace injects them.
#include "program.hpp"

#include <fmt/format.h>

using namespace fathom;
using namespace fathom::test;

namespace {

bool cannot_trace() {
    const bool works = std::system("strace -o /dev/null -e inject=getppid:error=EIO true 2>/dev/null") == 0;
    if (!works)
        WARN("skipped: strace is not installed, or cannot trace here");
    return !works;
}

// Lets one call on a file fail at a time, until a run has no more of them. What ends well must be as it is without a fault.
template <typename Check>
void with_each_fault(const std::string& call, const std::string& file, const Arguments& arguments, const Check& check) {
    for (int number = 1;; ++number) {
        const Folder folder;
        const std::string log = folder / "strace.log";
        // Where AddressSanitizer is built in, its search for leaks does not work under strace.
        const Outcome outcome =
            run(arguments, {.before = {"env", "ASAN_OPTIONS=detect_leaks=0", "strace", "-f", "-qq", "-o", log, "-P",
                                       file, "-e", fmt::format("inject={}:error=EIO:when={}", call, number)}});
        INFO(call << ' ' << number << " of " << file << ": " << outcome.err);
        if (content(log).find("(INJECTED)") == std::string::npos) {
            CHECK(number > 1);
            return;
        }
        if (outcome.code != 0) {
            check_refused(outcome, 1, file);
            CHECK(contains(outcome.err, "Input/output error; check the disk"));
        }
        check(outcome);
    }
}

} // namespace

TEST_CASE("disks: inspect names a disk that fails while it looks for a camera", "[slow]") {
    if (cannot_trace())
        return;
    const Folder folder;
    const std::string file = depth_file(folder, "depth.exr"), whole = run({"inspect", file}).out;
    for (const char* call : {"openat", "read"})
        with_each_fault(call, file, {"inspect", file},
                        [&](const Outcome& outcome) { CHECK((outcome.code == 1 || outcome.out == whole)); });
}
