// fathom ... --max-error: what is chosen, what --explain says of it, and what is refused.

#include "rendered_input.hpp"

#include <fathom/cheapest.hpp>
#include <fathom/ssao.hpp>

using namespace fathom;
using namespace fathom::test;

namespace {

// An error that the cheapest method meets, whatever the tables hold.
constexpr double anything = 180;

std::string printed(const char* form, double value) {
    char text[64];
    std::snprintf(text, sizeof text, form, value);
    return text;
}

Arguments asked(const RenderedInput& room, const std::string& operation, const Arguments& more) {
    Arguments arguments{operation, room.input, "--camera", room.camera, "-o", room.folder / "out/result.exr"};
    if (operation == "ssao")
        arguments = joined(arguments, {"--radius", "0.8"});
    if (operation == "dof")
        arguments = joined(arguments, {"--color", room.folder / "picture.exr", "--focus", "5", "--f-stop", "0.1",
                                       "--sensor-mm", "36"});
    return joined(arguments, more);
}

struct Room : RenderedInput {
    Room() : RenderedInput(scene::room(), view) {
        write_image(folder / "picture.exr", cv::Mat(height, width, CV_32FC3, cv::Scalar::all(0.5)),
                    {.channels = {"R", "G", "B"}, .png_scale = {}});
    }
};

} // namespace

TEST_CASE("max-error program: what is chosen is what the library takes, and --explain tells it") {
    const Room room;
    for (const Operation each : {Operation::ssao, Operation::dof, Operation::normals}) {
        const std::string operation = to_string(each);
        INFO(operation);
        const MeasuredMethod expected = cheapest_method(each, room.stored, anything);
        check_done(asked(room, operation, {"--max-error", "180"}));
        const Outcome told = run(asked(room, operation, {"--max-error", "180", "--explain", "--quiet"}));
        INFO(told.err);
        CHECK(told.code == 0);
        CHECK(told.out.empty());
        CHECK(std::count(told.err.begin(), told.err.end(), '\n') == 1);
        for (const std::string& part :
             {room.input, operation + ' ' + expected.method, expected.scene, printed("%.7g", expected.error)})
            CHECK(contains(told.err, part));
    }
    check_done(asked(room, "ssao", {"--max-error", "180"}));
    SsaoOptions options;
    options.sampling = MaxError{anything};
    CHECK(same(channel(room.folder / "out/result.exr", "AO"), to_mat(ssao(room.stored, 0.8, options).visibility)));
}

TEST_CASE("max-error program: refused in one line, with the best, where nothing meets it") {
    const Room room;
    for (const std::string operation : {"ssao", "dof", "normals"}) {
        const Outcome outcome = run(asked(room, operation, {"--max-error", "1e-9"}));
        check_refused(outcome, 1,
                      "--max-error 1e-09 is met by none of the measured methods of " + operation + ": the best, ");
        CHECK(contains(outcome.err, room.input));
    }
}
