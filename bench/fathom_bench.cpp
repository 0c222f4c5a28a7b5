// fathom_bench: every operation against the copy that moves the same bytes, in one run; and the tables that the charts of
// docs/performance.md are made from.
//
// Rounds are interleaved in random order, every run on the next of several frames; a figure is the ratio of medians.
// "copy (control)" is the copy against itself: what it differs from 1 by is what the machine's noise does to the rest.

#include "errors.hpp"
#include "operations.hpp"

#include <cstdio>
#include <cstdlib>
#include <map>

using namespace fathom;
using namespace fathom::bench;

namespace {

struct Arguments {
    std::string device;
    Size size = {0, 0}; // the table's own
    int frames = 0;
    std::string table = "operations", csv = {}, pairs = {};
    double megapixels = 64;
    Effort effort = {.report = print_row};
};

constexpr const char* help =
    "usage: fathom_bench [--table NAME] [--device WHAT] [--size WxH] [--rounds N] [--frames N] [--only TEXT]\n"
    "                    [--seconds S] [--megapixels N] [--processor-time] [--csv FILE] [--pairs FILE]\n"
    "  --table operations  every operation, camera and formula on random depths (3840x2160, the default table)\n"
    "          errors      every method against the truth in seven scenes (960x540)\n"
    "          presets     every method's time and memory in a room (1920x1080, 3840x2160 and 960x540)\n"
    "          pixels      one method of each operation, from 0.1 megapixels on\n"
    "          radius      ssao and dof, radii of 4 to 512 pixels (1920x1080)\n"
    "  --rounds N   runs of every row (default 31); rows that take long run less often\n"
    "  --seconds S  of a row in all, but for the table of operations (default 2); three runs at least\n"
    "  --megapixels N  the largest image of the table of pixels (default 64)\n"
    "  --frames N   operations: frames to go through in turn; 1 keeps them in the cache (default: 0.5 GB of them)\n"
    "  --only TEXT  only rows with TEXT in their names, and the copies that they are compared with; operations: in\n"
    "               every round\n"
    "  --processor-time  count the threads' own time, for a machine that others use too\n"
    "  --pairs FILE errors: each quality beside every other method, as a table\n"
    "  --csv FILE   the table for programs: bench/figures.hpp says what its columns are\n";

[[noreturn]] void usage(const std::string& message) {
    std::fprintf(stderr, "fathom_bench: %s\n%s", message.c_str(), help);
    std::exit(2);
}

Arguments parse(int argc, char** argv) {
    Arguments a;
    const std::map<std::string, std::function<void()>> flags{
        {"--processor-time", [&] { a.effort.clock = Clock::processor; }},
        {"--help", [] { std::exit(std::fputs(help, stdout) < 0); }},
    };
    using Value = const std::string&;
    const std::map<std::string, std::function<void(Value)>> values{
        {"--device", [&](Value v) { a.device = v; }},
        {"--size",
         [&](Value v) {
             if (std::sscanf(v.c_str(), "%dx%d", &a.size.first, &a.size.second) != 2 || a.size.first < 64 ||
                 a.size.second < 1)
                 usage("--size is WxH, at least 64x1");
         }},
        {"--rounds", [&](Value v) { a.effort.rounds = std::stoi(v); }},
        {"--frames", [&](Value v) { a.frames = std::stoi(v); }},
        {"--csv", [&](Value v) { a.csv = v; }},
        {"--pairs", [&](Value v) { a.pairs = v; }},
        {"--table", [&](Value v) { a.table = v; }},
        {"--megapixels", [&](Value v) { a.megapixels = std::stod(v); }},
        {"--seconds", [&](Value v) { a.effort.seconds = std::stod(v); }},
        {"--only", [&](Value v) { a.effort.only = v; }},
    };
    for (int i = 1; i < argc; ++i) {
        const std::string option = argv[i];
        if (const auto flag = flags.find(option); flag != flags.end())
            flag->second();
        else if (const auto value = values.find(option); value == values.end())
            usage("unknown option " + option);
        else if (++i == argc)
            usage(option + " needs a value");
        else
            value->second(argv[i]);
    }
    if (a.effort.rounds < 1 || a.frames < 0)
        usage("rounds and frames are positive");
    return a;
}

std::vector<Figures> made(const Device& device, const Arguments& a) {
    const auto size_or = [&](int width, int height) { return a.size.first > 0 ? a.size : Size{width, height}; };
    if (a.table == "operations")
        return operations(device, size_or(3840, 2160), a.frames, a.effort);
    Baselines kernels(device);
    const std::vector<Method> list = methods(kernels);
    const auto [width, height] = size_or(error_size.first, error_size.second);
    if (a.table == "errors")
        return errors(device, list, views(width, height), a.effort.only, print_row);
    if (a.table == "presets") {
        std::vector<View> rooms{room_view(1920, 1080), room_view(3840, 2160), room_view(width, height)};
        if (a.size.first > 0)
            rooms = {room_view(width, height)};
        return presets(device, list, rooms, a.effort);
    }
    if (a.table == "pixels")
        return pixel_sweep(device, list, a.megapixels, a.effort);
    if (a.table == "radius")
        return radius_sweep(device, list, size_or(1920, 1080), a.effort);
    usage("--table is operations, errors, presets, pixels or radius, not " + a.table);
}

} // namespace

int main(int argc, char** argv) {
    try {
        const Arguments a = parse(argc, argv);
        const Device device = Device::open(a.device);
        std::printf("%s, %s, vector width %d, %s; commit %s\n", device.info().name.c_str(),
                    device.info().platform.c_str(), device.options().vector_width,
                    device.options().arithmetic == Arithmetic::fp64 ? "fp64" : "two-float", commit().c_str());
        const std::vector<Figures> rows = made(device, a);
        if (rows.empty())
            usage("no row has \"" + a.effort.only + "\" in its name");
        if (!a.csv.empty())
            table_of(device, rows, a.effort.clock).write_csv(a.csv);
        if (!a.pairs.empty())
            pairs_of(device, rows).write_csv(a.pairs);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "fathom_bench: %s\n", error.what());
        return 1;
    }
    return 0;
}
