// fathom_bench: every operation against the copy that moves the same bytes, in one run; and the tables that the charts of
// docs/performance.md are made from.
//
// Rounds are interleaved in random order, every run on the next of several frames; a figure is the ratio of medians.
// "copy (control)" is the copy against itself: what it differs from 1 by is what the machine's noise does to the rest.

#include "errors.hpp"
#include "figures.hpp"
#include "form_pairs.hpp"
#include "methods.hpp"
#include "subjects.hpp"
#include "sweeps.hpp"

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <optional>
#include <set>

using namespace fathom;
using namespace fathom::bench;

namespace {

struct Arguments {
    std::string device;
    int width = 0, height = 0; // 0: the table's own
    int rounds = 31;
    int frames = 0; // 0: enough to outgrow a cache of half a gigabyte
    Clock clock = Clock::wall;
    DeviceOptions options;
    std::string table = "operations";
    double megapixels = 64;
    double seconds = 4;
    std::string csv, json;
    std::string only;
};

struct Figure {
    std::vector<double> seconds;
    std::optional<Deviation> error;
    double worst_relative = 0;
};

constexpr const char* help =
    "usage: fathom_bench [--table NAME] [--device WHAT] [--size WxH] [--rounds N] [--frames N] [--only TEXT]\n"
    "                    [--seconds S] [--megapixels N] [--two-float] [--vector width V] [--group N] "
    "[--processor-time]\n"
    "                    [--csv FILE] [--json FILE]\n"
    "  --table operations  every operation, camera and formula on random depths (3840x2160, the default table)\n"
    "          errors      every method against the truth in seven scenes (960x540)\n"
    "          presets     every method's time and memory in a room (1920x1080 and 3840x2160)\n"
    "          pixels      one method of each operation, from 0.1 megapixels on\n"
    "          radius      ssao and dof, radii of 4 to 512 pixels (1920x1080)\n"
    "          forms       kernels that decode depth against those that could do more (3840x2160, and in the cache)\n"
    "  --rounds N   runs of every row (default 31); rows that take long run less often\n"
    "  --seconds S  of a row in all, but for the table of operations (default 4); three runs at least\n"
    "  --megapixels N  the largest image of the table of pixels (default 64)\n"
    "  --frames N   operations: frames to go through in turn; 1 keeps them in the cache (default: 0.5 GB of them)\n"
    "  --only TEXT  only rows with TEXT in their names, and the copies that they are compared with; operations: in "
    "every\n"
    "               round\n"
    "  --processor-time  count the threads' own time, for a machine that others use too\n"
    "  --csv FILE, --json FILE  the table for programs: bench/figures.hpp says what its columns are, form_pairs.hpp of "
    "forms\n";

[[noreturn]] void usage(const std::string& message) {
    std::fprintf(stderr, "fathom_bench: %s\n%s", message.c_str(), help);
    std::exit(2);
}

Arguments parse(int argc, char** argv) {
    Arguments a;
    for (int i = 1; i < argc; ++i) {
        const std::string option = argv[i];
        if (option == "--two-float") {
            a.options.arithmetic = Arithmetic::two_float;
            continue;
        }
        if (option == "--processor-time") {
            a.clock = Clock::processor;
            continue;
        }
        if (option == "--help") {
            std::fputs(help, stdout);
            std::exit(0);
        }
        if (i + 1 == argc)
            usage(option + " needs a value");
        const char* value = argv[++i];
        if (option == "--device")
            a.device = value;
        else if (option == "--size") {
            if (std::sscanf(value, "%dx%d", &a.width, &a.height) != 2)
                usage("--size is WxH");
        } else if (option == "--rounds")
            a.rounds = std::atoi(value);
        else if (option == "--frames")
            a.frames = std::atoi(value);
        else if (option == "--vector width")
            a.options.vector_width = std::atoi(value);
        else if (option == "--group")
            a.options.group_size = std::atoi(value);
        else if (option == "--csv")
            a.csv = value;
        else if (option == "--json")
            a.json = value;
        else if (option == "--table")
            a.table = value;
        else if (option == "--megapixels")
            a.megapixels = std::atof(value);
        else if (option == "--seconds")
            a.seconds = std::atof(value);
        else if (option == "--only")
            a.only = value;
        else
            usage("unknown option " + option);
    }
    const bool own_size = a.width == 0 && a.height == 0;
    if ((!own_size && (a.width < 64 || a.height < 1)) || a.rounds < 1 || a.frames < 0)
        usage("sizes, rounds and frames are positive");
    return a;
}

// Largest error over a sample of pixels, in units in the last place of the exact value and relative to it.
void measure_error(const Subject& subject, const Frames& frames, Figure& figure) {
    const auto width = static_cast<std::size_t>(frames.width()), height = static_cast<std::size_t>(frames.height());
    std::vector<float> stored(width * height), result(width * height);
    frames.stored().download(stored.data());
    frames.result().download(result.data());
    constexpr std::size_t stride = 37;
    std::vector<double> errors;
    for (std::size_t i = 0; i < stored.size(); i += stride) {
        const Quad exact = subject.truth(static_cast<int>(i % width), static_cast<int>(i / width), stored[i]);
        if (!(exact > 0) || exact > 1e38)
            continue;
        const auto magnitude = static_cast<double>(exact);
        const double error = std::abs(static_cast<double>(static_cast<Quad>(result[i]) - exact));
        const double ulp = std::ldexp(1.0, std::ilogb(magnitude) - 23);
        errors.push_back(error / ulp);
        figure.worst_relative = std::max(figure.worst_relative, error / magnitude);
    }
    figure.error = summary("ulp", errors);
}

// Rows with `text` in their names and the floors that they need.
std::vector<Subject> chosen(std::vector<Subject> list, const std::string& text) {
    if (text.empty())
        return list;
    std::set<std::string> names;
    for (const Subject& subject : list) {
        if (subject.name.find(text) != std::string::npos)
            names.insert({subject.name, subject.floor, subject.floor + " (control)"});
    }
    if (names.empty())
        usage("no row has \"" + text + "\" in its name");
    std::erase_if(list, [&](const Subject& subject) { return !names.contains(subject.name); });
    for (Subject& subject : list)
        subject.every = 1;
    return list;
}

// A baseline that does not compute what the library does is no baseline: its row goes.
std::vector<Subject> comparable(std::vector<Subject> list) {
    std::erase_if(list, [](const Subject& subject) {
        if (!subject.comparison)
            return false;
        const Comparison comparison = subject.comparison();
        std::printf("%s: %s%s\n\n", subject.name.c_str(),
                    comparison.same ? "" : "LEFT OUT, not the library's result: ", comparison.figures.c_str());
        return !comparison.same;
    });
    return list;
}

std::map<std::string, Figure> measured(const std::vector<Subject>& list, Frames& frames, const Arguments& a) {
    std::vector<Work> work;
    for (const Subject& subject : list)
        work.push_back({[&frames] { frames.next(); }, subject.run, subject.after, subject.every});
    const auto samples = measured(frames.device(), work, a.rounds, a.clock);
    std::map<std::string, Figure> figures;
    for (std::size_t i = 0; i < list.size(); ++i)
        figures[list[i].name].seconds = samples[i];
    for (const Subject& subject : list) {
        if (!subject.truth)
            continue;
        subject.run();
        frames.device().finish();
        measure_error(subject, frames, figures[subject.name]);
    }
    return figures;
}

// Two digits after the point, or as many as a small number needs.
std::string rounded(double value) {
    char digits[32];
    std::snprintf(digits, sizeof digits, "%.*f", value < 0.1 ? 4 : 2, value);
    return digits;
}

void print_subject(const Subject& subject, std::map<std::string, Figure>& figures, double pixels) {
    const Figure& f = figures[subject.name];
    const double ms = 1e3 * median(f.seconds), floor = 1e3 * median(figures[subject.floor].seconds);
    const double low = 1e3 * quantile(f.seconds, 0.25), high = 1e3 * quantile(f.seconds, 0.75);
    const double speed = (subject.pixels > 0 ? subject.pixels : pixels) / ms * 1e-6;
    std::printf("%-31s %8.3f %7.3f-%7.3f %9s %9s", subject.name.c_str(), ms, low, high, rounded(speed).c_str(),
                rounded(floor / ms).c_str());
    if (f.error)
        std::printf(" %11.3g %10.1e", f.error->worst, f.worst_relative);
    std::printf("\n");
}

void print(const std::vector<Subject>& list, std::map<std::string, Figure>& figures, double pixels) {
    std::printf("%-31s %8s %15s %9s %9s %11s %10s\n", "", "ms", "quartiles", "Gpixel/s", "x floor", "worst ulp",
                "relative");
    for (const Subject& subject : list)
        print_subject(subject, figures, pixels);
    for (const Subject& subject : list) {
        if (figures.contains(subject.rival)) {
            std::printf("\n%s: %.2f times the speed of \"%s\"\n", subject.rival.c_str(),
                        median(figures[subject.name].seconds) / median(figures[subject.rival].seconds),
                        subject.name.c_str());
        }
    }
}

// What a row's name says of it.
Figures described(const Subject& subject, const Frames& frames) {
    const std::string& name = subject.name;
    const std::string word = name.substr(0, name.find_first_of(" ,"));
    const bool formula = subject.truth && word != "linearize";
    const bool own =
        word == "linearize" || word == "unproject" || word == "normals" || word.starts_with("dof") || word == "ssao";
    const bool blur = subject.pixels > 0;
    return {.operation = formula ? "linearize"
                         : own   ? word
                                 : "copy",
            .method = own && name.size() > word.size() ? name.substr(word.size() + 1) : name,
            .kind = formula || !subject.rival.empty() ? "baseline"
                    : own                             ? "library"
                                                      : "floor",
            .storage = name.find("uint16") != std::string::npos ? "uint16" : "float32",
            .scene = blur || word == "ssao" ? "room" : "frames",
            .width = blur ? 1920 : frames.width(),
            .height = blur ? 1080 : frames.height()};
}

std::vector<Figures> rows_of(const std::vector<Subject>& list, std::map<std::string, Figure>& figures,
                             const Frames& frames) {
    std::vector<Figures> rows;
    for (const Subject& subject : list) {
        const Figure& figure = figures[subject.name];
        Figures row = described(subject, frames);
        row.seconds = figure.seconds;
        row.floor = subject.floor;
        row.floor_seconds = median(figures[subject.floor].seconds);
        row.error = figure.error;
        rows.push_back(std::move(row));
    }
    return rows;
}

std::vector<Figures> operations(const Device& device, Arguments a) {
    if (a.width == 0)
        a.width = 3840, a.height = 2160;
    if (a.frames == 0)
        a.frames = std::max(2, static_cast<int>(0.5e9 / (8.0 * a.width * a.height)) + 1);
    Frames frames(device, a.width, a.height, a.frames);
    Baselines plain(device, false), streaming(device, true);
    std::vector<Subject> list = chosen(subjects(frames, plain, streaming), a.only);
    std::printf(
        "%d x %d pixels, %d frames in turn, %d rounds; x floor: speed of the copy that moves the same bytes = 1\n"
        "far/near = %.0e\n\n",
        a.width, a.height, a.frames, a.rounds, bench_far / bench_near);
    list = comparable(std::move(list));
    std::map<std::string, Figure> figures = measured(list, frames, a);
    print(list, figures, 1.0 * a.width * a.height);
    return rows_of(list, figures, frames);
}

std::vector<Figures> charted(const Device& device, const Arguments& a) {
    Baselines plain(device, false);
    const std::vector<Method> list = methods(plain);
    const Effort effort{a.rounds, a.seconds, a.clock, a.only, print_row};
    const auto size_or = [&](int width, int height) {
        return a.width > 0 ? Size{a.width, a.height} : Size{width, height};
    };
    std::vector<Figures> rows;
    if (a.table == "errors") {
        const auto [width, height] = size_or(960, 540);
        rows = errors(device, list, views(width, height), a.only, print_row);
    } else if (a.table == "presets") {
        std::vector<View> rooms;
        if (a.width > 0)
            rooms = {room_view(a.width, a.height)};
        else
            rooms = {room_view(1920, 1080), room_view(3840, 2160)};
        rows = presets(device, list, rooms, effort);
    } else if (a.table == "pixels") {
        rows = pixel_sweep(device, list, a.megapixels, effort);
    } else if (a.table == "radius") {
        rows = radius_sweep(device, list, size_or(1920, 1080), effort);
    } else {
        usage("--table is operations, errors, presets, pixels, radius or forms, not " + a.table);
    }
    return rows;
}

Table made(const Device& device, const Arguments& a) {
    if (a.table == "forms")
        return form_pairs(device, a.width > 0 ? a.width : 3840, a.width > 0 ? a.height : 2160, a.only, a.rounds,
                          a.clock);
    return table_of(device, a.table == "operations" ? operations(device, a) : charted(device, a), a.clock);
}

int run(const Arguments& a) {
    const Device device = Device::open(a.device, a.options);
    std::printf("%s, %s, %d vector width, %s; commit %s\n", device.info().name.c_str(), device.info().platform.c_str(),
                device.options().vector_width, device.options().arithmetic == Arithmetic::fp64 ? "fp64" : "two-float",
                commit().c_str());
    const Table table = made(device, a);
    if (!a.csv.empty())
        table.write_csv(a.csv);
    if (!a.json.empty())
        table.write_json(a.json);
    return 0;
}

} // namespace

int main(int argc, char** argv) {
    const Arguments arguments = parse(argc, argv);
    try {
        return run(arguments);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "fathom_bench: %s\n", error.what());
        return 1;
    }
}
