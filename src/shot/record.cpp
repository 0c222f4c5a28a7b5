// What makes a result, as one line of JSON.
#include "telling.hpp"

#include "camera_file/file.hpp"
#include "io/replace_files.hpp"
#include "runtime/program.hpp"
#include "runtime/state.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>

namespace fathom::shot {
namespace {

using nlohmann::ordered_json;

// Options that change no result, and those of files, whose sizes and times count.
constexpr const char* left_out[] = {"DEPTH",     "--output",  "--camera",  "--format", "--frames",     "--missing",
                                    "--animate", "--device",  "--threads", "--memory", "--progress",   "--json",
                                    "--quiet",   "--explain", "--resume",  "--log",    "--interpolate"};

// Null where there is no file.
ordered_json state_of(const std::filesystem::path& file) {
    const auto state = io::state_of(file);
    return state ? ordered_json{state->size, state->time} : ordered_json();
}

std::string line_of(ordered_json record, const std::vector<io::FileState>& results) {
    for (const auto& [size, time] : results)
        record["outputs"].push_back({size, time});
    return record.dump(-1, ' ', true, ordered_json::error_handler_t::replace) + '\n';
}

} // namespace

Records::Records(const DepthOptions& options, const Device& device) : options_(options) {
    auto counted = options.given();
    for (const char* option : left_out)
        counted.erase(option);
    for (const Output& output : options.outputs)
        counted.erase(output.option);
    for (const Companion& companion : options.companions)
        counted.erase(companion.option);
    for (const Animation& animation : options.animations)
        counted.erase(animation.option);
    common_ = {{"fathom", FATHOM_VERSION},
               {"kernels", kernels_hash()},
               {"device", device_class(device)},
               {"command", options.command},
               {"options", counted}};
}

ordered_json Records::of(const Job& job) const {
    ordered_json record = common_;
    record["inputs"]["depth"] = state_of(job.input);
    for (std::size_t i = 0; i < job.values.size(); ++i)
        record["values"][options_.animations[i].option] = job.values[i];
    for (std::size_t i = 0; i < job.companions.size(); ++i)
        record["inputs"][options_.companions[i].option] = state_of(job.companions[i]);
    for (const std::filesystem::path& file : options_.camera.files_for(job.read_as()))
        record["inputs"]["camera"].push_back(state_of(file));
    if (job.camera) // a file may hold many, and the name of the depth chooses one
        record["camera"] = io::digest(job.camera->text);
    if (job.range)
        record["range"] = *job.range;
    return record;
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
    return [record, file = record_of(job.outputs.front())](const std::vector<io::FileState>& results) {
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

} // namespace fathom::shot
