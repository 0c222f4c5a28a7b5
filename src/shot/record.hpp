#pragma once

#include "io/replace_files.hpp"
#include "shot/plan.hpp"

#include <fathom/device.hpp>

#include <nlohmann/json.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace fathom::shot {

/// What makes the results of each frame: a line of JSON beside the first of them, with the sizes and times of all files. A frame
/// whose line says what a run finds need not be made again.
class Records {
public:
    /// Options are those of the command line now, before a frame has changed the animated ones.
    Records(const DepthOptions& options, const Device& device);

    /// All that makes the results of a frame, before they are made.
    nlohmann::ordered_json of(const Job& job) const;

    /// Are all results of the frame those that were made of this?
    bool is_finished(const nlohmann::ordered_json& record, const Job& job) const;

    /// The file with the line, of what the results will be.
    io::LastFile file_of(const nlohmann::ordered_json& record, const Job& job) const;

private:
    const DepthOptions& options_;
    nlohmann::ordered_json common_; ///< of all frames
};

/// Where the line of a frame lies whose first result this is: OUT.fathom.json.
std::filesystem::path record_of(const std::filesystem::path& file);

/// A device for records: its name, and its driver's.
std::string device_class(const Device& device);

/// The hash of the text of all kernels.
std::string kernels_hash();

/// Removes temporary files that killed runs left beside these results.
void remove_abandoned(const std::vector<Job>& jobs);

} // namespace fathom::shot
