// Frame ranges as fileseq 3.4 (github.com/justinfx/fileseq, class FrameSet) writes them.
#include "frame_range.hpp"

#include "text.hpp"

#include <algorithm>
#include <cstdlib>
#include <stdexcept>
#include <utility>

namespace fathom::sequence {
namespace {

constexpr std::string_view ignored = " \t\n\v\f\r#@";
constexpr const char* form = "write frames as in 1-240, 1-240x2, 1-240y2, 1-240:4 or 7, with commas between them";

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

// Frames from one to another, both included, in steps of either sign.
void append(std::vector<Frame>& frames, Frame first, Frame last, Frame step) {
    const Frame count = (last - first) / step + 1;
    for (Frame i = 0; i < count; ++i)
        frames.push_back(first + i * step);
}

void check_count(const Cursor& cursor, std::size_t place, std::size_t there, Frame more, std::size_t most) {
    if (more > static_cast<Frame>(most - there))
        cursor.refuse(place, text("more than ", most, " frames; take fewer at a time"));
}

// FIRST, FIRST-LAST, or the latter and x, y or : and a number.
void append_part(std::vector<Frame>& frames, Cursor& cursor, std::size_t most) {
    const std::size_t place = cursor.place();
    const Frame first = cursor.number();
    const bool is_range = cursor.take('-'); // a single frame has no step
    const Frame last = is_range ? cursor.number() : first;
    const char kind = !is_range ? ' ' : cursor.take('x') ? 'x' : cursor.take('y') ? 'y' : cursor.take(':') ? ':' : ' ';
    const std::size_t step_place = cursor.place();
    const Frame signed_step = kind == ' ' ? 1 : cursor.number();
    if (signed_step == 0 || (signed_step < 0 && last > first))
        cursor.refuse(step_place, "a step must be above 0");
    const Frame direction = last < first ? -1 : 1, apart = std::abs(last - first);
    const Frame step = std::abs(signed_step);
    check_count(cursor, place, frames.size(), (kind == 'y' || kind == ':' ? apart : apart / step) + 1, most);
    if (kind == 'y') {
        for (Frame i = 0; i <= apart; ++i)
            if (i % step != 0)
                frames.push_back(first + direction * i);
    } else if (kind == ':') {
        std::vector<bool> taken(static_cast<std::size_t>(apart) + 1);
        for (Frame each = std::min(step, apart + 1); each > 0; --each)
            for (Frame i = 0; i <= apart; i += each)
                if (auto is_taken = taken[static_cast<std::size_t>(i)]; !is_taken) {
                    is_taken = true;
                    frames.push_back(first + direction * i);
                }
    } else {
        append(frames, first, last, direction * step);
    }
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
