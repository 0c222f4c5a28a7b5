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

bool is_known(const std::string& extension, const std::vector<std::string>& extensions) {
    return std::find(extensions.begin(), extensions.end(), extension) != extensions.end();
}

bool is_folder(const DepthOptions& options, const std::string& target) {
    std::error_code ignored;
    return options.inputs.size() > 1 || target.ends_with('/') || fs::is_directory(target, ignored);
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

void check_target(const DepthOptions& options, const Output& output) {
    const std::vector<std::string>& extensions = output.product.extensions;
    const fs::path out = output.target;
    std::error_code ignored;
    if (out.empty())
        throw UsageError(output.option + ": the name is empty; give a file or a folder");
    if (is_folder(options, output.target)) {
        if (fs::exists(out, ignored) && !fs::is_directory(out, ignored))
            throw UsageError(out.native() + ": is a file; several inputs need a folder");
        if (!fs::exists(out, ignored) && !output.target.ends_with('/') && is_known(extension_of(out), extensions))
            throw UsageError(fmt::format("{}: {} inputs cannot go into one file; give a folder ({}/)", out.native(),
                                         options.inputs.size(), out.native()));
    } else {
        const std::string extension = extension_of(out);
        if (!is_known(extension, extensions))
            throw UsageError(fmt::format("{}: {} is no type of result; it is {} (a folder ends with /)", out.native(),
                                         extension.empty() ? "a name without extension" : extension,
                                         one_of(extensions)));
        if (!options.format.empty() && options.format != extension)
            throw UsageError(out.native() + ": its extension contradicts --format " + options.format.substr(1) +
                             "; leave one of them out");
    }
}

fs::path place(const DepthOptions& options, const Output& output, const fs::path& input) {
    fs::path file = output.target;
    if (is_folder(options, output.target))
        file /= input.stem().native() + (options.format.empty() ? output.product.extensions.front() : options.format);
    const bool exr = extension_of(file) == ".exr" || output.option != "-o";
    if (!exr && options.append)
        throw UsageError(file.native() + ": --append adds channels to an EXR; write .exr");
    if (!exr && (options.half || options.compression))
        throw UsageError(
            fmt::format("{}: {} is for .exr; leave it out", file.native(), options.half ? "--half" : "--compression"));
    if (extension_of(file) == ".png" && !options.png_scale && !output.product.png_scale)
        throw UsageError(file.native() + ": PNG holds 0 to 1 only; give --png-scale or write .exr, .tif or .pfm");
    return file;
}

// The file of a companion. If there is none, the name that it should have: reading that reports the missing file.
fs::path find(const DepthOptions& options, const Companion& companion, const fs::path& input) {
    std::error_code ignored;
    if (companion.source.empty())
        throw UsageError(companion.option + ": the name is empty; give a file or a folder");
    if (!fs::is_directory(companion.source, ignored)) {
        if (options.inputs.size() > 1)
            throw UsageError(
                fmt::format("{}: '{}' is no folder, and {} inputs need one, in which each finds its own name",
                            companion.option, companion.source, options.inputs.size()));
        return companion.source;
    }
    const fs::path named = fs::path(companion.source) / input.stem();
    for (const char* extension : {".exr", ".tif", ".tiff", ".pfm", ".npy", ".png", ".jpg", ".jpeg", ".hdr"})
        if (const fs::path file = named.native() + extension; fs::exists(file, ignored))
            return file;
    return named.native() + ".exr";
}

void refuse_replacing(const DepthOptions& options, const std::vector<Job>& jobs) {
    std::set<std::optional<Identity>> read{identity(options.camera.file)};
    for (const Job& job : jobs) {
        read.insert(identity(job.input));
        for (const fs::path& companion : job.companions)
            read.insert(identity(companion));
    }
    for (const Job& job : jobs)
        for (const fs::path& output : job.outputs)
            if (const auto old = identity(output); old && read.contains(old))
                throw UsageError(output.native() + ": is one of the files to read; write elsewhere");
}

} // namespace

std::vector<fs::path> Job::others() const {
    std::vector<fs::path> files = companions;
    files.insert(files.end(), outputs.begin(), outputs.end());
    return files;
}

std::string extension_of(const std::filesystem::path& file) {
    std::string extension = file.extension().native();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return extension == ".tiff" ? ".tif" : extension == ".jpeg" ? ".jpg" : extension;
}

std::vector<Job> plan(const DepthOptions& options, const std::vector<Output>& outputs,
                      const std::vector<Companion>& companions) {
    for (const Output& output : outputs)
        check_target(options, output);
    std::vector<Job> jobs;
    std::map<fs::path, std::string> taken;
    for (const fs::path input : options.inputs) {
        Job job{.input = input, .companions = {}, .outputs = {}};
        for (const Companion& companion : companions)
            job.companions.push_back(find(options, companion, input));
        for (const Output& output : outputs) {
            const fs::path file = place(options, output, input);
            const std::string what = outputs.size() == 1 ? input.native() : output.option + " of " + input.native();
            const auto [first, is_new] = taken.emplace(resolved(file), what);
            if (!is_new)
                throw UsageError(fmt::format("{}: would be written for {} and for {}; {}", file.native(), first->second,
                                             what, outputs.size() == 1 ? "do them one by one" : "write one elsewhere"));
            job.outputs.push_back(file);
        }
        jobs.push_back(job);
    }
    refuse_replacing(options, jobs);
    return jobs;
}

void prepare_folders(const DepthOptions& options, const std::vector<Output>& outputs, const Job& job) {
    for (std::size_t i = 0; i < outputs.size(); ++i) {
        const fs::path& file = job.outputs[i];
        const fs::path folder = file.parent_path();
        std::error_code error;
        if (folder.empty() || fs::is_directory(folder, error))
            continue;
        if (!is_folder(options, outputs[i].target))
            throw Error(fmt::format("{}: its folder does not exist; create {} first", file.native(), folder.native()));
        fs::create_directories(folder, error);
        if (error)
            throw Error(fmt::format("{}: cannot be made: {}; choose another folder", folder.native(), error.message()));
    }
}

} // namespace fathom::cli
