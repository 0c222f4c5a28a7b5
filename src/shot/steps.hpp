#pragma once

#include "each_depth.hpp"
#include "relative.hpp"

#include "doubts/look.hpp"
#include "io/formats.hpp"
#include "operations/invalid_value.hpp"

#include <fathom/import_camera.hpp>

#include <nlohmann/json.hpp>

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace fathom::cli {

/// Seconds that the steps of an input took. It waits between them, which does not count.
struct Times {
    double read = 0, compute = 0, write = 0;

    double whole() const { return read + compute + write; }
};

/// What the depth holds, for the line about a result and for --json.
struct Held {
    std::string channel, words;
    nlohmann::ordered_json members;
};

/// What was read of an input. The images in it go when the input is computed.
struct ReadInput {
    DepthFile depth{{}, Storage::float32, {}};
    std::optional<InvalidValue> invalid;   ///< of pixels that do not count, if there may be some
    std::optional<RelativeDepth> relative; ///< all but its depth
    ImportedCamera camera;
    Camera seen;                          ///< by the pixels
    std::optional<cv::Size> picture_size; ///< if it is another than the depth's
    std::vector<std::string> channel_doubts;
    std::shared_future<std::vector<std::string>> option_doubts;
};

/// What was found in it. It goes when the input is computed.
struct Examined {
    StoredDepth stored;
    cv::Mat z;     ///< what it decodes to
    cv::Mat small; ///< the depth before it was brought to the picture's size
    Subject subject;
    std::vector<std::string> value_doubts, camera_doubts;
};

/// An input between the steps, and its results until they are written and told.
struct Work {
    Job frame;
    Times times;
    bool loaded = false;
    bool kept = false;             ///< Do the results lie there already?
    nlohmann::ordered_json record; ///< of a run with records
    ReadInput read;
    std::optional<Examined> examined;
    Held held;
    bool doubtful_values = false;
    std::optional<ExrSource> source;
    Windows windows; ///< of the results
    std::vector<Made> results;
    io::Bytes raw = {}; ///< of the result that goes to standard output
};

} // namespace fathom::cli
