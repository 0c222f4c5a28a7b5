// Claims without a server of their own. They need two things from a file system: O_EXCL and a rename that is atomic. All times
// are those of the machine that has the files: a file is written where a clock would be read or a time be set, because some
// network file systems (SMB) take the local clock for the times that a program sets.
#include "claim.hpp"

#include "camera_file/file.hpp"

#include <nlohmann/json.hpp>

#include <fcntl.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <exception>
#include <random>
#include <string_view>
#include <system_error>
#include <utility>

namespace fs = std::filesystem;

namespace fathom::sequence {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr int renewals = 5;                   // in a lease
constexpr std::size_t largest_content = 1024; // bytes that are read: a claim has fewer

// A descriptor that closes itself. Network file systems send what was written when it is closed.
class Descriptor {
public:
    Descriptor(const fs::path& file, int flags) : number_(::open(file.c_str(), flags | O_CLOEXEC, 0666)) {}
    ~Descriptor() { close(); }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;

    explicit operator bool() const { return number_ >= 0; }
    int number() const { return number_; }
    bool close() {
        const int number = std::exchange(number_, -1);
        return number < 0 || ::close(number) == 0;
    }

private:
    int number_;
};

// The file is gone, or another machine removed it after it was opened here.
bool is_gone(int error) {
    return error == ENOENT || error == ESTALE;
}

constexpr const char* cure = "every process that shares a shot must read and write in this folder";

[[noreturn]] void fail(const fs::path& file, const std::string& what, int error) {
    io::refuse_write(file, what, error, cure);
}

[[noreturn]] void fail_to_make(const fs::path& file, int error) {
    io::refuse_making(file, "cannot be made", error,
                      error == ENAMETOOLONG ? "choose a shorter name for the result" : cure);
}

std::string random_name() {
    static constexpr char figures[] = "0123456789abcdef";
    std::random_device random;
    std::string name;
    for (int word = 0; word < 4; ++word)
        for (std::uint32_t bits = random(), i = 0; i < 8; ++i, bits >>= 4)
            name += figures[bits & 15];
    return name;
}

// Files that are there for moments. Their names are short: that of a claim may already be as long as names can be.
constexpr std::string_view begin = ".fathom-claim-", end = ".tmp";

fs::path temporary(const fs::path& folder, const std::string& name) {
    return folder / (std::string(begin) + name + std::string(end));
}

// Equal process numbers in two containers, or on two hosts, differ by the random number.
std::string own_content() {
    const nlohmann::ordered_json members{
        {"host", io::printable(io::host_name())}, {"process", ::getpid()}, {"random", random_name()}};
    return members.dump() + '\n';
}

nanoseconds last_change(const struct stat& status) {
    return std::chrono::seconds(status.st_mtim.tv_sec) + nanoseconds(status.st_mtim.tv_nsec);
}

bool write_all(Descriptor& file, const std::string& content) {
    const auto written = ::pwrite(file.number(), content.data(), content.size(), 0);
    if (written >= 0 && static_cast<std::size_t>(written) < content.size())
        errno = ENOSPC;
    return written == static_cast<ssize_t>(content.size()) && file.close();
}

// Makes a claim's file; false: there is one.
bool make(const fs::path& file, const std::string& content) {
    Descriptor made(file, O_WRONLY | O_CREAT | O_EXCL);
    const bool opened{made};
    if (!opened && errno == EEXIST)
        return false;
    if (opened && write_all(made, content))
        return true;
    const int error = errno;
    made.close();
    if (opened)
        ::unlink(file.c_str());
    fail_to_make(file, error);
}

bool is_old(const fs::path& file, const SeenClaim& seen, milliseconds lease) {
    return server_now(file.parent_path()) - seen.changed > lease;
}

// Makes a claim in the place of one that is older than a lease. A file of its own lets one process at a time do so: otherwise
// of several that saw the old claim each would rename the new one of the one before.
bool take_over(const fs::path& file, const std::string& content, milliseconds lease) {
    const std::optional<SeenClaim> seen = find_claim(file);
    if (seen && !is_old(file, *seen, lease))
        return false;
    const fs::path guard = takeover_of(file);
    if (!make(guard, content)) {
        if (const auto other = find_claim(guard); other && is_old(guard, *other, lease)) // it was killed here
            ::unlink(guard.c_str());
        return false;
    }
    const auto remove_guard = [](const fs::path* path) { ::unlink(path->c_str()); };
    const std::unique_ptr<const fs::path, decltype(remove_guard)> guarded(&guard, remove_guard);
    const std::optional<SeenClaim> again = find_claim(file);
    if (again && (!seen || *again != *seen || !remove_claim(file, *seen)))
        return false;
    return make(file, content);
}

} // namespace

fs::path takeover_of(const fs::path& claim) {
    return temporary(claim.parent_path(), io::digest(claim.filename().native())); // two claims may share one
}

void remove_left_claims(const fs::path& folder, const std::set<fs::path>& claims, milliseconds lease) {
    std::error_code none;
    for (fs::directory_iterator each(folder.empty() ? "." : folder, none), last; !none && each != last;
         each.increment(none)) {
        const fs::path& file = each->path();
        const std::string name = file.filename().native();
        const bool temporary = name.starts_with(begin) && name.ends_with(end), claim = claims.contains(file.filename());
        if (!temporary && !claim)
            continue;
        const auto seen = find_claim(file);
        if (!seen || !is_old(file, *seen, lease))
            continue;
        if (claim)
            remove_claim(file, *seen);
        else
            ::unlink(file.c_str());
    }
}

std::optional<SeenClaim> find_claim(const fs::path& file) {
    const Descriptor opened(file, O_RDONLY); // unlike stat() it asks the server, also over NFS
    if (!opened && is_gone(errno))
        return std::nullopt;
    struct stat status {};
    std::string content(largest_content, '\0');
    ssize_t read = -1;
    if (opened && ::fstat(opened.number(), &status) == 0)
        read = ::pread(opened.number(), content.data(), content.size(), 0);
    if (read < 0 && is_gone(errno))
        return std::nullopt;
    if (read < 0)
        fail(file, "cannot be read", errno);
    content.resize(static_cast<std::size_t>(read));
    return SeenClaim{content, last_change(status)};
}

nanoseconds server_now(const fs::path& folder) {
    const fs::path file = temporary(folder, random_name());
    Descriptor made(file, O_WRONLY | O_CREAT); // an empty file needs no space on the disk
    struct stat status {};
    const bool known = made && ::fstat(made.number(), &status) == 0;
    const int error = errno;
    if (made.close()) // NFS keeps a file that is removed while it is open, under another name
        ::unlink(file.c_str());
    if (!known)
        fail_to_make(file, error);
    return last_change(status);
}

bool remove_claim(const fs::path& file, const SeenClaim& seen) {
    const fs::path own = temporary(file.parent_path(), random_name());
    if (::rename(file.c_str(), own.c_str()) != 0) {
        if (is_gone(errno)) // somebody was faster
            return false;
        fail(file, "cannot be renamed", errno);
    }
    // Between the look and the rename somebody may have taken the claim anew, or its owner may have woken and renewed it.
    const std::optional<SeenClaim> renamed = find_claim(own);
    const bool same = renamed == seen;
    // Such a claim is made again with its owner's words, by which the owner knows it, unless a third process was faster: then
    // its owner finds out that it has lost it. A claim without words is one that its owner is about to write and to check.
    if (renamed && !same && !renamed->content.empty())
        make(file, renamed->content);
    ::unlink(own.c_str());
    return same;
}

std::unique_ptr<Claim> Claim::take(const fs::path& file, milliseconds lease) {
    std::string content = own_content();
    if (!make(file, content) && !take_over(file, content, lease))
        return nullptr;
    std::unique_ptr<Claim> claim(new Claim(file, std::move(content), lease));
    if (!claim->is_mine(find_claim(file))) // somebody renamed it away before its content was in it, see remove_claim
        return nullptr;
    return claim;
}

Claim::Claim(fs::path file, std::string content, milliseconds lease)
    : file_(std::move(file)), content_(std::move(content)), lease_(lease), end_(::eventfd(0, EFD_CLOEXEC)) {
    if (end_ < 0) {
        const int error = errno;
        ::unlink(file_.c_str());
        fail(file_, "cannot be renewed", error);
    }
    try {
        heartbeat_ = std::thread([this] { renew_until_end(); });
    } catch (const std::system_error& error) {
        ::close(end_);
        ::unlink(file_.c_str());
        fail(file_, "cannot be renewed", error.code().value());
    }
}

Claim::~Claim() {
    ::eventfd_write(end_, 1);
    heartbeat_.join();
    ::close(end_);
    try {
        if (is_mine(find_claim(file_)))
            ::unlink(file_.c_str());
    } catch (const std::exception&) { // it can be taken after a lease
    }
}

bool Claim::still_mine() const {
    const std::optional<SeenClaim> seen = find_claim(file_);
    return is_mine(seen) && !is_old(file_, *seen, lease_);
}

// The kernel counts the time that poll() waits; a point in time would be one on the clock of this machine.
void Claim::renew_until_end() const noexcept {
    pollfd end{.fd = end_, .events = POLLIN, .revents = 0};
    const int pause = static_cast<int>(lease_.count() / renewals);
    for (int ended = 0; ended <= 0;) {
        ended = ::poll(&end, 1, pause); // a signal ends the wait, too
        if (ended == 0)
            renew();
    }
}

// A renewal that fails is tried again with the next one. What was opened is written even if it is renamed meanwhile: so a
// renewal never touches the claim of somebody else.
void Claim::renew() const noexcept {
    Descriptor opened(file_, O_RDWR);
    std::string content(content_.size() + 1, '\0');
    if (!opened || ::pread(opened.number(), content.data(), content.size(), 0) != static_cast<ssize_t>(content_.size()))
        return;
    content.resize(content_.size());
    if (content == content_)
        write_all(opened, content_);
}

} // namespace fathom::sequence
