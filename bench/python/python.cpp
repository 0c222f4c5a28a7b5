// fathom_bench_python: what people write in Python for the same purposes beside Fathom's methods, on the same frames, as
// bench/python/baselines.py has it. Distances and OpenCV's axes as in fathom_bench_opencv.

#include "errors.hpp"
#include "sweeps.hpp"
#include "temp_folder.hpp"

#include <fathom/error.hpp>

#include <nlohmann/json.hpp>

#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

using namespace fathom;
using namespace fathom::bench;

namespace {

constexpr int missing = 77; ///< what baselines.py exits with where a package is not there

// Its name in the folder.
std::string name_of(const View& view, bool is_timed) {
    return view.name + std::to_string(view.camera().height) + (is_timed ? "timed" : "");
}

nlohmann::json frame_of(const Device& device, const View& view, bool is_timed, const TempFolder& folder) {
    Case on(device, view, 1);
    const std::string name = name_of(view, is_timed);
    write_raw(folder / (name + ".stored"), images::floats(on.stored().image));
    write_raw(folder / (name + ".z"), images::floats(linearize(on.stored()).image));
    const auto& frustum = *view.subject.frustum;
    return {{"name", name},
            {"width", on.width()},
            {"height", on.height()},
            {"near", static_cast<double>(frustum.near)},
            {"far", static_cast<double>(frustum.far)},
            {"focal", on.camera().projection.matrix(0, 0) * on.width() / 2},
            {"timed", is_timed}};
}

std::string floor_of(const std::string& operation) {
    return operation == "linearize" ? "copy" : "spread";
}

// One that takes its results from the folder.
Method read_back(const std::string& operation, const std::string& name, const nlohmann::json& answer,
                 const TempFolder& folder) {
    const auto kept = std::make_shared<std::vector<float>>();
    return {operation,
            name,
            Method::Kind::python,
            Storage::float32,
            floor_of(operation),
            [kept, operation, name, &answer, &folder](Case& on) {
                const int channels = operation == "linearize" ? 1 : 3;
                for (const auto& row : answer)
                    if (row["operation"] == operation && row["method"] == name &&
                        row["frame"] == name_of(on.view(), false))
                        *kept = read_raw(folder / row["file"].get<std::string>());
                if (kept->size() != static_cast<std::size_t>(channels) * static_cast<std::size_t>(on.width()) *
                                        static_cast<std::size_t>(on.height()))
                    throw Error("Python's " + operation + " by " + name + " has " + std::to_string(kept->size()) +
                                " numbers");
                return Image::from_host(on.device(), Element::f32, kept->data(), {on.width(), on.height(), channels});
            }};
}

// The floors of a view, by name.
std::map<std::string, double> floors_in(const Device& device, Baselines& kernels, const View& view, Effort effort) {
    std::vector<Method> list;
    for (const Method& method : methods(kernels))
        if (method.kind == Method::Kind::floor ||
            (method.name == "fathom" && method.operation != "dof_masks" && method.storage == Storage::float32))
            list.push_back(method);
    std::map<std::string, double> floors;
    for (const Figures& row : presets(device, list, {view}, effort))
        floors[row.floor] = row.floor_seconds;
    return floors;
}

constexpr const char* help =
    "usage: fathom_bench_python [--python PROGRAM] [--size WxH] [--rounds N] [--seconds S]\n"
    "                           [--processor-time] [--csv FILE]\n"
    "NumPy, Numba and Open3D beside Fathom's methods: times at WxH (1920x1080) and 960x540, errors at 960x540.\n"
    "Where Python lacks them it says so, and writes no file. Options as those of fathom_bench.\n";

} // namespace

int main(int argc, char** argv) {
    Comparison asked{.effort = {.report = print_row}};
    std::string program = "python3";
    if (const auto status = asked.read(argc, argv, help, "--python", &program))
        return *status;
    const auto& [effort, width, height, csv] = asked;
    try {
        const std::string script = "'" + program + "' '" FATHOM_PYTHON_BASELINES "' ";
        if (const int status = std::system((script + "--check").c_str()); status != 0) {
            if (!WIFEXITED(status) || WEXITSTATUS(status) != missing)
                std::printf("skipped: %s cannot be run\n", program.c_str());
            return 0;
        }
        const Device device = Device::open("cpu");
        Baselines kernels(device);
        const int error_width = std::min(width, error_size.first), error_height = error_width * height / width;
        const std::vector<View> judged = pinhole_views(error_width, error_height);
        std::vector<View> timed{judged.front()};
        if (width > error_width)
            timed.push_back(pinhole_views(width, height).front());
        const TempFolder folder("fathom-python");
        nlohmann::json request{{"rounds", effort.rounds},
                               {"seconds", effort.seconds},
                               {"processor_time", effort.clock == Clock::processor}};
        for (const View& view : timed)
            request["frames"].push_back(frame_of(device, view, true, folder));
        for (const View& view : judged)
            request["frames"].push_back(frame_of(device, view, false, folder));
        write_text(folder / "request.json", request.dump());
        std::fflush(stdout);
        if (std::system((script + "'" + folder.string() + "'").c_str()) != 0)
            throw Error("Python failed");
        const auto answer = nlohmann::json::parse(read_text(folder / "answer.json"));

        std::vector<Figures> rows;
        std::vector<Method> list;
        std::set<std::pair<std::string, std::string>> known;
        for (const View& view : timed) {
            auto floors = floors_in(device, kernels, view, effort);
            for (const auto& row : answer) {
                const auto operation = row["operation"].get<std::string>(), name = row["method"].get<std::string>();
                if (known.emplace(operation, name).second)
                    list.push_back(read_back(operation, name, answer, folder));
                if (row["frame"] != name_of(view, true))
                    continue;
                rows.push_back({.operation = operation,
                                .method = name,
                                .kind = kind_name(Method::Kind::python),
                                .storage = to_string(Storage::float32),
                                .scene = view.name,
                                .width = view.camera().width,
                                .height = view.camera().height,
                                .seconds = row["seconds"].get<std::vector<double>>(),
                                .floor = floor_of(operation)});
                rows.back().floor_seconds = floors.at(rows.back().floor);
                effort.report(rows.back());
            }
        }
        for (Figures& row : errors(device, list, judged, "", effort.report))
            rows.push_back(std::move(row));
        if (!csv.empty())
            table_of(device, rows, effort.clock).write_csv(csv);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "fathom_bench_python: %s\n", error.what());
        return 1;
    }
    return 0;
}
