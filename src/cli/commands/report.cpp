// fathom report
#include "camera_file/file.hpp"
#include "cli/command.hpp"
#include "cli/options/depth_options.hpp"
#include "cli/report/data.hpp"
#include "cli/report/page.hpp"
#include "io/replace_files.hpp"
#include "shot/plan.hpp"
#include "terminal/interrupt.hpp"
#include "terminal/messages.hpp"
#include "terminal/progress.hpp"

#include <fathom/error.hpp>
#include <fathom/frames.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <optional>

namespace fathom::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::array all_roles{output_role, input_role, depth_role};
constexpr std::array<const char*, roles> role_names{"output", "input", "depth"};

struct ReportArguments {
    std::array<Inputs, roles> files;
    std::vector<std::string> logs;
    std::string page, channel, title;
    ColorMap map = ColorMap::viridis;
    bool json = false;

    std::string channel_of(Role role) const { return role == output_role ? channel : ""; }
    ColorMap map_of(Role role) const { return role == output_role ? map : ColorMap::viridis; }
};

// All that a page is made of.
struct Shot {
    Log log = {};
    std::vector<Entry> entries = {};
    std::array<std::optional<Layer>, roles> layers = {};
    Room room = {};
};

// What is shown of a frame.
struct Seen {
    std::array<std::optional<Shown>, roles> shown = {};
    std::string fault = {}; // of the first file that cannot be read
};

// The name of all results.
std::string title_of(const ReportArguments& options) {
    if (!options.title.empty())
        return options.title;
    const std::string& first = options.files[output_role].arguments.front();
    std::string name = fs::path(first).filename().native();
    if (name.empty())
        name = fs::path(first).parent_path().filename().native();
    const std::size_t more = options.files[output_role].arguments.size() - 1;
    return more == 0 ? name : fmt::format("{} and {} more", name, more);
}

// The command that made the results: ssao.
std::string command_of(const std::vector<Entry>& entries, const Log& log) {
    for (const Entry& entry : entries)
        if (const Json* run = entry.line ? log.run_of(*entry.line) : nullptr) {
            const auto command = run->find("command");
            return command != run->end() && command->is_array() && command->size() > 1 ? plain_text((*command)[1]) : "";
        }
    return {};
}

void add_unit(Layer& layer, const std::string& command) {
    if ((layer.first.name == "Z" || layer.first.name == "distance") && command == "linearize")
        layer.first.unit = "scene units";
}

// Throws: UsageError where the page would replace a file.
Shot shot_of(const ReportArguments& options) {
    Shot shot;
    for (const std::string& file : options.logs)
        shot.log.read(file);
    shot.entries = entries_of(options.files, shot.log);
    const bool has_lines = std::ranges::any_of(
        shot.entries, [](const Entry& entry) { return entry.line && !entry.files[output_role].empty(); });
    if (!options.logs.empty() && !has_lines)
        complain(fmt::format("warning: {}: has no line of {}; is it the log of another shot?", options.logs.front(),
                             options.files[output_role].all().front().file));
    const auto is_page = [&](const fs::path& file) { return io::is_same(file, options.page); };
    if (std::ranges::any_of(options.logs, is_page) || std::ranges::any_of(shot.entries, [&](const Entry& entry) {
            return std::ranges::any_of(entry.files, is_page);
        }))
        throw UsageError(options.page + ": is one of the files to read; give another name for the page");
    std::size_t layers = 0;
    for (const Role role : all_roles)
        if ((shot.layers[role] = layer_of(shot.entries, role, options.channel_of(role))))
            ++layers;
    stop_if_interrupted();
    shot.room = room_for(shot.entries.size(), layers);
    return shot;
}

Seen seen_of(const ReportArguments& options, const Shot& shot, const Entry& entry) {
    Seen seen;
    const bool has_failed = entry.line && text_of(*entry.line, "status") == "failed";
    for (const Role role : all_roles) {
        const fs::path& file = entry.files[role];
        try {
            if (file.empty())
                continue;
            if (const auto& layer = shot.layers[role])
                seen.shown[role] = shown_of(file, options.channel_of(role), *layer, options.map_of(role), shot.room);
            else // no file could be read
                static_cast<void>(read_viewed(file, options.channel_of(role)));
        } catch (const io::UnansweredRead&) {
            throw;
        } catch (const std::exception& error) {
            if (seen.fault.empty() && !(role != output_role && has_failed)) // of which it is the reason
                seen.fault = error.what();
        }
    }
    return seen;
}

Json frame_json(const Entry& entry, const Seen& seen, Cameras& cameras) {
    fs::path name = entry.files[output_role];
    if (name.empty())
        name = text_of(*entry.line, entry.line->contains("output") ? "output" : "input");
    Json frame{{"name", io::printable(name.filename().native())}};
    if (entry.frame)
        frame["frame"] = *entry.frame;
    for (const Role role : all_roles)
        if (!entry.files[role].empty())
            frame[role_names[role]] = io::printable(entry.files[role].native());
    if (entry.line)
        add_line(frame, *entry.line, cameras);
    if (!seen.fault.empty() && !frame.contains("error"))
        frame["error"] = io::printable(seen.fault);
    for (const Role role : all_roles)
        if (const auto& shown = seen.shown[role]) {
            frame["images"][role_names[role]] = shown->picture;
            frame["stats"][role_names[role]] = statistics_json(*shown);
        }
    return frame;
}

// Why a page would show nothing.
std::string no_picture(const Shot& shot, const std::vector<std::string>& faults) {
    if (!faults.empty())
        return faults.front();
    for (const Entry& entry : shot.entries)
        for (const fs::path& file : entry.files)
            if (!file.empty()) // which failed the first time only
                return file.native() + ": could not be read at first; make the page again";
    return "report: none of the frames has a result, so there is no page";
}

int report(const ReportArguments& options) {
    if (const std::string extension = extension_of(options.page); extension != ".html" && extension != ".htm")
        throw UsageError(options.page + ": the report is a page; give a name that ends with .html");
    catch_interrupts();
    Shot shot = shot_of(options);
    const std::string command = command_of(shot.entries, shot.log);
    Json layers = Json::object(), frames = Json::array(), runs = Json::array();
    for (const Role role : all_roles)
        if (auto& layer = shot.layers[role]) {
            if (role == output_role)
                add_unit(*layer, command);
            layers[role_names[role]] = layer_json(*layer, options.map_of(role));
        }

    Cameras cameras;
    cv::Size size;
    std::vector<std::string> faults;
    Progress progress(ProgressKind::automatic, shot.entries.size(), false);
    const auto add = [&](std::size_t i, const Seen& seen, const std::exception_ptr& failure) {
        if (failure)
            std::rethrow_exception(failure);
        progress.hide();
        frames.push_back(frame_json(shot.entries[i], seen, cameras));
        if (!seen.fault.empty())
            faults.push_back(seen.fault);
        for (const auto& shown : seen.shown)
            if (shown && size.empty())
                size = shown->size;
        progress.advance();
    };
    for_each_frame<Seen>(
        shot.entries.size(),
        {.read = [&](std::size_t i, Seen& seen) { seen = seen_of(options, shot, shot.entries[i]); }, .report = add},
        {.stop = is_interrupted});
    progress.hide();
    stop_if_interrupted();
    if (size.empty())
        throw Error(no_picture(shot, faults));
    std::ranges::for_each(faults, complain);

    for (const Json& run : shot.log.runs())
        runs.push_back(run_json(run));
    const std::string page = page_of({{"title", io::printable(title_of(options))},
                                      {"version", FATHOM_VERSION},
                                      {"command", command},
                                      {"width", size.width},
                                      {"height", size.height},
                                      {"has_log", !options.logs.empty()},
                                      {"unread_lines", shot.log.unread()},
                                      {"runs", runs},
                                      {"layers", layers},
                                      {"marks",
                                       {{"invalid", hex_of(cv::Vec3b(invalid_color.data()))},
                                        {"background", hex_of(cv::Vec3b(background_color.data()))}}},
                                      {"cameras", cameras.texts},
                                      {"frames", frames}});
    const io::NewFile file{options.page, {page.begin(), page.end()}};
    io::replace_files({&file, 1});
    const double megabytes = static_cast<double>(page.size()) / 1e6;
    if (options.json)
        print_json({{"output", options.page},
                    {"frames", shot.entries.size()},
                    {"unreadable", faults.size()},
                    {"unread_lines", shot.log.unread()},
                    {"bytes", page.size()}});
    else
        fmt::print("{}  {} frame{}, {:.1f} MB{}{}\n", io::printable(options.page), shot.entries.size(),
                   shot.entries.size() == 1 ? "" : "s", megabytes,
                   faults.empty() ? "" : fmt::format(", {} not readable", faults.size()),
                   shot.log.unread() > 0 ? fmt::format(", {} of the log's lines not readable", shot.log.unread()) : "");
    return faults.empty() ? done : input_failed;
}

std::function<int()> configure_report(CLI::App& app) {
    auto options = std::make_shared<ReportArguments>();
    add_option(app, "Input", "OUT", "OUT", options->files[output_role].arguments,
               "results: files, a folder, or 'ao.####.exr', 'ao.%04d.exr' or 'ao.*.exr'")
        ->required();
    add_option(app, "Input", "--log", "FILE", options->logs,
               "what --log of the command wrote: inputs, times, warnings, camera");
    add_option(app, "Input", "--input", "IMAGE", options->files[input_role].arguments,
               "images to compare the results with: as OUT (default: those of\nthe log)");
    add_option(app, "Input", "--depth", "DEPTH", options->files[depth_role].arguments,
               "depth images to show beside them (default: those of the log)");
    add_option(app, "Input", "--channel", "NAME", options->channel,
               "EXR channel or layer of the results, as for fathom show");
    add_option(app, "Output", "-o,--output", "PAGE.html", options->page, "page to write")->required();
    add_map_option(app, options->map);
    add_option(app, "Output", "--title", "TEXT", options->title,
               "heading of the page (default: the name of the results)");
    app.add_flag("--json", options->json, "print a line of JSON")->group("Report");
    return [options] { return report(*options); };
}

} // namespace

extern const Command report_command{
    "report", "Writes a page that shows a shot: pictures, depth, times, warnings.",
    R"(The page is one file that needs no network. It has pictures of each frame's input and result with a slider between
them, false colour with legends, histograms, invalid pixels and times over the frames, the command, the camera and
warnings. Without --log it has what the images show.

Example:
  fathom ssao shot.####.exr --camera cam.json -o ao.####.exr --log run.jsonl
  fathom report ao.####.exr --log run.jsonl -o report.html)",
    configure_report};

} // namespace fathom::cli
