#pragma once

#include "camera.hpp"
#include "device.hpp"
#include "inputs.hpp"

#include "terminal/messages.hpp"

#include <fathom/io.hpp>
#include <fathom/relative.hpp>

#include <array>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace fathom::cli {

/// An option whose value changes from frame to frame.
struct Animation {
    std::string option; ///< its name: --focus
    std::string file;
    std::map<Frame, std::string> values;
    std::function<void(const std::string&)> give; ///< gives the option a value
};

/// An option that was given, for records of what made a result.
struct Given {
    std::string option;
    std::vector<std::string> values;
    bool is_text = false; ///< or may values be numbers?
};

/// Depth without a unit, see fathom/relative.hpp.
struct RelativeSource {
    std::optional<RelativeOrder> order; ///< none: the depth has a camera
    RelativeOptions options;
    std::optional<std::size_t> picture; ///< which companion of an input gives the size
    std::string color_layer;            ///< of that picture
};

/// What the program prints on stdout about its successes.
enum class Report { line, json, nothing };

/// What every operation on depth images takes.
struct DepthOptions {
    Inputs inputs;
    std::vector<Animation> animations;
    bool interpolate = false; ///< are frames between those of an animation filled?
    CameraOption camera;
    RelativeSource relative; ///< of commands that take it
    std::string output;
    std::string format; ///< extension of the results in a folder, with its dot; empty: .exr
    std::string channel;
    std::string ignore;                         ///< the mask of pixels that do not count, as a companion; empty: none
    std::optional<double> ignore_below;         ///< of its alpha or confidence; none: those do not count that are not 0
    std::optional<std::array<double, 2>> valid; ///< least and greatest distance along the axis of pixels that count
    std::optional<double> png_scale;
    bool append = false; ///< does the first result also hold what its source holds?
    bool half = false;
    std::optional<ExrCompression> compression;
    DeviceOption device;
    Report report = Report::line;
    bool strict = false;    ///< is what is probably wrong an error?
    std::size_t memory = 0; ///< bytes of the images in work, and as many beside them; 0: see FrameOptions
    ProgressKind progress = ProgressKind::automatic;
    bool resume = false; ///< are frames kept that are finished, and does a line beside them say what made them?
    std::string log;     ///< file that the run is told to; empty: none, "-": stdout
    std::string command; ///< its name
    std::function<std::vector<Given>()> given =
        {}; ///< what was asked for; called before an animated option has changed
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

} // namespace fathom::cli
