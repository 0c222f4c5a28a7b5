// --log. Lines of several processes do not mix: a file that is opened to append to takes each write whole.
#include "run_log.hpp"

#include "camera_file/file.hpp"
#include "terminal/messages.hpp"

#include <fmt/chrono.h>

#include <chrono>
#include <filesystem>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace fathom::cli {
namespace {

std::vector<std::string>& command_line() {
    static std::vector<std::string> arguments;
    return arguments;
}

} // namespace

void remember_command_line(int argc, char** argv) {
    command_line().assign(argv, argv + argc);
}

RunLog::RunLog(const std::string& file) : file_(file) {
    if (file.empty())
        return;
    if (file == "-") {
        descriptor_ = ::fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 0);
        return;
    }
    descriptor_ = ::open(file.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
    const int error = errno;
    if (descriptor_ < 0 &&
        (error == EACCES || error == ESPIPE || error == ENXIO)) // a file or pipe that is only written
        descriptor_ = ::open(file.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
    if (descriptor_ < 0)
        io::refuse_write(file, "the log cannot be written", error, "choose another file (--log)");
    constexpr std::string_view beginning = R"({"run":)"; // a full disk may have left a part of it
    char found[beginning.size()];
    struct stat status;
    const bool answers = ::fstat(descriptor_, &status) == 0;
    const bool regular = answers && S_ISREG(status.st_mode); // devices have no past
    const ssize_t length = regular ? ::pread(descriptor_, found, sizeof found, 0) : 0;
    if (!answers || length < 0) {
        const int unread = errno;
        ::close(std::exchange(descriptor_, -1));
        io::refuse_read(file, unread);
    }
    if (length > 0 && !beginning.starts_with({found, static_cast<std::size_t>(length)})) {
        ::close(std::exchange(descriptor_, -1));
        io::refuse(file, "is no log, and is left as it is; choose another file (--log)");
    }
}

RunLog::~RunLog() {
    if (descriptor_ >= 0)
        ::close(descriptor_);
}

void RunLog::begin(const nlohmann::ordered_json& more) {
    if (descriptor_ < 0)
        return;
    const auto now = std::chrono::time_point_cast<std::chrono::seconds>(std::chrono::system_clock::now());
    std::error_code none;
    nlohmann::ordered_json run{
        {"command", command_line()}, {"folder", std::filesystem::current_path(none).native()},
        {"version", FATHOM_VERSION}, {"host", io::host_name()},
        {"process", ::getpid()},     {"started", fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(now))}};
    run.update(more);
    // A full disk may have left a part of a line.
    struct stat status;
    char last = '\n';
    if (::fstat(descriptor_, &status) == 0 && status.st_size > 0 &&
        ::pread(descriptor_, &last, 1, status.st_size - 1) != 1)
        last = '?'; // an empty line does no harm
    if (last != '\n' && ::write(descriptor_, "\n", 1) != 1)
        complete_ = false;
    add({{"run", run}});
}

void RunLog::add(const nlohmann::ordered_json& line) {
    if (descriptor_ < 0)
        return;
    const std::string text = line.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + '\n';
    ssize_t written = 0;
    do
        written = ::write(descriptor_, text.data(), text.size());
    while (written < 0 && errno == EINTR);
    if (written == static_cast<ssize_t>(text.size()))
        return;
    const std::string why = io::reason(written < 0 ? errno : ENOSPC);
    complain(file_ + ": the log cannot be written: " + why + "; it ends here, and the frames are done without it");
    complete_ = false;
    ::close(std::exchange(descriptor_, -1));
}

} // namespace fathom::cli
