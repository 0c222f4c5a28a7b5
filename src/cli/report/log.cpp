// The log of a shot. Runs append to it, so that a frame may have several lines: the last one counts. Of a frame that a
// later run kept, the times and warnings are those of the run that made it.
#include "log.hpp"

#include "camera_file/file.hpp"

#include <algorithm>
#include <iterator>
#include <limits>
#include <string_view>

namespace fathom::cli {
namespace {

namespace fs = std::filesystem;
constexpr const char* run_key = "#run"; // its number, added to each frame

} // namespace

std::string text_of(const Json& object, const char* key) {
    const auto found = object.find(key);
    return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
}

fs::path from_here(const std::string& folder, const std::string& name) {
    const fs::path of_run = fs::path(folder) / name;
    if (name.empty() || !io::is_there(of_run.parent_path()) || io::whole_path(of_run) == io::whole_path(name))
        return name;
    return of_run;
}

const Json* Log::run_of(const Json& frame) const {
    const auto run = frame.find(run_key);
    return run != frame.end() ? &runs_[run->get<std::size_t>()] : nullptr;
}

fs::path Log::place_of(const Json& frame, const char* key) const {
    const Json* run = run_of(frame);
    return from_here(run ? text_of(*run, "folder") : "", text_of(frame, key));
}

void Log::read(const fs::path& file) {
    io::check_readable(file);
    const io::Bytes bytes = io::read_file(file, std::numeric_limits<std::uint64_t>::max());
    std::string_view rest(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    std::size_t good = 0;
    const std::size_t first_run = runs_.size();
    while (!rest.empty()) {
        const std::string_view line = rest.substr(0, rest.find('\n'));
        rest.remove_prefix(std::min(rest.size(), line.size() + 1));
        if (line.find_first_not_of(" \t\r") == line.npos)
            continue;
        Json value = Json::parse(line, nullptr, false);
        if (!value.is_object()) {
            ++unread_;
            continue;
        }
        if (const auto run = value.find("run"); run != value.end() && run->is_object()) {
            runs_.push_back(*run);
            ++good;
        } else if (value.contains("output") || value.contains("input") || value.contains("frame")) {
            value.erase(run_key);
            if (runs_.size() > first_run)
                value[run_key] = runs_.size() - 1;
            add(std::move(value));
            ++good;
        }
    }
    if (good == 0)
        io::refuse(file, "is no log of a run: no line of it says of a run or a frame; give the file of --log");
}

void Log::add(Json frame) {
    const std::string output = text_of(frame, "output");
    const std::string key = output.empty() ? "frame " + frame.value("frame", Json()).dump() + text_of(frame, "input")
                                           : io::whole_path(place_of(frame, "output")).native();
    const auto [at, is_new] = by_output_.try_emplace(key, frames_.size());
    if (is_new) {
        if (!output.empty())
            by_name_.emplace(fs::path(output).filename().native(), frames_.size());
        frames_.push_back(std::move(frame));
        return;
    }
    Json& known = frames_[at->second];
    if (text_of(frame, "status") != "kept" || text_of(known, "status") == "failed")
        known = std::move(frame);
}

const Json* Log::find(const fs::path& output) const {
    if (const auto same = by_output_.find(io::whole_path(output).native()); same != by_output_.end())
        return &frames_[same->second];
    const auto [begin, end] = by_name_.equal_range(output.filename().native());
    if (begin == end || std::next(begin) != end)
        return nullptr;
    const Json& frame = frames_[begin->second];
    return io::is_there(place_of(frame, "output")) ? nullptr : &frame; // it is another shot's, or was moved
}

} // namespace fathom::cli
