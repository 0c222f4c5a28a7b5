// Which files belong to the frames of a report.
#include "entries.hpp"

#include "camera_file/file.hpp"
#include "sequence/frame_pattern.hpp"
#include "shot/plan.hpp"
#include "terminal/exit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

namespace fathom::cli {
namespace {

namespace fs = std::filesystem;

// A file of each entry: by the frames where all have one, and by the order otherwise.
void add_files(std::vector<Entry>& entries, Role role, const Inputs& inputs, const char* option) {
    if (inputs.arguments.empty())
        return;
    const std::vector<Input>& files = inputs.all();
    std::map<Frame, std::string> by_frame;
    for (const Input& file : files)
        if (file.frame)
            by_frame.emplace(*file.frame, file.file);
    const bool framed = by_frame.size() == files.size() &&
                        std::ranges::all_of(entries, [](const Entry& entry) { return entry.frame.has_value(); });
    if (files.size() != entries.size() && !framed)
        throw UsageError(
            fmt::format("{}: stands for {} files, but there are {} results; give one for each, or names with the "
                        "numbers of the frames",
                        option, files.size(), entries.size()));
    std::size_t found = 0;
    for (std::size_t i = 0; i < entries.size(); ++i) {
        const auto same = framed ? by_frame.find(*entries[i].frame) : by_frame.end();
        if (!framed)
            entries[i].files[role] = files[i].file;
        else if (same != by_frame.end())
            entries[i].files[role] = same->second;
        found += !entries[i].files[role].empty();
    }
    if (found == 0 && files.size() == entries.size())
        for (std::size_t i = 0; i < entries.size(); ++i)
            entries[i].files[role] = files[i].file;
    else if (found == 0)
        throw UsageError(fmt::format("{}: has none of the results' frames; check the name", option));
}

// The argument of an option of a logged command.
std::string argument_of(const Json& run, const std::string& option) {
    const auto command = run.find("command");
    if (command == run.end() || !command->is_array())
        return {};
    for (std::size_t i = 0; i < command->size(); ++i) {
        const std::string word = (*command)[i].is_string() ? (*command)[i].get<std::string>() : "";
        if (word == option && i + 1 < command->size() && (*command)[i + 1].is_string())
            return (*command)[i + 1].get<std::string>();
        if (word.starts_with(option + "="))
            return word.substr(option.size() + 1);
    }
    return {};
}

// The file that a logged option such as --color names for a frame, if it is there: a pattern, a folder or a file.
fs::path companion_of(const Json& run, const std::string& option, const Entry& entry) {
    const std::string name = from_here(text_of(run, "folder"), argument_of(run, option)).native();
    if (name.empty())
        return {};
    if (io::is_folder(name))
        return image_like(name, entry.files[depth_role]);
    const auto pattern = sequence::FramePattern::in(name);
    const fs::path file = pattern && entry.frame && !io::is_there(name) ? pattern->name(*entry.frame) : name;
    return io::is_there(file) ? file : fs::path();
}

// Where the log says what a frame was made of: its depth, and the picture that was changed.
void add_logged_files(Entry& entry, const Log& log) {
    const fs::path input = entry.line ? log.place_of(*entry.line, "input") : fs::path();
    if (input.empty() || !io::is_there(input))
        return;
    if (entry.files[depth_role].empty())
        entry.files[depth_role] = input;
    if (const Json* run = log.run_of(*entry.line); run && entry.files[input_role].empty())
        entry.files[input_role] = companion_of(*run, "--color", entry);
    if (entry.files[input_role].empty())
        entry.files[input_role] = input;
}

// The name that all frames of a file's sequence share, without its folder.
std::string shared_name(const fs::path& file) {
    const std::string name = file.filename().native();
    const auto pattern = sequence::FramePattern::of(name);
    return pattern ? pattern->first.text() : name;
}

// Does the log say of a frame why these results do not have it? It may hold runs of other commands, too.
bool is_gap(const std::vector<Entry>& entries, const Json& line, const std::optional<Frame>& frame) {
    const std::string status = text_of(line, "status");
    const std::string output = text_of(line, "output"); // none where the input was not there
    if (status == "left out" || (status == "failed" && output.empty()))
        return std::ranges::none_of(entries, [&](const Entry& entry) { return entry.frame && entry.frame == frame; });
    const std::string name = shared_name(output);
    return status == "failed" &&
           std::ranges::any_of(entries,
                               [&](const Entry& entry) {
                                   return entry.line != &line && shared_name(entry.files[output_role]) == name;
                               }) &&
           std::ranges::none_of(entries, [&](const Entry& entry) { return entry.line == &line; });
}

} // namespace

std::vector<Entry> entries_of(const std::array<Inputs, roles>& named, const Log& log) {
    std::vector<Entry> entries;
    for (const Input& output : named[output_role].all())
        entries.push_back({{output.file}, output.frame, log.find(output.file)});
    std::vector<Entry> gaps;
    for (const Json& line : log.frames()) {
        const auto number = line.find("frame");
        const auto frame =
            number != line.end() && number->is_number_integer() ? std::optional(number->get<Frame>()) : std::nullopt;
        if (is_gap(entries, line, frame))
            gaps.push_back({{}, frame, &line});
    }
    entries.insert(entries.end(), gaps.begin(), gaps.end());
    if (std::ranges::all_of(entries, [](const Entry& entry) { return entry.frame.has_value(); }))
        std::ranges::stable_sort(entries, {}, [](const Entry& entry) { return *entry.frame; });
    add_files(entries, input_role, named[input_role], "--input");
    add_files(entries, depth_role, named[depth_role], "--depth");
    for (Entry& entry : entries) {
        add_logged_files(entry, log);
        if (entry.files[depth_role] == entry.files[input_role])
            entry.files[depth_role].clear(); // would be shown twice
    }
    return entries;
}

} // namespace fathom::cli
