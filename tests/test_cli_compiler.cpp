// A driver's compiler that crashes: the program goes on with another vector width, whose results have the same bits.
#include "program.hpp"
#include "test_device.hpp"

#include <fathom/device.hpp>

using namespace fathom;
using namespace fathom::test;

namespace {

/// The program where a compiler aborts over options that hold a text. Kernels are compiled anew.
struct Crashing {
    Folder folder;
    std::string camera = camera_file(folder);

    Crashing() { fs::create_directory(folder / "kernels"); }

    Surroundings over(const std::string& text, const Arguments& program = {}) const {
        return {.before = joined({"env", std::string("OPENCL_LAYERS=") + places::layer, "FATHOM_LAYER_CRASHES=" + text,
                                  "POCL_CACHE_DIR=" + folder / "kernels"},
                                 program)};
    }

    Arguments linearize(const std::vector<std::string>& inputs) const {
        return joined(joined({"linearize"}, inputs), {"--camera", camera, "-o", folder / "out"});
    }

    std::vector<std::string> contents() const {
        std::vector<std::string> all;
        for (const std::string& name : folder.results())
            all.push_back(content(folder / ("out/" + name)));
        return all;
    }
};

std::string default_width() {
    return "-DV=" + std::to_string(test_device().options().vector_width) + " ";
}

std::ptrdiff_t lines_of(const std::string& text) {
    return std::ranges::count(text, '\n');
}

} // namespace

TEST_CASE("compiler: where it crashes on a kernel, a line says so, and results have the same bits") {
    const Crashing crashing;
    const Arguments arguments = crashing.linearize(
        {depth_file(crashing.folder, "a.png", ramp(48, 32)), depth_file(crashing.folder, "b.png", ramp(40, 30))});
    check_done(run(arguments));
    const auto expected = crashing.contents();
    REQUIRE(expected.size() == 2);
    for (const std::string& name : crashing.folder.results())
        fs::remove(crashing.folder / ("out/" + name));

    const std::string when = GENERATE("build", "start");
    fs::remove_all(crashing.folder / "kernels");
    const Outcome outcome = run(arguments, crashing.over(default_width(), {"env", "FATHOM_LAYER_CRASHES_AT=" + when}));
    INFO(when << outcome.err);
    CHECK(outcome.code == 0);
    CHECK(crashing.contents() == expected);
    CHECK(outcome.err.starts_with("fathom: warning: kernels/camera/"));
    CHECK(contains(outcome.err, "(Aborted: LLVM ERROR: of a test); fathom goes on with a vector width of "));
    CHECK(lines_of(outcome.err) == 1);
}

TEST_CASE("compiler: where it crashes at every vector width, one line names kernel, driver and cure") {
    const Crashing crashing;
    const Outcome outcome =
        run(crashing.linearize({depth_file(crashing.folder, "a.png", ramp(48, 32))}), crashing.over("-DV="));
    INFO(outcome.err);
    CHECK(outcome.code == 3);
    CHECK(crashing.folder.results().empty());
    CHECK(outcome.err.starts_with("fathom: kernels/camera/"));
    for (const char* const named : {" cannot be compiled for ", "PoCL ", "choose another device with --device"})
        CHECK(contains(outcome.err, named));
    CHECK(lines_of(outcome.err) == 1);
}

TEST_CASE("compiler: frames that came through a pipe are not lost when it crashes") {
    const Crashing crashing;
    const std::string raw(std::size_t{2} * 32 * 24 * 2, '\5'); // two frames
    write(crashing.folder / "frames.raw", raw);
    const auto piped = [&](const Arguments& before) {
        return joined(before, {"sh", "-c", R"(file=$1; shift; "$@" <"$file")", "sh", crashing.folder / "frames.raw"});
    };
    const Arguments arguments{"linearize", "-",        "--size",        "32x24", "--depth-format",
                              "gray16le",  "--camera", crashing.camera, "-o",    crashing.folder / "out/####.exr"};
    const Outcome outcome = run(arguments, {.before = piped(crashing.over(default_width()).before)});
    INFO(outcome.err);
    CHECK(outcome.code == 0);
    CHECK(crashing.folder.results().size() == 2);
    CHECK(contains(outcome.err, "fathom goes on with a vector width of "));
}
