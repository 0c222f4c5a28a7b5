// fathom_bench: every operation against the copy that moves the same bytes, in one run.
//
// Rounds are interleaved in random order, every run on the next of several frames; a figure is the ratio of medians.
// "copy (control)" is the copy against itself: what it differs from 1 by is what the machine's noise does to the rest.

#include "stopwatch.hpp"
#include "subjects.hpp"

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <map>
#include <numeric>
#include <random>
#include <set>

using namespace fathom;
using namespace fathom::bench;

namespace {

struct Arguments {
    std::string device;
    int width = 3840, height = 2160;
    int rounds = 31;
    int frames = 0; // 0: enough to outgrow a cache of half a gigabyte
    Clock clock = Clock::wall;
    DeviceOptions options;
    std::string csv;
    std::string only;
};

struct Figure {
    std::vector<double> seconds;
    double worst_ulp = -1, worst_relative = -1;
};

constexpr const char* help =
    "usage: fathom_bench [--device WHAT] [--size WxH] [--rounds N] [--frames N] [--only TEXT] [--two-float]\n"
    "                    [--lanes V] [--group N] [--processor-time] [--csv FILE]\n"
    "  --rounds N   runs of every row (default 31); rows that take long run in every fourth or 16th round\n"
    "  --frames N   frames to go through in turn; 1 keeps them in the cache (default: 0.5 GB of them)\n"
    "  --only TEXT  only rows with TEXT in their names, in every round, and the copies that they are compared with\n"
    "  --processor-time  count the threads' own time, for a machine that others use too\n";

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
        else if (option == "--lanes")
            a.options.lanes = std::atoi(value);
        else if (option == "--group")
            a.options.group_size = std::atoi(value);
        else if (option == "--csv")
            a.csv = value;
        else if (option == "--only")
            a.only = value;
        else
            usage("unknown option " + option);
    }
    if (a.width < 64 || a.height < 1 || a.rounds < 1 || a.frames < 0)
        usage("sizes, rounds and frames are positive");
    if (a.frames == 0) {
        const double frame = 8.0 * a.width * a.height;
        a.frames = std::max(2, static_cast<int>(0.5e9 / frame) + 1);
    }
    return a;
}

// Largest error over a sample of pixels, in units in the last place of the exact value and relative to it.
void measure_error(const Subject& subject, const Frames& frames, Figure& figure) {
    const auto width = static_cast<std::size_t>(frames.width()), height = static_cast<std::size_t>(frames.height());
    std::vector<float> stored(width * height), result(width * height);
    frames.stored().download(stored.data());
    frames.result().download(result.data());
    constexpr std::size_t stride = 37;
    for (std::size_t i = 0; i < stored.size(); i += stride) {
        const Quad exact = subject.truth(static_cast<int>(i % width), static_cast<int>(i / width), stored[i]);
        if (!(exact > 0) || exact > 1e38)
            continue;
        const auto magnitude = static_cast<double>(exact);
        const double error = std::abs(static_cast<double>(static_cast<Quad>(result[i]) - exact));
        const double ulp = std::ldexp(1.0, std::ilogb(magnitude) - 23);
        figure.worst_ulp = std::max(figure.worst_ulp, error / ulp);
        figure.worst_relative = std::max(figure.worst_relative, error / magnitude);
    }
}

// Rows with `text` in their names and the floors that they need.
std::vector<Subject> chosen(std::vector<Subject> list, const std::string& text) {
    if (text.empty())
        return list;
    std::set<std::string> names;
    for (const Subject& subject : list) {
        if (subject.name.find(text) != std::string::npos)
            names.insert({subject.name, subject.floor});
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
    std::map<std::string, Figure> figures;
    std::vector<const Subject*> order;
    for (const Subject& subject : list)
        order.push_back(&subject);
    std::mt19937 random(7);
    constexpr int warm_up = 2;
    for (int round = -warm_up; round < a.rounds; ++round) {
        std::shuffle(order.begin(), order.end(), random);
        for (const Subject* subject : order) {
            if (round != -1 && round % subject->every != 0)
                continue;
            frames.next();
            const double time = seconds(a.clock, [&] {
                subject->run();
                frames.device().finish();
            });
            if (round >= 0)
                figures[subject->name].seconds.push_back(time);
            if (subject->after)
                subject->after();
        }
    }
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

void print_row(const Subject& subject, std::map<std::string, Figure>& figures, double pixels, std::FILE* csv) {
    const Figure& f = figures[subject.name];
    const double ms = 1e3 * median(f.seconds), floor = 1e3 * median(figures[subject.floor].seconds);
    const double low = 1e3 * quantile(f.seconds, 0.25), high = 1e3 * quantile(f.seconds, 0.75);
    const double speed = (subject.pixels > 0 ? subject.pixels : pixels) / ms * 1e-6;
    std::printf("%-31s %8.3f %7.3f-%7.3f %9s %9s", subject.name.c_str(), ms, low, high, rounded(speed).c_str(),
                rounded(floor / ms).c_str());
    if (f.worst_ulp >= 0)
        std::printf(" %11.3g %10.1e", f.worst_ulp, f.worst_relative);
    std::printf("\n");
    if (csv) {
        std::fprintf(csv, "\"%s\",%s,%.4f,%.4f,%.4f,%.6g,%.6g,%.4g,%.4g\n", subject.name.c_str(), subject.floor.c_str(),
                     ms, low, high, speed, floor / ms, f.worst_ulp, f.worst_relative);
    }
}

void print(const std::vector<Subject>& list, std::map<std::string, Figure>& figures, double pixels, std::FILE* csv) {
    std::printf("%-31s %8s %15s %9s %9s %11s %10s\n", "", "ms", "quartiles", "Gpixel/s", "x floor", "worst ulp",
                "relative");
    if (csv)
        std::fprintf(csv, "subject,floor,ms,ms_q25,ms_q75,gpixel_per_s,times_floor,worst_ulp,worst_relative\n");
    for (const Subject& subject : list)
        print_row(subject, figures, pixels, csv);
    for (const Subject& subject : list) {
        if (figures.contains(subject.rival)) {
            std::printf("\n%s: %.2f times the speed of \"%s\"\n", subject.rival.c_str(),
                        median(figures[subject.name].seconds) / median(figures[subject.rival].seconds),
                        subject.name.c_str());
        }
    }
}

int run(const Arguments& a) {
    const Device device = Device::open(a.device, a.options);
    Frames frames(device, a.width, a.height, a.frames);
    Baselines plain(device, false), streaming(device, true);
    std::vector<Subject> list = chosen(subjects(frames, plain, streaming), a.only);
    std::printf("%s, %s, %d lanes, %s\n%d x %d pixels, %d frames in turn, %d rounds; x floor: speed of the copy that "
                "moves the same bytes = 1\nfar/near = %.0e\n\n",
                device.info().name.c_str(), device.info().platform.c_str(), device.options().lanes,
                device.options().arithmetic == Arithmetic::fp64 ? "fp64" : "two-float", a.width, a.height, a.frames,
                a.rounds, bench_far / bench_near);
    list = comparable(std::move(list));
    std::map<std::string, Figure> figures = measured(list, frames, a);
    std::FILE* csv = a.csv.empty() ? nullptr : std::fopen(a.csv.c_str(), "w");
    if (!a.csv.empty() && !csv)
        throw Error("cannot write " + a.csv);
    print(list, figures, 1.0 * a.width * a.height, csv);
    if (csv)
        std::fclose(csv);
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
