// fathom report
#include "camera_file/file.hpp"
#include "cli/command.hpp"
#include "cli/options/depth_options.hpp"
#include "cli/report/log.hpp"
#include "cli/report/page.hpp"
#include "cli/show/false_color.hpp"
#include "io/replace_files.hpp"
#include "sequence/frame_pattern.hpp"
#include "shot/inputs.hpp"
#include "shot/outputs.hpp"
#include "terminal/codecs.hpp"
#include "terminal/interrupt.hpp"
#include "terminal/messages.hpp"
#include "terminal/progress.hpp"

#include <fathom/error.hpp>
#include <fathom/frames.hpp>

#include <fmt/format.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>

namespace fathom::cli {
namespace {

namespace fs = std::filesystem;

// What the page shows of a frame.
enum Role : std::size_t { output_role, input_role, depth_role, roles };
constexpr std::array<const char*, roles> role_names{"output", "input", "depth"};

struct ReportArguments {
    Inputs outputs, inputs, depths;
    std::vector<std::string> logs;
    std::string page, channel, title;
    ColorMap map = ColorMap::viridis;
    bool json = false;
};

struct Entry {
    std::array<fs::path, roles> files = {};
    std::optional<Frame> frame = {};
    const Json* line = nullptr; // of the log
};

// How all frames of a role are shown, so that they can be compared.
struct Layer {
    Viewed first = {}; // without its image
    ColorRange range = {};
};

// What becomes of a file.
struct Shown {
    std::string picture; // a data: URI
    Statistics found = {};
    std::vector<std::size_t> histogram = {};
    cv::Size size = {};
};

struct Work {
    std::array<std::optional<Shown>, roles> shown = {};
    std::string fault = {}; // of the first file that cannot be read
};

constexpr int bins = 60;

std::string base64(const std::vector<unsigned char>& bytes) {
    constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t three = 0;
        for (std::size_t k = 0; k < 3; ++k)
            three = three << 8 | (i + k < bytes.size() ? bytes[i + k] : 0u);
        for (std::size_t k = 0; k < 4; ++k)
            text += i + k <= bytes.size() ? digits[three >> (18 - 6 * k) & 63] : '=';
    }
    return text;
}

// Each pixel is the mean of those that it covers.
cv::Mat shrunk(const cv::Mat& picture, int width) {
    if (picture.cols <= width)
        return picture;
    const double height = std::round(picture.rows * static_cast<double>(width) / picture.cols);
    cv::Mat small;
    cv::resize(picture, small, {width, std::max(1, static_cast<int>(height))}, 0, 0, cv::INTER_AREA);
    return small;
}

// The picture of an image, not wider than this. Light is added as light; a color that is invalid stays so in any mean.
cv::Mat small_picture(const Viewed& viewed, const ColorRange& range, ColorMap map, int width) {
    if (viewed.kind != Viewed::Kind::picture || viewed.image.cols <= width)
        return shrunk(false_color(viewed, range, map), width);
    Viewed small = viewed;
    cv::Mat cut = viewed.image.clone();
    for (int y = 0; y < cut.rows; ++y) {
        auto* row = cut.ptr<float>(y);
        std::transform(row, row + cut.cols * cut.channels(), row, [](float value) {
            return std::isfinite(value) ? std::min(value, 1.0f) : std::numeric_limits<float>::quiet_NaN();
        });
    }
    small.image = shrunk(cut, width);
    return false_color(small, range, map);
}

// A JPEG of at most so many bytes, if any quality makes one.
std::string data_uri(const cv::Mat& picture, std::size_t most_bytes) {
    std::vector<unsigned char> bytes;
    cv::Mat smaller = picture;
    for (;;) {
        for (const int quality : {90, 82, 74, 64, 50}) {
            if (!cv::imencode(".jpg", smaller, bytes, {cv::IMWRITE_JPEG_QUALITY, quality}))
                throw Error("OpenCV cannot write a JPEG");
            if (bytes.size() <= most_bytes)
                return "data:image/jpeg;base64," + base64(bytes);
        }
        if (smaller.cols <= 160)
            return "data:image/jpeg;base64," + base64(bytes);
        smaller = shrunk(picture, smaller.cols * 3 / 4);
    }
}

// Width of the pictures, and bytes that each may take: a page of 240 frames stays below 15 MB.
struct Room {
    int width;
    std::size_t bytes_each;
};

Room room_for(std::size_t frames, std::size_t pictures_a_frame) {
    constexpr double page_bytes = 9.6e6, least_bytes = 3000, most_bytes = 120e3; // before base64 adds a third
    const double each = page_bytes / static_cast<double>(frames * pictures_a_frame);
    return {frames <= 24    ? 960
            : frames <= 120 ? 720
                            : 512,
            static_cast<std::size_t>(std::clamp(each, least_bytes, most_bytes))};
}

// ---- Which files belong together.

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
    if (io::is_folder(name)) {
        const fs::path stem = fs::path(name) / entry.files[depth_role].stem();
        for (const char* extension : {".exr", ".png", ".jpg", ".jpeg", ".tif", ".tiff", ".pfm", ".npy", ".hdr"})
            if (fs::path file = stem.native() + extension; io::is_there(file))
                return file;
        return {};
    }
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

// The results, and the frames of the log that have none.
std::vector<Entry> entries_of(const ReportArguments& options, const Log& log) {
    std::vector<Entry> entries;
    for (const Input& output : options.outputs.all())
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
    add_files(entries, input_role, options.inputs, "--input");
    add_files(entries, depth_role, options.depths, "--depth");
    for (Entry& entry : entries) {
        add_logged_files(entry, log);
        if (entry.files[depth_role] == entry.files[input_role])
            entry.files[depth_role].clear(); // would be shown twice
    }
    return entries;
}

bool has_failed(const Entry& entry) {
    return entry.line && text_of(*entry.line, "status") == "failed";
}

// ---- What they show.

std::string channel_of(const ReportArguments& options, Role role) {
    return role == output_role ? options.channel : "";
}

ColorMap map_of(const ReportArguments& options, Role role) {
    return role == output_role ? options.map : ColorMap::viridis;
}

// A disk that does not answer ends the page: one without what lies on it would look as if there were no more.
void check_disk_of(const std::exception_ptr& failure) {
    try {
        if (failure)
            std::rethrow_exception(failure);
    } catch (const io::UnansweredRead&) {
        throw;
    } catch (const std::exception&) { // is told with its frame
    }
}

// The layer of a role, as a few frames all over the shot have it. None where no file can be read.
std::optional<Layer> layer_of(const ReportArguments& options, const std::vector<Entry>& entries, Role role) {
    constexpr std::size_t most = 12;
    std::vector<fs::path> files;
    for (const Entry& entry : entries)
        if (!entry.files[role].empty())
            files.push_back(entry.files[role]);
    const std::size_t count = std::min(most, files.size());
    std::vector<Viewed> viewed(count);
    std::vector<Statistics> found(count);
    for_each_frame<int>(
        count,
        {.read =
             [&](std::size_t i, int&) {
                 const std::size_t place = count == 1 ? 0 : i * (files.size() - 1) / (count - 1);
                 Viewed each = read_viewed(files[place], channel_of(options, role));
                 found[i] = statistics_of(each);
                 each.image.release();
                 viewed[i] = std::move(each);
             },
         .report = [](std::size_t, int&, const std::exception_ptr& failure) { check_disk_of(failure); }},
        {.stop = is_interrupted});
    const auto first = std::ranges::find_if(found, [](const Statistics& each) { return each.pixels > 0; });
    if (first == found.end())
        return std::nullopt;
    Layer layer{viewed[static_cast<std::size_t>(first - found.begin())]};
    Statistics all;
    for (const Statistics& each : found) {
        if (!each.any())
            continue;
        all.least = all.any() ? std::min(all.least, each.least) : each.least;
        all.greatest = all.any() ? std::max(all.greatest, each.greatest) : each.greatest;
        all.sample.insert(all.sample.end(), each.sample.begin(), each.sample.end());
    }
    std::ranges::sort(all.sample);
    layer.range = choose_range(all, layer.first.from_0_to_1);
    return layer;
}

Shown shown_of(const ReportArguments& options, const fs::path& file, Role role, const Layer& layer, const Room& room) {
    const Viewed viewed = read_viewed(file, channel_of(options, role));
    Shown shown{.picture =
                    data_uri(small_picture(viewed, layer.range, map_of(options, role), room.width), room.bytes_each),
                .found = statistics_of(viewed),
                .size = viewed.image.size()};
    if (viewed.kind == Viewed::Kind::values) {
        shown.histogram.resize(bins);
        for (const double value : shown.found.sample)
            ++shown.histogram[static_cast<std::size_t>(std::clamp(layer.range.place(value) * bins, 0.0, bins - 1.0))];
    }
    return shown;
}

// ---- The data of the page.

std::string hex_of(const cv::Vec3b& color) {
    return fmt::format("#{:02x}{:02x}{:02x}", color[2], color[1], color[0]);
}

Json layer_json(const Layer& layer, ColorMap map) {
    constexpr int letters_beside_a_bar = 44, stops = 33;
    Json json{
        {"name", layer.first.name}, {"meaning", meaning_of(layer.first, layer.range)}, {"unit", layer.first.unit}};
    if (layer.first.kind != Viewed::Kind::values)
        return json;
    json["ticks"] = Json::array();
    for (const Tick& tick : ticks_of(layer.range, letters_beside_a_bar))
        json["ticks"].push_back({{"place", tick.place}, {"label", tick.label}});
    for (int i = 0; i < stops; ++i)
        json["colors"].push_back(hex_of(colors_of(map)[static_cast<std::size_t>(i * 255 / (stops - 1))]));
    return json;
}

double rounded(double value) {
    return std::strtod(fmt::format("{:.6g}", value).c_str(), nullptr);
}

Json statistics_json(const Shown& shown) {
    const Statistics& found = shown.found;
    Json json{{"pixels", found.pixels}, {"invalid", found.invalid}};
    if (found.background > 0)
        json["background"] = found.background;
    if (found.any())
        json.update({{"least", rounded(found.least)},
                     {"greatest", rounded(found.greatest)},
                     {"p1", rounded(percentile(found.sample, 0.01))},
                     {"p50", rounded(percentile(found.sample, 0.5))},
                     {"p99", rounded(percentile(found.sample, 0.99))}});
    if (!shown.histogram.empty())
        json["histogram"] = shown.histogram;
    return json;
}

// One word for a shell.
std::string quoted(const std::string& word) {
    constexpr std::string_view plain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789%+,-./:=@_";
    if (!word.empty() && word.find_first_not_of(plain) == word.npos)
        return word;
    std::string text = "'";
    for (const char c : word)
        text += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return text + "'";
}

std::string plain_text(const Json& value) {
    return value.is_string() ? value.get<std::string>() : value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

// A line for each key, and for each row of a matrix.
std::string laid_out(const Json& object) {
    const auto compact = [](const Json& value) { return value.dump(-1, ' ', false, Json::error_handler_t::replace); };
    std::string text;
    for (const auto& [key, value] : object.items()) {
        text += fmt::format("{}\n  {}: ", text.empty() ? "{" : ",", compact(key));
        const bool matrix = value.is_array() && !value.empty() && value.front().is_array();
        for (std::size_t i = 0; matrix && i < value.size(); ++i)
            text += (i > 0 ? ",\n    " : "[\n    ") + compact(value[i]);
        text += matrix ? "]" : compact(value);
    }
    return text.empty() ? "{}" : text + "\n}";
}

Json run_json(const Json& run) {
    std::string command;
    Json facts = Json::object();
    for (const auto& [key, value] : run.items()) {
        if (key == "command" && value.is_array())
            for (const Json& word : value)
                command += (command.empty() ? "" : " ") + quoted(plain_text(word));
        else if (key == "command")
            command = plain_text(value);
        else
            facts[key] = plain_text(value);
    }
    return {{"command", command}, {"facts", facts}};
}

// What the log says of a frame, as far as the page has a place for it.
void add_line(Json& frame, const Json& line, Json& cameras, std::map<std::string, std::size_t>& known) {
    for (const char* key : {"status", "error", "missing"})
        if (const std::string text = text_of(line, key); !text.empty())
            frame[key] = text;
    for (const char* key :
         {"seconds", "read_seconds", "compute_seconds", "write_seconds", "nearest", "farthest", "invalid", "held"})
        if (const auto value = line.find(key); value != line.end() && value->is_number())
            frame[key] = value->is_number_float() ? Json(rounded(value->get<double>())) : *value;
    if (const auto warnings = line.find("warnings"); warnings != line.end() && warnings->is_array())
        for (const Json& warning : *warnings)
            frame["warnings"].push_back(plain_text(warning));
    if (const auto camera = line.find("camera"); camera != line.end() && camera->is_object()) {
        const std::string text = laid_out(*camera);
        const auto [at, is_new] = known.try_emplace(text, cameras.size());
        if (is_new)
            cameras.push_back(text);
        frame["camera"] = at->second;
    }
}

// The name of all results.
std::string title_of(const ReportArguments& options) {
    if (!options.title.empty())
        return options.title;
    const std::string& first = options.outputs.arguments.front();
    std::string name = fs::path(first).filename().native();
    if (name.empty())
        name = fs::path(first).parent_path().filename().native();
    const std::size_t more = options.outputs.arguments.size() - 1;
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
    if (layer.first.name == "Z" && command == "linearize")
        layer.first.unit = "scene units";
}

int report(const ReportArguments& options) {
    if (const std::string extension = extension_of(options.page); extension != ".html" && extension != ".htm")
        throw UsageError(options.page + ": the report is a page; give a name that ends with .html");
    catch_interrupts();
    Log log;
    for (const std::string& file : options.logs)
        log.read(file);
    const std::vector<Entry> entries = entries_of(options, log);
    const bool has_lines = std::ranges::any_of(
        entries, [](const Entry& entry) { return entry.line && !entry.files[output_role].empty(); });
    if (!options.logs.empty() && !has_lines)
        complain(fmt::format("warning: {}: has no line of {}; is it the log of another shot?", options.logs.front(),
                             options.outputs.all().front().file));
    const auto is_page = [&](const fs::path& file) { return io::is_same(file, options.page); };
    if (std::ranges::any_of(options.logs, is_page) ||
        std::ranges::any_of(entries, [&](const Entry& entry) { return std::ranges::any_of(entry.files, is_page); }))
        throw UsageError(options.page + ": is one of the files to read; give another name for the page");
    const std::string command = command_of(entries, log);

    Json layers = Json::object();
    std::array<std::optional<Layer>, roles> shown_as;
    for (const Role role : {output_role, input_role, depth_role})
        if ((shown_as[role] = layer_of(options, entries, role))) {
            if (role == output_role)
                add_unit(*shown_as[role], command);
            layers[role_names[role]] = layer_json(*shown_as[role], map_of(options, role));
        }
    stop_if_interrupted();
    const Room room = room_for(entries.size(), layers.size());

    Json frames = Json::array(), cameras = Json::array();
    std::map<std::string, std::size_t> known_cameras;
    cv::Size size;
    std::vector<std::string> faults;
    std::size_t shown = 0;
    Progress progress(ProgressKind::automatic, entries.size(), false);
    const auto read = [&](std::size_t i, Work& work) {
        for (const Role role : {output_role, input_role, depth_role}) {
            const fs::path& file = entries[i].files[role];
            try {
                if (file.empty())
                    continue;
                if (!shown_as[role]) // no file could be read
                    static_cast<void>(read_viewed(file, channel_of(options, role)));
                else
                    work.shown[role] = shown_of(options, file, role, *shown_as[role], room);
            } catch (const io::UnansweredRead&) {
                throw;
            } catch (const std::exception& error) {
                if (work.fault.empty() && !(role != output_role && has_failed(entries[i]))) // of which it is the reason
                    work.fault = error.what();
            }
        }
    };
    const auto add = [&](std::size_t i, Work& work, const std::exception_ptr& failure) {
        if (failure)
            std::rethrow_exception(failure);
        progress.hide();
        const Entry& entry = entries[i];
        fs::path name = entry.files[output_role];
        if (name.empty())
            name = text_of(*entry.line, entry.line->contains("output") ? "output" : "input");
        Json frame{{"name", io::printable(name.filename().native())}};
        if (entry.frame)
            frame["frame"] = *entry.frame;
        for (const Role role : {output_role, input_role, depth_role})
            if (!entry.files[role].empty())
                frame[role_names[role]] = io::printable(entry.files[role].native());
        if (entry.line)
            add_line(frame, *entry.line, cameras, known_cameras);
        if (!work.fault.empty()) {
            faults.push_back(work.fault);
            if (!frame.contains("error"))
                frame["error"] = io::printable(work.fault);
        }
        for (const Role role : {output_role, input_role, depth_role})
            if (const auto& each = work.shown[role]) {
                frame["images"][role_names[role]] = each->picture;
                frame["stats"][role_names[role]] = statistics_json(*each);
                if (size.empty())
                    size = each->size;
                ++shown;
            }
        frames.push_back(std::move(frame));
        progress.advance();
    };
    for_each_frame<Work>(entries.size(), {.read = read, .report = add}, {.stop = is_interrupted});
    progress.hide();
    stop_if_interrupted();
    if (shown == 0 && !faults.empty())
        throw Error(faults.front());
    if (shown == 0) {
        for (const Entry& entry : entries)
            for (const fs::path& file : entry.files)
                if (!file.empty()) // which failed the first time only
                    throw Error(file.native() + ": could not be read at first; make the page again");
        throw Error("report: none of the frames has a result, so there is no page");
    }
    for (const std::string& fault : faults)
        complain(fault);

    Json runs = Json::array();
    for (const Json& run : log.runs())
        runs.push_back(run_json(run));
    const std::string page = page_of({{"title", io::printable(title_of(options))},
                                      {"version", FATHOM_VERSION},
                                      {"command", command},
                                      {"width", size.width},
                                      {"height", size.height},
                                      {"has_log", !options.logs.empty()},
                                      {"unread_lines", log.unread()},
                                      {"runs", runs},
                                      {"layers", layers},
                                      {"marks",
                                       {{"invalid", hex_of(cv::Vec3b(invalid_color.data()))},
                                        {"background", hex_of(cv::Vec3b(background_color.data()))}}},
                                      {"cameras", cameras},
                                      {"frames", frames}});
    const io::NewFile file{options.page, {page.begin(), page.end()}};
    io::replace_files({&file, 1});
    const double megabytes = static_cast<double>(page.size()) / 1e6;
    if (options.json)
        print_json({{"output", options.page},
                    {"frames", entries.size()},
                    {"unreadable", faults.size()},
                    {"unread_lines", log.unread()},
                    {"bytes", page.size()}});
    else
        fmt::print("{}  {} frame{}, {:.1f} MB{}{}\n", io::printable(options.page), entries.size(),
                   entries.size() == 1 ? "" : "s", megabytes,
                   faults.empty() ? "" : fmt::format(", {} not readable", faults.size()),
                   log.unread() > 0 ? fmt::format(", {} of the log's lines not readable", log.unread()) : "");
    return faults.empty() ? done : input_failed;
}

std::function<int()> configure_report(CLI::App& app) {
    auto options = std::make_shared<ReportArguments>();
    app.add_option("OUT", options->outputs.arguments,
                   "results: files, a folder, or 'ao.####.exr', 'ao.%04d.exr' or 'ao.*.exr'")
        ->type_name("OUT")
        ->required()
        ->group("Input");
    app.add_option("--log", options->logs, "what --log of the command wrote: inputs, times, warnings, camera")
        ->type_name("FILE")
        ->group("Input");
    app.add_option("--input", options->inputs.arguments,
                   "images to compare the results with: as OUT (default: those of\nthe log)")
        ->type_name("IMAGE")
        ->group("Input");
    app.add_option("--depth", options->depths.arguments, "depth images to show beside them (default: those of the log)")
        ->type_name("DEPTH")
        ->group("Input");
    app.add_option("--channel", options->channel, "EXR channel or layer of the results, as for fathom show")
        ->type_name("NAME")
        ->group("Input");
    app.add_option("-o,--output", options->page, "page to write")->type_name("PAGE.html")->required()->group("Output");
    add_map_option(app, options->map);
    app.add_option("--title", options->title, "heading of the page (default: the name of the results)")
        ->type_name("TEXT")
        ->group("Output");
    app.add_flag("--json", options->json, "print a line of JSON")->group("Report");
    return [options] { return report(*options); };
}

} // namespace

extern const Command report_command{
    "report", "write a page that shows a shot: pictures, depth, times, warnings",
    R"(The page is one file that needs no network. It has pictures of each frame's input and result with a slider between
them, false colour with legends, histograms, invalid pixels and times over the frames, the command, the camera and
warnings. Without --log it has what the images show.

Example:
  fathom ssao shot.####.exr --camera cam.json -o ao.####.exr --log run.jsonl
  fathom report ao.####.exr --log run.jsonl -o report.html)",
    configure_report};

} // namespace fathom::cli
