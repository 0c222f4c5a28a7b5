// A driver's compiler that ends its process: the program goes on with another vector width, whose results have the same bits.
#include "program.hpp"
#include "test_device.hpp"

#include <fathom/device.hpp>

using namespace fathom;
using namespace fathom::test;

namespace {

/// The program where a compiler aborts over options that hold a text. Kernels are compiled anew.
struct Ending {
    Folder folder;
    std::string camera = camera_file(folder);

    Ending() { fs::create_directory(folder / "kernels"); }

    Surroundings over(const std::string& text, const Arguments& program = {}) const {
        return {.before = joined({"env", std::string("OPENCL_LAYERS=") + places::layer, "FATHOM_LAYER_ENDS=" + text,
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

TEST_CASE("compiler: where it ends over a kernel, a line says so, and results have the same bits") {
    const Ending ending;
    const Arguments arguments = ending.linearize(
        {depth_file(ending.folder, "a.png", ramp(48, 32)), depth_file(ending.folder, "b.png", ramp(40, 30))});
    check_done(run(arguments));
    const auto expected = ending.contents();
    REQUIRE(expected.size() == 2);
    for (const std::string& name : ending.folder.results())
        fs::remove(ending.folder / ("out/" + name));

    const Outcome outcome = run(arguments, ending.over(default_width()));
    INFO(outcome.err);
    CHECK(outcome.code == 0);
    CHECK(ending.contents() == expected);
    CHECK(outcome.err.starts_with("fathom: warning: kernels/camera/"));
    CHECK(contains(outcome.err, "(Aborted: LLVM ERROR: of a test); it goes on with a vector width of "));
    CHECK(lines_of(outcome.err) == 1);
}

TEST_CASE("compiler: where it ends with every vector width, one line names kernel, driver and cure") {
    const Ending ending;
    const Outcome outcome =
        run(ending.linearize({depth_file(ending.folder, "a.png", ramp(48, 32))}), ending.over("-DV="));
    INFO(outcome.err);
    CHECK(outcome.code == 3);
    CHECK(ending.folder.results().empty());
    CHECK(outcome.err.starts_with("fathom: kernels/camera/"));
    for (const char* const named : {" cannot be compiled for ", "PoCL ", "choose another device with --device"})
        CHECK(contains(outcome.err, named));
    CHECK(lines_of(outcome.err) == 1);
}

TEST_CASE("compiler: frames that came through a pipe are not lost when it ends") {
    const Ending ending;
    const std::string raw(std::size_t{2} * 32 * 24 * 2, '\5'); // two frames
    write(ending.folder / "frames.raw", raw);
    const auto piped = [&](const Arguments& before) {
        return joined(before, {"sh", "-c", R"(file=$1; shift; "$@" <"$file")", "sh", ending.folder / "frames.raw"});
    };
    const Arguments arguments{"linearize", "-",        "--size",      "32x24", "--depth-format",
                              "gray16le",  "--camera", ending.camera, "-o",    ending.folder / "out/####.exr"};
    const Outcome outcome = run(arguments, {.before = piped(ending.over(default_width()).before)});
    INFO(outcome.err);
    CHECK(outcome.code == 0);
    CHECK(ending.folder.results().size() == 2);
    CHECK(contains(outcome.err, "it goes on with a vector width of "));
}
