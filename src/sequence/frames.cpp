// Frame ranges as fileseq 3.4 (github.com/justinfx/fileseq, class FrameSet) writes them, without its y and colons, and names of
// frames, in which a number is written as there.
#include "frames.hpp"

#include "camera_file/file.hpp"
#include "text.hpp"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <stdexcept>
#include <utility>

#include <fnmatch.h>

namespace fathom::sequence {
namespace {

constexpr std::string_view ignored = " \t\n\v\f\r#@";
constexpr const char* form = "write frames as in 1-240, 1-240x2 or 7, with commas between them";

/// A place in a text.
class Cursor {
public:
    explicit Cursor(std::string_view text) : text_(text) { skip(); }

    bool at_end() const { return at_ == text_.size(); }
    bool sees(char c) const { return !at_end() && text_[at_] == c; }
    std::size_t place() const { return at_; }

    bool take(char c) {
        if (!sees(c))
            return false;
        ++at_;
        skip();
        return true;
    }

    Frame number() {
        const bool negative = take('-');
        const std::size_t first = at_;
        Frame value = 0;
        for (; !at_end() && text_[at_] >= '0' && text_[at_] <= '9'; ++at_) {
            value = 10 * value + (text_[at_] - '0');
            if (value > largest_frame)
                refuse(first, text("a number of more than ", most_figures, " figures; shorten it"));
        }
        if (at_ == first)
            refuse(first, text("a whole number is missing; ", form));
        skip();
        return negative ? -value : value;
    }

    [[noreturn]] void refuse(std::size_t place, const std::string& what) const {
        const std::string where =
            place < text_.size() ? text("character ", place + 1, " ('", text_[place], "')") : std::string("its end");
        throw std::invalid_argument(text("'", text_, "': at ", where, ": ", what));
    }
    [[noreturn]] void refuse_unknown() const { refuse(at_, text("cannot be read here; ", form)); }

private:
    void skip() { at_ = std::min(text_.find_first_not_of(ignored, at_), text_.size()); }

    std::string_view text_;
    std::size_t at_ = 0;
};

void check_count(const Cursor& cursor, std::size_t place, std::size_t there, Frame more, std::size_t most) {
    if (more > static_cast<Frame>(most - there))
        cursor.refuse(place, text("more than ", most, " frames; take fewer at a time"));
}

// FIRST, FIRST-LAST, or the latter and x and a number: frames from one to another, both included, in steps of either sign.
void append_part(std::vector<Frame>& frames, Cursor& cursor, std::size_t most) {
    const std::size_t place = cursor.place();
    const Frame first = cursor.number();
    const bool is_range = cursor.take('-'); // a single frame has no step
    const Frame last = is_range ? cursor.number() : first;
    const bool has_step = is_range && cursor.take('x');
    const std::size_t step_place = cursor.place();
    const Frame signed_step = has_step ? cursor.number() : 1;
    if (signed_step == 0 || (signed_step < 0 && last > first))
        cursor.refuse(step_place, "a step must be above 0");
    const Frame step = std::abs(signed_step), count = std::abs(last - first) / step + 1;
    check_count(cursor, place, frames.size(), count, most);
    for (Frame i = 0; i < count; ++i)
        frames.push_back(first + (last < first ? -i : i) * step);
}

std::vector<Frame> without_repeats(const std::vector<Frame>& frames) {
    std::vector<std::pair<Frame, std::size_t>> sorted(frames.size());
    for (std::size_t i = 0; i < frames.size(); ++i)
        sorted[i] = {frames[i], i};
    std::ranges::sort(sorted);
    const auto same_frame = [](const auto& a, const auto& b) { return a.first == b.first; };
    sorted.erase(std::unique(sorted.begin(), sorted.end(), same_frame), sorted.end());
    std::ranges::sort(sorted, {}, &std::pair<Frame, std::size_t>::second);
    std::vector<Frame> once(sorted.size());
    std::ranges::transform(sorted, once.begin(), &std::pair<Frame, std::size_t>::first);
    return once;
}

} // namespace

std::vector<Frame> parse_frames(std::string_view range, std::size_t most) {
    Cursor cursor(range);
    std::vector<Frame> frames;
    std::size_t parts = 0;
    do {
        if (cursor.at_end() || cursor.sees(',')) // fileseq leaves out what is empty
            continue;
        append_part(frames, cursor, most);
        ++parts;
    } while (cursor.take(','));
    if (!cursor.at_end())
        cursor.refuse_unknown();
    if (frames.empty())
        throw std::invalid_argument(text("'", range, "': names no frame; ", form));
    return parts > 1 ? without_repeats(frames) : frames;
}

std::string in_words(std::span<const Frame> frames) {
    std::string words;
    for (std::size_t i = 0; i < frames.size();) {
        std::size_t end = i + 1;
        while (end < frames.size() && frames[end] == frames[end - 1] + 1)
            ++end;
        words += words.empty() ? "" : ", ";
        words += end - i == 1 ? text(frames[i]) : text(frames[i], "-", frames[end - 1]);
        i = end;
    }
    return words;
}

namespace {

namespace fs = std::filesystem;

bool is_figure(char c) {
    return c >= '0' && c <= '9';
}

// A number of at least so many characters, as printf's %0Nd writes it.
std::string padded(Frame frame, int figures) {
    std::string text = std::to_string(std::abs(frame));
    const std::size_t wanted = static_cast<std::size_t>(figures) - (frame < 0 && figures > 0 ? 1 : 0);
    if (text.size() < wanted)
        text.insert(0, wanted - text.size(), '0');
    return frame < 0 ? "-" + text : text;
}

std::optional<Frame> number_in(std::string_view text) {
    Frame value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    const bool whole = error == std::errc() && end == text.data() + text.size();
    return whole && std::abs(value) <= largest_frame ? std::optional(value) : std::nullopt;
}

// Where the file's own name begins.
std::size_t name_in(std::string_view path) {
    const std::size_t slash = path.rfind('/');
    return slash == std::string_view::npos ? 0 : slash + 1;
}

} // namespace

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

bool FramePattern::matches(std::string_view name, std::size_t token, std::optional<Frame>& frame) const {
    const std::string before = literal(token);
    if (!name.starts_with(before))
        return false;
    name.remove_prefix(before.size());
    if (token == tokens_.size())
        return name.empty();
    std::size_t length = name.starts_with('-') ? 1 : 0;
    while (length < name.size() && is_figure(name[length]))
        ++length;
    for (; length > 0; --length) { // figures may follow that are not the number's
        std::optional<Frame> number = number_in(name.substr(0, length));
        if (!number || (frame && *frame != *number) ||
            padded(*number, tokens_[token].figures) != name.substr(0, length))
            continue;
        if (matches(name.substr(length), token + 1, number)) {
            frame = number;
            return true;
        }
    }
    return false;
}

std::optional<Frame> FramePattern::frame(std::string_view name) const {
    std::optional<Frame> frame;
    return matches(name, 0, frame) ? frame : std::nullopt;
}

std::vector<FramePattern> FramePattern::parts() const {
    std::vector<FramePattern> parts;
    for (std::size_t begin = 0, end = 0; begin <= text_.size(); begin = end + 1) {
        end = std::min(text_.find('/', begin), text_.size());
        FramePattern part;
        part.text_ = text_.substr(begin, end - begin);
        for (const Token& token : tokens_)
            if (token.begin >= begin && token.end <= end)
                part.tokens_.push_back({token.begin - begin, token.end - begin, token.figures});
        if (!part.text_.empty())
            parts.push_back(part);
    }
    return parts;
}

// The files below a folder whose path goes on with these parts.
void FramePattern::collect(const fs::path& folder, std::span<const FramePattern> parts, std::optional<Frame> frame,
                           std::map<Frame, std::string>& found) {
    if (parts.empty()) {
        if (frame && !io::is_folder(folder))
            found.emplace(*frame, folder.native());
        return;
    }
    const FramePattern& part = parts.front();
    if (part.tokens_.empty() || frame) {
        const fs::path next = folder / (frame ? part.name(*frame) : part.text_);
        if (io::is_there(next))
            collect(next, parts.subspan(1), frame, found);
        return;
    }
    for (const std::string& name : io::names_in(folder.empty() ? fs::path(".") : folder)) {
        if (const auto number = part.frame(name))
            collect(folder / name, parts.subspan(1), number, found);
    }
}

std::map<Frame, std::string> FramePattern::files() const {
    std::map<Frame, std::string> there, found;
    collect(text_.starts_with('/') ? "/" : "", parts(), std::nullopt, there);
    for (const auto& each : there) // as the pattern writes it: a//b stays a//b
        found.emplace(each.first, name(each.first));
    return found;
}

namespace {

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

} // namespace

std::vector<std::string> matching_files(const std::string& pattern) {
    std::vector<std::string> files;
    const fs::path path = pattern;
    const std::vector<fs::path> parts(path.begin(), path.end());
    collect_matching({}, parts, files);
    std::ranges::sort(files);
    return files;
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

} // namespace fathom::sequence
