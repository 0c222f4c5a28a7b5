// Values that change from frame to frame, from CSV (RFC 4180, and what spreadsheets make of it) or JSON.
#include "frames.hpp"

#include "camera_file/file.hpp"
#include "camera_file/json_object.hpp"

#include "text.hpp"

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <vector>

namespace fathom::sequence {
namespace {

using io::refuse;

std::string_view trimmed(std::string_view text) {
    const std::size_t first = text.find_first_not_of(" \t\r");
    return first == std::string_view::npos ? "" : text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

// The cells of a line.
std::vector<std::string> cells_of(std::string_view line, char separator) {
    std::vector<std::string> cells(1);
    bool quoted = false;
    for (std::size_t i = 0; i < line.size(); ++i) {
        if (line[i] == '"' && quoted && i + 1 < line.size() && line[i + 1] == '"')
            cells.back() += line[i++]; // two of them stand for one
        else if (line[i] == '"')
            quoted = !quoted;
        else if (line[i] == separator && !quoted)
            cells.emplace_back();
        else
            cells.back() += line[i];
    }
    for (std::string& cell : cells)
        cell = trimmed(cell);
    return cells;
}

// A single frame.
std::optional<Frame> frame_in(const std::string& text) {
    if (text.empty() || text.find_first_not_of("0123456789-") != std::string::npos)
        return std::nullopt;
    try {
        const std::vector<Frame> frames = parse_frames(text, 1);
        return frames.size() == 1 ? std::optional(frames.front()) : std::nullopt;
    } catch (const std::invalid_argument&) {
        return std::nullopt;
    }
}

// Which cell of a line holds what.
struct Columns {
    std::size_t frame = 0, value = 1, count = 2;
};

Columns columns_of(const std::filesystem::path& file, std::vector<std::string> names, const std::string& name) {
    for (std::string& each : names)
        std::ranges::replace(each, '_', '-');
    const auto at = [&](const std::string& wanted) {
        return static_cast<std::size_t>(std::ranges::find(names, wanted) - names.begin());
    };
    Columns columns{at("frame"), at(name), names.size()};
    if (columns.frame == columns.count)
        refuse(file, "its first line names no column \"frame\"; begin the file with frame," + name);
    if (columns.value == columns.count) // which stands for any option
        columns.value = at("value");
    if (columns.value == columns.count)
        refuse(file, text("its first line names no column \"", name, "\"; call the column of the values so"));
    return columns;
}

std::map<Frame, std::string> from_csv(const std::filesystem::path& file, std::string_view bytes,
                                      const std::string& name) {
    std::map<Frame, std::string> values;
    std::optional<char> separator;
    Columns columns;
    std::size_t number = 0;
    for (std::size_t begin = 0, end = 0; begin < bytes.size(); begin = end + 1) {
        end = std::min(bytes.find('\n', begin), bytes.size());
        ++number;
        const std::string_view line = trimmed(bytes.substr(begin, end - begin));
        if (line.empty() || line.front() == '#')
            continue;
        const bool is_first = !separator;
        if (is_first)
            separator = line.find('\t') != line.npos ? '\t' : line.find(';') != line.npos ? ';' : ',';
        const std::vector<std::string> cells = cells_of(line, *separator);
        const std::optional<Frame> frame = columns.frame < cells.size() ? frame_in(cells[columns.frame]) : std::nullopt;
        if (is_first && !frame) {
            columns = columns_of(file, cells, name);
            continue;
        }
        if (cells.size() != columns.count)
            refuse(file,
                   text("line ", number, " has ", cells.size(), cells.size() == 1 ? " cell" : " cells", " instead of ",
                        columns.count, "; put a value that holds '", *separator, "' between quotation marks"));
        if (!frame)
            refuse(file, text("line ", number, ": '", cells[columns.frame], "' is no frame; it is a whole number"));
        if (!values.emplace(*frame, cells[columns.value]).second)
            refuse(file, text("line ", number, ": frame ", *frame, " is there twice; leave one of them out"));
    }
    return values;
}

std::string text_of(const nlohmann::json& value) {
    if (value.is_string())
        return value.get<std::string>();
    if (!value.is_array())
        return value.dump();
    std::string list;
    for (const nlohmann::json& each : value)
        list += (list.empty() ? "" : ",") + text_of(each);
    return list;
}

std::map<Frame, std::string> from_json(const std::filesystem::path& file, std::span<const unsigned char> bytes) {
    std::map<Frame, std::string> values;
    const nlohmann::json object = io::parsed_json(file, bytes);
    for (const auto& [key, value] : object.items()) {
        const std::optional<Frame> frame = frame_in(key);
        if (!frame)
            refuse(file, text("'", key, "' is no frame; it is a whole number, as in {\"1\": 2.5}"));
        if (!values.emplace(*frame, text_of(value)).second)
            refuse(file, text("frame ", *frame, " is there twice; leave one of them out"));
    }
    return values;
}

} // namespace

std::map<Frame, std::string> read_frame_values(const std::filesystem::path& file, const std::string& name) {
    const io::Bytes bytes = io::read_file(file);
    std::string_view characters(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    if (characters.starts_with("\xEF\xBB\xBF"))
        characters.remove_prefix(3);
    const std::size_t first = characters.find_first_not_of(" \t\r\n");
    const bool is_json = first != std::string_view::npos && characters[first] == '{';
    std::map<Frame, std::string> values =
        is_json ? from_json(file, std::span(bytes).last(characters.size())) : from_csv(file, characters, name);
    if (values.empty())
        refuse(file, "holds no frame; write a line for each, as in 1,2.5");
    return values;
}

} // namespace fathom::sequence
