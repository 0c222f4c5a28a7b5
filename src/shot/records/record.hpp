#pragma once

#include "io/recorded.hpp"
#include "shot/plan.hpp"

#include <fathom/device.hpp>

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace fathom::cli {

/// What makes the results of each frame. A frame whose results hold a record of just this need not be made again.
class Records {
public:
    /// Options are those of the command line now, before a frame has changed the animated ones.
    Records(const DepthOptions& options, const std::vector<Output>& outputs, const std::vector<Companion>& companions,
            const Device& device);

    /// All that makes the results of a frame: hashes what it reads. `camera` is what is said of it, without its file.
    /// Throws: Error for a file that cannot be read.
    nlohmann::ordered_json of(const Job& job, const std::string& camera) const;

    /// The record as a line of text, with the hashes of the results.
    std::string text(const nlohmann::ordered_json& record, const std::vector<io::Rest>& results) const;

    /// Lie all results of the frame there, whole, and made of this?
    bool is_finished(const nlohmann::ordered_json& record, const Job& job) const;

private:
    const DepthOptions& options_;
    const std::vector<Output>& outputs_;
    const std::vector<Companion>& companions_;
    nlohmann::ordered_json common_; ///< of all frames
};

/// A device for records: its name, and its driver's.
std::string device_class(const Device& device);

/// The hash of the text of all kernels.
std::string kernels_hash();

/// Removes temporary files that killed runs left beside these results.
void remove_abandoned(const std::vector<Job>& jobs);

} // namespace fathom::cli
