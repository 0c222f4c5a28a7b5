#pragma once

#include <nlohmann/json.hpp>

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

/// What the program prints, and how it is asked to end.
namespace fathom::terminal {

/// What the program says to the shell. An interrupt is 128 plus the signal's number: 130 for Ctrl-C.
enum ExitCode : int { done = 0, input_failed = 1, wrong_usage = 2, no_device = 3 };

/// The arguments contradict each other or the files that are there. Nothing was done yet.
class UsageError : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

/// Call it before there are other threads: one that it starts takes Ctrl-C, SIGTERM and SIGHUP, which end the program once `last` is
/// done.
/// A file that grows past `ulimit -f` is an error from now on, and so is a pipe that nobody reads.
void watch_interrupts(void (*last)());

/// From now on the first Ctrl-C (or SIGTERM, SIGHUP) only asks the work to stop where nothing is left half done;
/// the second ends the program at once.
void catch_interrupts();

/// What `stop_if_interrupted` throws. No std::exception, so that no file is blamed for it.
struct Interrupted {
    int signal;
};

/// Asks the work to stop as a signal does.
void interrupt(int signal);

/// Did a signal come?
bool is_interrupted();

/// Throws: Interrupted, when a signal came.
void stop_if_interrupted();

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

/// A line of JSON. Bytes that are not UTF-8 (in file names) are replaced.
std::string json_line(const nlohmann::ordered_json& value);

/// Prints one on stdout.
void print_json(const nlohmann::ordered_json& value);

/// A number for JSON, which has neither NaN nor infinity: those are the strings "nan", "inf" and "-inf".
nlohmann::ordered_json json_number(double value);

/// A number for people: seven digits, which tell any two floats of the same image apart in practice.
std::string number(double value);

/// "did you mean focus?" of the known name that is the fewest edits away from `name`; `otherwise` when none is near enough.
std::string did_you_mean(std::string_view name, const std::vector<std::string>& known, const std::string& otherwise);

/// `a, b or c`
std::string one_of(const std::vector<std::string>& names);

/// "96 of 9600 pixels invalid (1 %)": the end of the line about a result.
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

    /// Makes place for other lines, and comes back.
    void hide();
    void show();

    /// One more input is done, and its lines are printed.
    void advance();

private:
    std::size_t count_, done_ = 0;
    bool bar_ = false, openjd_ = false, shown_ = false;
    std::string text_ = {};
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now(), first_ = {};
};

} // namespace fathom::terminal
