// Where results go. Everything that can be refused before the first file is read is refused here.
#include "outputs.hpp"

#include "command.hpp"
#include "messages.hpp"

#include <fathom/error.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include <sys/stat.h>

namespace fathom::cli {
namespace {

namespace fs = std::filesystem;

std::string ending_of(const fs::path& file) {
    std::string ending = file.extension().native();
    std::transform(ending.begin(), ending.end(), ending.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return ending == ".tiff" ? ".tif" : ending;
}

bool is_known(const std::string& ending, const std::vector<std::string>& endings) {
    return std::find(endings.begin(), endings.end(), ending) != endings.end();
}

bool is_folder(const DepthOptions& options) {
    std::error_code ignored;
    return options.inputs.size() > 1 || options.output.ends_with('/') || fs::is_directory(options.output, ignored);
}

fs::path resolved(const fs::path& file) {
    std::error_code error;
    const fs::path path = fs::weakly_canonical(file, error);
    return error ? fs::absolute(file).lexically_normal() : path;
}

// A file on disk by whatever path, link or other name; none when it is not there.
using Identity = std::pair<dev_t, ino_t>;
std::optional<Identity> identity(const fs::path& file) {
    struct stat status;
    if (stat(file.c_str(), &status) != 0)
        return std::nullopt;
    return Identity{status.st_dev, status.st_ino};
}

void check_target(const DepthOptions& options, const std::vector<std::string>& endings) {
    const fs::path out = options.output;
    std::error_code ignored;
    if (out.empty())
        throw UsageError("-o: the name is empty; give a file or a folder");
    if (is_folder(options)) {
        if (fs::exists(out, ignored) && !fs::is_directory(out, ignored))
            throw UsageError(out.native() + ": is a file; several inputs need a folder");
        if (!fs::exists(out, ignored) && !options.output.ends_with('/') && is_known(ending_of(out), endings))
            throw UsageError(fmt::format("{}: {} inputs cannot go into one file; give a folder ({}/)", out.native(),
                                         options.inputs.size(), out.native()));
    } else {
        const std::string ending = ending_of(out);
        if (!is_known(ending, endings))
            throw UsageError(fmt::format("{}: {} is no type of result; it is {} (a folder ends with /)", out.native(),
                                         ending.empty() ? "a name without ending" : ending, one_of(endings)));
        if (!options.format.empty() && options.format != ending)
            throw UsageError(out.native() + ": its ending contradicts --format " + options.format.substr(1) +
                             "; leave one of them out");
    }
}

} // namespace

std::vector<Job> plan(const DepthOptions& options, const std::vector<std::string>& endings) {
    check_target(options, endings);
    std::vector<Job> jobs;
    std::map<fs::path, fs::path> taken;
    for (const fs::path input : options.inputs) {
        fs::path output = options.output;
        if (is_folder(options))
            output /= input.stem().native() + (options.format.empty() ? endings.front() : options.format);
        const auto [first, is_new] = taken.emplace(resolved(output), input);
        if (!is_new)
            throw UsageError(fmt::format("{}: would be written for {} and for {}; do them one by one", output.native(),
                                         first->second.native(), input.native()));
        if (ending_of(output) == ".png" && !options.png_scale)
            throw UsageError(output.native() + ": PNG holds 0 to 1 only; give --png-scale or write .exr, .tif or .pfm");
        jobs.push_back({input, output});
    }
    std::set<std::optional<Identity>> inputs{identity(options.camera)};
    for (const Job& job : jobs)
        inputs.insert(identity(job.input));
    for (const Job& job : jobs)
        if (const auto old = identity(job.output); old && inputs.contains(old))
            throw UsageError(job.output.native() + ": is one of the files to read; write elsewhere");
    return jobs;
}

void prepare_folder(const DepthOptions& options, const Job& job) {
    const fs::path folder = job.output.parent_path();
    std::error_code error;
    if (folder.empty() || fs::is_directory(folder, error))
        return;
    if (!is_folder(options))
        throw Error(
            fmt::format("{}: its folder does not exist; create {} first", job.output.native(), folder.native()));
    fs::create_directories(folder, error);
    if (error)
        throw Error(fmt::format("{}: cannot be made: {}; choose another folder", folder.native(), error.message()));
}

} // namespace fathom::cli
