#pragma once

#include "animation.hpp"

#include "shot/inputs.hpp"
#include "terminal/progress.hpp"

#include <fathom/device.hpp>
#include <fathom/import_camera.hpp>
#include <fathom/io.hpp>
#include <fathom/relative.hpp>

#include <CLI/CLI.hpp>

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace fathom::cli {

/// Where the work is done.
struct DeviceOption {
    std::string wanted; ///< cpu, gpu, an index or a part of a name; empty: the default
    int threads = 0;    ///< of a CPU device; 0: as many as it likes

    /// Opens the device, whose operations may take so many bytes beside their images, or 64 MiB if that is more; 0: what is
    /// fastest. The number of threads counts from the first time only, as it does for the driver.
    Device open(std::size_t memory = 0) const;

    /// Do files and the device take turns, so that no more threads work at once? Where they may have all cores, these are the
    /// limit.
    bool takes_turns(const Device& opened) const;

    /// Gives the threads to so many files at once.
    void share_among(std::size_t files) const;
};

/// The camera of the images: a file of any format that Fathom reads, a source of depth by name, both, or the headers
/// of the images.
struct CameraOption {
    std::string file;                                       ///< or the pattern of those of all frames
    std::string preset;                                     ///< NAME, NAME:key=value,... or key=value,...
    std::string image, node;                                ///< which camera of the file
    bool undistorted = false;                               ///< see ImportOptions
    std::function<const std::vector<Input>&()> inputs = {}; ///< whose headers may have cameras
    bool or_relative = false;                               ///< may the command do without?

    bool given() const { return !file.empty() || !preset.empty(); }
    std::string name() const; ///< for messages

    /// Is the camera of each input in its header?
    bool of_headers() const;

    /// Does each frame have a camera file of its own?
    bool is_pattern() const;

    /// Has each input a camera of its own, in its header or in a file?
    bool of_each_input() const { return of_headers() || is_pattern(); }

    /// The camera file of one input. Throws: UsageError where a pattern needs a frame that the input's name does not hold.
    std::string file_for(const Input& input) const;

    /// The files that the camera of one input is read from, without the input's own header.
    std::vector<std::filesystem::path> files_for(const Input& input) const;

    /// The camera of the first input that has one: refuses early what is wrong for all of them.
    /// Throws: UsageError where there is no camera, and Error for a camera that cannot be used. `first_counts`: also where
    /// the disk of an earlier input does not answer, which would have another input's camera stand for all.
    ImportedCamera read() const; ///< of all inputs, the first of which counts
    ImportedCamera read(std::vector<Input> depths, bool first_counts = false) const;

    /// Calls `use` with the camera of the first input that has what it needs, for which it throws no UsageError. Where each
    /// input has a camera of its own, and none can be read, that is told when their turns come.
    /// Throws: what `read` does; the first UsageError of `use` where no camera has what it needs.
    void first_for(const std::function<void(const ImportedCamera&)>& use) const;

    /// The camera of one input, whose values are stored like this.
    ImportedCamera read_for(const Input& depth, Storage storage = Storage::float32) const;
};

/// Depth without a unit, see fathom/relative.hpp.
struct RelativeOptions {
    std::optional<RelativeOrder> order; ///< none: the depth has a camera
    std::optional<double> blur_px;
    std::optional<FocusRange> focus_range;
    std::optional<std::array<double, 2>> range;
    std::optional<std::size_t> picture; ///< which companion of an input gives the size
    std::string color_layer;            ///< of that picture
};

/// What the program prints on stdout about its successes.
enum class Report { line, json, nothing };

/// What every operation on depth images takes.
struct DepthOptions {
    Inputs inputs;
    std::vector<Animation> animations;
    CameraOption camera;
    RelativeOptions relative; ///< of commands that take it
    std::string output;
    std::string format; ///< extension of the results in a folder, with its dot; empty: .exr
    std::string channel;
    std::optional<double> png_scale;
    bool append = false; ///< does the first result also hold what its source holds?
    bool half = false;
    std::optional<ExrCompression> compression;
    DeviceOption device;
    Report report = Report::line;
    bool strict = false;    ///< is what is probably wrong an error?
    std::size_t memory = 0; ///< bytes of the images in work, and as many beside them; 0: see FrameOptions
    ProgressKind progress = ProgressKind::automatic;
    bool resume = false;           ///< are frames kept that are finished, and do results say what made them?
    std::string log;               ///< file that the run is told to; empty: none, "-": stdout
    const CLI::App* app = nullptr; ///< the command, whose options were given
};

/// What an operation makes of a depth image.
struct Product {
    std::vector<std::string> extensions;  ///< types it can be written as, the default first
    std::vector<std::string> channels;    ///< EXR names of its channels
    std::optional<double> png_scale = {}; ///< of values that have a range; none: --png-scale must say it
    double png_offset = 0;
    ImageKind kind = ImageKind::values;
    std::string layer = {}; ///< of appended channels whose names say too little
};

/// Adds the options of `DepthOptions` for what comes out.
void add_depth_options(CLI::App& app, DepthOptions& options, const Product& product);

void add_camera_options(CLI::App& app, CameraOption& camera, const std::string& description);
/// Those options of a camera that choose among the cameras of a file.
void add_import_options(CLI::App& app, CameraOption& camera);
void add_channel_option(CLI::App& app, std::string& channel);
void add_device_options(CLI::App& app, DeviceOption& device);

/// Adds an option whose value is one of a few names.
template <typename Value>
CLI::Option* add_enum_option(CLI::App& app, const std::string& name, Value& value,
                             const std::vector<std::pair<std::string, Value>>& choices, const std::string& description);

/// Adds what a run over many inputs has.
void add_run_options(CLI::App& app, DepthOptions& options);

/// Refuses a value that is none of `names`, listing them.
CLI::Validator is_one_of(const std::vector<std::string>& names);

/// Refuses what is no finite number or is not accepted; `kind` says in words what is: "number above 0".
CLI::Validator is_a_number(const std::string& kind, const std::function<bool(double)>& accepted);

template <typename Value>
CLI::Option* add_enum_option(CLI::App& app, const std::string& name, Value& value,
                             const std::vector<std::pair<std::string, Value>>& choices,
                             const std::string& description) {
    std::vector<std::string> names;
    names.reserve(choices.size());
    for (const auto& choice : choices)
        names.push_back(choice.first);
    const auto choose = [&value, choices](const std::string& text) {
        for (const auto& choice : choices)
            if (choice.first == text)
                value = choice.second;
    };
    return app.add_option_function<std::string>(name, choose, description)
        ->type_name(CLI::detail::join(names, "|"))
        ->check(is_one_of(names));
}

} // namespace fathom::cli
