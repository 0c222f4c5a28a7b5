#pragma once

#include <nlohmann/json.hpp>

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace fathom::cli {

using Json = nlohmann::ordered_json;

/// What runs said about their frames: the lines of --log.
class Log {
public:
    /// Reads another file. Lines that are no JSON are counted: a run that was killed may leave a part of one.
    /// Throws: Error for a file that cannot be read, or in which no line is of a run or a frame.
    void read(const std::filesystem::path& file);

    const std::vector<Json>& runs() const { return runs_; }
    const std::vector<Json>& frames() const {
        return frames_;
    } ///< one for each output, in the order of their first lines
    std::size_t unread() const { return unread_; }

    /// The frame whose output a file is: the same path, or else the only one of its name. Null where there is none.
    const Json* find(const std::filesystem::path& output) const;

    /// The run that a frame's line stands behind. Null where there is none.
    const Json* run_of(const Json& frame) const;

    /// A file that a frame names, from where the program runs now.
    std::filesystem::path place_of(const Json& frame, const char* key) const;

private:
    void add(Json frame);

    std::vector<Json> runs_, frames_;
    std::map<std::string, std::size_t> by_output_; // whole paths
    std::multimap<std::string, std::size_t> by_name_;
    std::size_t unread_ = 0;
};

/// A name of a run that was started in `folder`, from where the program runs now. If that folder is not there, the name
/// itself.
std::filesystem::path from_here(const std::string& folder, const std::string& name);

/// The text of a key; empty where it has none, or something else.
std::string text_of(const Json& object, const char* key);

} // namespace fathom::cli
