#pragma once

#include "doubts/look.hpp"

#include <nlohmann/json.hpp>

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace fathom::terminal {

/// Gives what was printed to the one who reads it. Without a reader the work is asked to stop.
void flush_output();

/// Throws: Error when something that was printed could not be written; Interrupted when nobody reads it.
void check_output();

/// Prints raw bytes. Throws as `check_output`.
void print_bytes(std::span<const unsigned char> bytes);

/// What is said then; `error`: the system's number, 0 if it is not known.
std::string unwritable_output(int error);

/// Prints `fathom: message` on one line of stderr, whatever line breaks and control characters the message holds.
void complain(std::string_view message);

/// The message, with `subject: ` in front unless it already names one of the files it may be about.
std::string about(const std::filesystem::path& subject, std::string_view message,
                  const std::vector<std::filesystem::path>& already_named = {});

/// Prints a line of JSON on stdout. Bytes that are not UTF-8 (in file names) are replaced.
void print_json(const nlohmann::ordered_json& value);

/// A number for JSON, which has neither NaN nor infinity: those are the strings "nan", "inf" and "-inf".
nlohmann::ordered_json json_number(double value);

/// A number for people: seven digits, which tell any two floats of the same image apart in practice.
std::string number(double value);

/// The known name that is the fewest edits away from `name`; empty when none is near enough to be meant.
std::string nearest(std::string_view name, const std::vector<std::string>& known);

/// `a, b or c`
std::string one_of(const std::vector<std::string>& names);

/// "z 0.5 to 12, 3 % background, 96 of 9600 pixels invalid (1 %)": for the line about a result.
std::string in_words(const Look& look, const char* depth);

/// The end of it.
std::string invalid_in_words(std::size_t invalid, std::size_t pixels);

/// Opens whatever of stdin, stdout and stderr the caller left closed, so that no file of ours takes their place,
/// and turns OpenCV's log off.
void prepare_streams();

/// How a run over several inputs tells how far it is.
enum class ProgressKind { automatic, openjd, off };

/// How far a run is: a bar on a terminal, or the lines that a session of Open Job Description understands.
/// Source of those: the specification "How Jobs Are Run", <https://github.com/OpenJobDescription/openjd-specifications>.
class Progress {
public:
    /// `quiet` runs have no bar.
    Progress(ProgressKind kind, std::size_t count, bool quiet);
    ~Progress() { hide(); }
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    /// Makes place for other lines.
    void hide();

    /// One more input is done, and its lines are printed.
    void advance();

private:
    std::size_t count_, done_ = 0;
    bool bar_ = false, openjd_ = false, shown_ = false;
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now(), first_ = {};
};

} // namespace fathom::terminal
