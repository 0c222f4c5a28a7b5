// Frame ranges as fileseq 3.4 (github.com/justinfx/fileseq, class FrameSet) writes them, without its y and colons.
#include "frame_range.hpp"

#include "text.hpp"

#include <algorithm>
#include <cstdlib>
#include <stdexcept>
#include <utility>

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

} // namespace fathom::sequence
