// Frame ranges as fileseq 3.4 (github.com/justinfx/fileseq, class FrameSet) writes them, without its y and colons; names of frames,
// in which a number is written as there; and values that change from frame to frame, from CSV (RFC 4180, and what spreadsheets make
// of it) or JSON.
#include "frames.hpp"

#include "camera_file/file.hpp"
#include "camera_file/json_object.hpp"
#include "text.hpp"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <regex>
#include <span>
#include <stdexcept>
#include <unordered_set>

#include <fnmatch.h>

namespace fathom::sequence {
namespace {

namespace fs = std::filesystem;

constexpr const char* form = "write frames as in 1-240, 1-240x2 or 7, with commas between them";

// FIRST, FIRST-LAST, or the latter and x and a number, with blanks, # and @ between these.
const std::regex& part_form() {
    const std::string i = "[\\s#@]*", number = "(-?" + i + "\\d+)" + i;
    static const std::regex part(i + number + "(?:-" + i + number + "(?:x" + i + number + ")?)?");
    return part;
}

Frame number_of(std::string text) {
    std::erase_if(text, [](char c) { return c != '-' && (c < '0' || c > '9'); });
    Frame value = largest_frame + 1; // where it has more figures than any number
    std::from_chars(text.data(), text.data() + text.size(), value);
    return value;
}

bool is_figure(char c) {
    return c >= '0' && c <= '9';
}

// A number of at least so many characters, which may be more than any number has.
std::string padded(Frame frame, int figures) {
    const std::string sign = frame < 0 ? "-" : "", digits = std::to_string(std::abs(frame));
    const std::size_t length = sign.size() + digits.size(), least = static_cast<std::size_t>(figures);
    return sign + std::string(least - std::min(least, length), '0') + digits;
}

// Where the file's own name begins.
std::size_t name_in(std::string_view path) {
    const std::size_t slash = path.rfind('/');
    return slash == std::string_view::npos ? 0 : slash + 1;
}

// The files below a folder whose path goes on with these parts. glob() would leave out what a disk does not answer for.
void collect_matching(const fs::path& folder, std::span<const fs::path> parts, std::vector<std::string>& files) {
    if (parts.empty()) {
        if (!io::is_folder(folder))
            files.push_back(folder.native());
        return;
    }
    const std::string& part = parts.front().native();
    if (!has_glob(part)) {
        if (io::is_there(folder / part))
            collect_matching(folder / part, parts.subspan(1), files);
        return;
    }
    for (const std::string& name : io::names_in(folder.empty() ? fs::path(".") : folder))
        if (fnmatch(part.c_str(), name.c_str(), FNM_PERIOD) == 0)
            collect_matching(folder / name, parts.subspan(1), files);
}

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
        io::refuse(file, "its first line names no column \"frame\"; begin the file with frame," + name);
    if (columns.value == columns.count) // which stands for any option
        columns.value = at("value");
    if (columns.value == columns.count)
        io::refuse(file, text("its first line names no column \"", name, "\"; call the column of the values so"));
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
        const std::optional<Frame> frame =
            columns.frame < cells.size() ? number_in(cells[columns.frame]) : std::nullopt;
        if (is_first && !frame) {
            columns = columns_of(file, cells, name);
            continue;
        }
        if (cells.size() != columns.count)
            io::refuse(file, text("line ", number, " has ", cells.size(), cells.size() == 1 ? " cell" : " cells",
                                  " instead of ", columns.count, "; put a value that holds '", *separator,
                                  "' between quotation marks"));
        if (!frame)
            io::refuse(file, text("line ", number, ": '", cells[columns.frame], "' is no frame; it is a whole number"));
        if (!values.emplace(*frame, cells[columns.value]).second)
            io::refuse(file, text("line ", number, ": frame ", *frame, " is there twice; leave one of them out"));
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
        const std::optional<Frame> frame = number_in(key);
        if (!frame)
            io::refuse(file, text("'", key, "' is no frame; it is a whole number, as in {\"1\": 2.5}"));
        if (!values.emplace(*frame, text_of(value)).second)
            io::refuse(file, text("frame ", *frame, " is there twice; leave one of them out"));
    }
    return values;
}

} // namespace

std::optional<Frame> number_in(std::string_view text) {
    Frame value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    const bool whole = error == std::errc() && end == text.data() + text.size();
    return whole && std::abs(value) <= largest_frame ? std::optional(value) : std::nullopt;
}

std::vector<Frame> parse_frames(std::string_view range, std::size_t most) {
    constexpr std::size_t longest = 200; // of a part
    const auto refuse = [&](const std::string& why) { throw std::invalid_argument(text("'", range, "': ", why)); };
    std::vector<Frame> frames;
    for (std::size_t begin = 0, end = 0; begin < range.size(); begin = end + 1) {
        end = std::min(range.find(',', begin), range.size());
        const std::string part(range.substr(begin, end - begin));
        if (part.find_first_not_of(" \t\n\v\f\r#@") == std::string::npos) // fileseq leaves out what is empty
            continue;
        std::smatch found;
        if (part.size() > longest || !std::regex_match(part, found, part_form()))
            refuse(text("'", part, "' is no frames; ", form));
        const Frame first = number_of(found[1]), last = found[2].matched ? number_of(found[2]) : first,
                    signed_step = found[3].matched ? number_of(found[3]) : 1, step = std::abs(signed_step);
        if (std::max({std::abs(first), std::abs(last), step}) > largest_frame)
            refuse(text("'", part, "' has a number of more than ", most_figures, " figures; shorten it"));
        if (step == 0 || (signed_step < 0 && last > first))
            refuse(text("'", part, "': a step must be above 0"));
        const Frame count = std::abs(last - first) / step + 1;
        if (count > static_cast<Frame>(most - frames.size()))
            refuse(text("more than ", most, " frames; take fewer at a time"));
        for (Frame i = 0; i < count; ++i)
            frames.push_back(first + (last < first ? -i : i) * step);
    }
    if (frames.empty())
        refuse(text("names no frame; ", form));
    if (range.find(',') != std::string_view::npos) {
        std::unordered_set<Frame> seen;
        std::erase_if(frames, [&](Frame frame) { return !seen.insert(frame).second; });
    }
    return frames;
}

std::optional<FramePattern> FramePattern::in(const std::string& name) {
    FramePattern pattern;
    pattern.text_ = name;
    for (std::size_t at = name.find('%'); at != std::string::npos; at = name.find('%', at + 1)) {
        std::size_t end = at + 1;
        while (end < name.size() && is_figure(name[end]))
            ++end;
        const auto figures =
            end == at + 1 ? std::optional<Frame>(1) : number_in(std::string_view(&name[at + 1], &name[end]));
        if (end < name.size() && name[end] == 'd' && figures && *figures <= most_figures)
            pattern.tokens_.push_back({at, end + 1, static_cast<int>(*figures)});
    }
    if (const std::size_t last = name.rfind('#');
        pattern.tokens_.empty() && last != std::string::npos && last >= name_in(name)) {
        const std::size_t begin = name.find_last_not_of('#', last) + 1; // 0 where there is no other character
        if (last + 1 - begin <= most_figures)
            pattern.tokens_.push_back({begin, last + 1, static_cast<int>(last + 1 - begin)});
    }
    return pattern.tokens_.empty() ? std::nullopt : std::optional(pattern);
}

std::optional<std::pair<FramePattern, Frame>> FramePattern::of(const std::string& file) {
    const std::size_t name = name_in(file), point = file.rfind('.');
    const std::size_t stem_end = point == std::string::npos || point <= name ? file.size() : point;
    std::size_t begin = stem_end, end = stem_end;
    for (std::size_t last = stem_end; last > name && begin == end;) { // figures alone between points
        const std::size_t before = file.rfind('.', last - 1);
        const std::size_t first = before == std::string::npos || before < name ? name : before + 1;
        const std::size_t figures = first + (first < last && file[first] == '-');
        if (figures < last && std::all_of(&file[figures], &file[last], is_figure)) {
            begin = figures;
            end = last;
        }
        last = first > name ? first - 1 : name;
    }
    if (begin == end) {
        while (end > name && !is_figure(file[end - 1]))
            --end;
        for (begin = end; begin > name && is_figure(file[begin - 1]);)
            --begin;
    }
    const auto value = number_in(std::string_view(&file[begin], &file[end]));
    if (!value)
        return std::nullopt;
    const bool has_zeros = file[begin] == '0' && end - begin > 1;
    const bool negative = *value != 0 && begin > name && file[begin - 1] == '-' && // a zero has no minus
                          (begin - 1 == name || file[begin - 2] == '.' || file[begin - 2] == '_');
    begin -= negative;
    const int figures = has_zeros ? static_cast<int>(end - begin) : 1;
    const std::string token = "%0" + std::to_string(figures) + "d";
    FramePattern pattern;
    pattern.text_ = file.substr(0, begin) + token + file.substr(end);
    pattern.tokens_ = {{begin, begin + token.size(), figures}};
    return std::pair(pattern, negative ? -*value : *value);
}

std::optional<std::pair<FramePattern, std::map<Frame, std::string>>>
FramePattern::common(const std::vector<std::string>& files) {
    std::optional<FramePattern> pattern; // of a file with zeros in front, if there is one
    for (const std::string& file : files) {
        const auto own = of(file);
        if (!own)
            return std::nullopt;
        if (!pattern || own->first.tokens_.front().figures > 1)
            pattern = own->first;
    }
    std::map<Frame, std::string> found;
    for (const std::string& file : files) {
        const auto frame = pattern->frame(file);
        if (!frame || !found.emplace(*frame, file).second)
            return std::nullopt;
    }
    return pattern ? std::optional(std::pair(*pattern, found)) : std::nullopt;
}

std::string FramePattern::literal(std::size_t before) const {
    const std::size_t begin = before == 0 ? 0 : tokens_[before - 1].end;
    return text_.substr(begin, before == tokens_.size() ? std::string::npos : tokens_[before].begin - begin);
}

std::string FramePattern::beside_number() const {
    std::string text = literal(0);
    for (std::size_t i = 0; i < tokens_.size(); ++i)
        text += '#' + literal(i + 1);
    return text;
}

std::string FramePattern::name(Frame frame) const {
    std::string name = literal(0);
    for (std::size_t i = 0; i < tokens_.size(); ++i)
        name += padded(frame, tokens_[i].figures) + literal(i + 1);
    return name;
}

std::optional<Frame> FramePattern::frame(std::string_view name) const {
    const std::string before = literal(0);
    if (!name.starts_with(before))
        return std::nullopt;
    const std::string_view rest = name.substr(before.size());
    std::size_t length = rest.starts_with('-') ? 1 : 0;
    while (length < rest.size() && is_figure(rest[length]))
        ++length;
    for (; length > 0; --length) // figures may follow that are not the number's
        if (const auto number = number_in(rest.substr(0, length)); number && this->name(*number) == name)
            return number;
    return std::nullopt;
}

std::vector<std::string> matching_files(const std::string& pattern) {
    std::vector<std::string> files;
    const fs::path path = pattern;
    const std::vector<fs::path> parts(path.begin(), path.end());
    collect_matching({}, parts, files);
    std::ranges::sort(files);
    return files;
}

std::map<Frame, std::string> FramePattern::files() const {
    FramePattern plain = *this; // as files are found: a//b is a/b
    for (std::size_t at; (at = plain.text_.find("//")) != std::string::npos;) {
        plain.text_.erase(at, 1);
        for (Token& token : plain.tokens_)
            if (token.begin > at)
                token = {token.begin - 1, token.end - 1, token.figures};
    }
    std::string glob; // which all names match, and others
    for (std::size_t i = 0; i <= tokens_.size(); ++i) {
        std::string between = plain.literal(i);
        std::ranges::replace_if(
            between, [](char c) { return c == '*' || c == '[' || c == '\\'; }, '?');
        glob += (i > 0 ? "*" : "") + between;
    }
    std::map<Frame, std::string> found;
    for (const std::string& file : matching_files(glob))
        if (const auto frame = plain.frame(file))
            found.emplace(*frame, name(*frame));
    return found;
}

std::vector<std::string> depth_files_in(const fs::path& folder) {
    std::vector<std::string> files;
    for (const std::string& name : io::names_in(folder)) {
        const auto known = {".exr", ".png", ".tif", ".pfm", ".pgm", ".npy"};
        if (std::ranges::find(known, io::extension_of(name)) != known.end() && name.front() != '.' &&
            !io::is_folder(folder / name))
            files.push_back((folder / name).native());
    }
    std::ranges::sort(files);
    return files;
}

bool has_glob(const std::string& name) {
    return name.find_first_of("*?[") != std::string::npos;
}

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
        io::refuse(file, "holds no frame; write a line for each, as in 1,2.5");
    return values;
}

} // namespace fathom::sequence
