// What the program prints: one line for an error, one for a result, for people or as JSON.
#include "messages.hpp"

#include "interrupt.hpp"
#include "streams.hpp"

#include "camera_file/file.hpp"
#include "camera_file/known_words.hpp"
#include "description/range.hpp"
#include "text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>

namespace fathom::cli {
namespace {

std::string on_one_line(std::string_view text) {
    std::string line;
    for (const char c : text) {
        const bool blank = static_cast<unsigned char>(c) <= ' ' || c == '\x7f';
        if (!blank)
            line += c;
        else if (!line.empty() && line.back() != ' ')
            line += ' ';
    }
    while (line.ends_with(' '))
        line.pop_back();
    return line;
}

int output_error = 0; // the first

} // namespace

void flush_output() {
    errno = 0;
    if (std::fflush(stdout) != 0 && output_error == 0)
        output_error = errno;
    if (output_error == EPIPE)
        interrupt(SIGPIPE);
}

void check_output() {
    flush_output();
    if (output_error == EPIPE)
        throw Interrupted{SIGPIPE};
    if (output_error != 0 || std::ferror(stdout) != 0)
        throw Error(unwritable_output(output_error));
}

std::string unwritable_output(int error) {
    const std::string why = error == 0 ? "" : ": " + io::reason(error);
    return "standard output: cannot be written" + why + "; check what it is sent to";
}

void complain(std::string_view message) {
    write_to_stderr("fathom: " + io::printable(on_one_line(message)) + '\n');
}

std::string about(const std::filesystem::path& subject, std::string_view message,
                  const std::vector<std::filesystem::path>& already_named) {
    const auto names = [&](const std::filesystem::path& file) {
        return !file.empty() && message.find(file.native()) != std::string_view::npos;
    };
    if (names(subject) || std::any_of(already_named.begin(), already_named.end(), names))
        return std::string(message);
    return subject.native() + ": " + std::string(message);
}

void print_json(const nlohmann::ordered_json& value) {
    fmt::print("{}\n", value.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
}

nlohmann::ordered_json json_number(double value) {
    if (std::isnan(value))
        return "nan";
    if (std::isinf(value))
        return value > 0 ? "inf" : "-inf";
    return value;
}

std::string number(double value) {
    return fmt::format("{:.7g}", value);
}

std::string nearest(std::string_view name, const std::vector<std::string>& known) {
    const std::vector<std::string> best = io::nearest_words(known, name, 1);
    const std::size_t most_edits = std::max<std::size_t>(2, name.size() / 3);
    return best.empty() || io::edit_distance(name, best.front()) > most_edits ? "" : best.front();
}

std::string one_of(const std::vector<std::string>& names) {
    return description::in_words(names);
}

std::string in_words(const Look& look, const char* depth) {
    std::string text =
        look.surfaces() == 0 ? "no surface" : fmt::format("{} {:.4g} to {:.4g}", depth, look.nearest, look.farthest);
    if (look.background > 0)
        text += fmt::format(", {} background", percent(look.background, look.pixels));
    return text + ", " + invalid_in_words(look.invalid, look.pixels);
}

std::string invalid_in_words(std::size_t invalid, std::size_t pixels) {
    return fmt::format("{} of {} pixels invalid", invalid, pixels) +
           (invalid > 0 ? fmt::format(" ({})", percent(invalid, pixels)) : "");
}

} // namespace fathom::cli
