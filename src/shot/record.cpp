// What makes a result, as one line of JSON.
#include "record.hpp"

#include "camera_file/file.hpp"
#include "io/replace_files.hpp"
#include "runtime/program.hpp"
#include "runtime/state.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>

namespace fathom::cli {
namespace {

using nlohmann::ordered_json;

// Options that change no result, and those of files, whose sizes and times count.
constexpr const char* left_out[] = {"DEPTH",     "--output",  "--camera",  "--format", "--frames",     "--missing",
                                    "--animate", "--device",  "--threads", "--memory", "--progress",   "--json",
                                    "--quiet",   "--explain", "--resume",  "--log",    "--interpolate"};

std::optional<double> finite_number(std::string_view text) {
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc() && end == text.data() + text.size() && std::isfinite(value) ? std::optional(value)
                                                                                            : std::nullopt;
}

// Numbers as numbers, so that 0.5 and .50 are the same.
ordered_json value_of(const std::string& text) {
    ordered_json numbers = ordered_json::array();
    std::istringstream parts(text);
    for (std::string part; std::getline(parts, part, ',');) {
        const auto number = finite_number(part);
        if (!number)
            return text;
        numbers.push_back(*number);
    }
    return numbers.size() == 1 ? numbers.front() : numbers.empty() ? ordered_json(text) : numbers;
}

// Null where there is no file.
ordered_json json_of(const std::optional<io::FileState>& state) {
    return state ? ordered_json{state->size, state->time} : ordered_json();
}

ordered_json state_of(const std::filesystem::path& file) {
    return json_of(io::state_of(file));
}

ordered_json options_of(const std::vector<Given>& given, const std::set<std::string>& not_counted) {
    ordered_json said = ordered_json::object();
    for (const auto& [option, texts, is_text] : given) {
        if (not_counted.contains(option))
            continue;
        ordered_json values = ordered_json::array();
        for (const std::string& text : texts)
            values.push_back(is_text ? ordered_json(text) : value_of(text)); // names may look like numbers
        said[option] = values.size() == 1 ? values.front() : values;
    }
    return said;
}

} // namespace

Records::Records(const DepthOptions& options, const std::vector<Output>& outputs,
                 const std::vector<Companion>& companions, const Device& device)
    : options_(options), outputs_(outputs), companions_(companions) {
    std::set<std::string> not_counted(std::begin(left_out), std::end(left_out));
    for (const Output& output : outputs)
        not_counted.insert(output.option);
    for (const Companion& companion : companions)
        not_counted.insert(companion.option);
    for (const Animation& animation : options.animations)
        not_counted.insert(animation.option);
    common_ = {{"fathom", FATHOM_VERSION},
               {"kernels", kernels_hash()},
               {"device", device_class(device)},
               {"command", options.command},
               {"options", options_of(options.given(), not_counted)}};
}

ordered_json Records::of(const Job& job, const std::string& camera) const {
    ordered_json values = ordered_json::object(), inputs{{"depth", state_of(job.input)}};
    for (std::size_t i = 0; i < job.values.size(); ++i)
        values[options_.animations[i].option] = value_of(job.values[i]);
    for (std::size_t i = 0; i < companions_.size(); ++i)
        inputs[companions_[i].option] = state_of(job.companions[i]);
    for (const std::filesystem::path& file : options_.camera.files_for(job.read_as()))
        inputs["camera"].push_back(state_of(file));
    if (!camera.empty()) // a file may hold many, and the name of the depth chooses one
        inputs["camera used"] = io::digest(camera);
    if (job.range)
        values["range of the shot"] = *job.range;
    ordered_json record = common_;
    record["values"] = values;
    record["inputs"] = inputs;
    return record;
}

std::string Records::line_of(ordered_json record, const std::vector<io::FileState>& results) const {
    for (std::size_t i = 0; i < outputs_.size(); ++i)
        record["outputs"][outputs_[i].option] = json_of(results[i]);
    return record.dump(-1, ' ', true, ordered_json::error_handler_t::replace) + '\n';
}

bool Records::is_finished(const ordered_json& record, const Job& job) const {
    std::vector<io::FileState> results;
    for (const std::filesystem::path& output : job.outputs) {
        const auto state = io::state_of(output);
        if (!state)
            return false;
        results.push_back(*state);
    }
    std::ifstream stream(record_of(job.outputs.front()), std::ios::binary);
    return std::string{std::istreambuf_iterator<char>(stream), {}} == line_of(record, results);
}

io::LastFile Records::file_of(const ordered_json& record, const Job& job) const {
    return [=, this, file = record_of(job.outputs.front())](const std::vector<io::FileState>& results) {
        const std::string line = line_of(record, results);
        return io::NewFile{file, io::Bytes(line.begin(), line.end())};
    };
}

std::filesystem::path record_of(const std::filesystem::path& file) {
    return file.native() + ".fathom.json";
}

std::string device_class(const Device& device) {
    std::string driver = runtime::ask_driver([&] { return cl::Device(device.id(), true).getInfo<CL_DRIVER_VERSION>(); },
                                             device.info().name, " does not say the version of its driver");
    driver.resize(std::min(driver.size(), driver.find('\0')));
    return fmt::format("{}, {} {}", device.info().name, device.info().platform, driver);
}

std::string kernels_hash() {
    std::string all;
    for (const auto& [name, text] : fathom_kernel_files())
        all.append(name).append(1, '\0').append(text).append(1, '\0');
    return io::digest(all);
}

} // namespace fathom::cli
