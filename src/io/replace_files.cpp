// Files are replaced whole.
#include "replace_files.hpp"

#include "require.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <deque>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <tuple>
#include <utility>

namespace fs = std::filesystem;

namespace fathom::io {
namespace {

constexpr std::string_view begin = ".fathom-", end = ".tmp";
constexpr const char* cure = "choose a folder that you may write into";
constexpr time_t old_s = 600; // writing a file takes seconds

/// The machine since it was started; containers of one machine share it, as they share its locks.
const std::string& machine() {
    static const std::string id = [] {
        std::string boot;
        std::getline(std::ifstream("/proc/sys/kernel/random/boot_id"), boot);
        return digest(boot.empty() ? host_name() : boot); // some containers hide it
    }();
    return id;
}

/// Locks a new file, where the disk has locks. Not: somebody else had it already, and may have removed the file.
bool is_locked(int descriptor) {
    if (::flock(descriptor, LOCK_EX | LOCK_NB) != 0)
        return errno != EWOULDBLOCK;
    struct stat status;
    return ::fstat(descriptor, &status) != 0 || status.st_nlink > 0;
}

/// A new file that nobody has, in the folder of the target. Its name says which file it is for, and is short: the target's
/// may already be as long as names can be.
std::pair<fs::path, int> open_temporary(const fs::path& target) {
    static std::atomic<unsigned> count = 0;
    const std::string name = std::string(begin) + digest(target.filename().native()) + "-" + machine() + "-" +
                             std::to_string(::getpid()) + "-";
    for (;;) {
        fs::path path = target.parent_path() / (name + std::to_string(count++) + std::string(end));
        const int descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (descriptor < 0 && errno == EEXIST)
            continue;
        if (descriptor < 0 || is_locked(descriptor))
            return {std::move(path), descriptor};
        ::unlink(path.c_str()); // it was taken for abandoned before it was locked
        ::close(descriptor);
    }
}

/// Where a file's content belongs. A link stays a link: what it points to is replaced, or made.
fs::path target_of(const fs::path& file) {
    require_rounding();
    std::error_code error;
    const auto status = fs::status(file, error);
    if (error == std::errc::filename_too_long) // before another file takes its place
        refuse_write(file, "cannot be written", ENAMETOOLONG, cure);
    if (fs::is_directory(status))
        refuse(file, "is a folder; name a file in it");
    if (fs::exists(status) && !fs::is_regular_file(status))
        refuse(file, "is no regular file; write to one and copy it");
    fs::path target = followed(file, error);
    if (error.value() == EIO) // a file would take the place of the link
        refuse_write(file, "cannot be written", EIO, cure);
    return target;
}

/// Does no process work on the file any more? Then this one has the lock, until it closes the descriptor.
bool is_abandoned(int descriptor) {
    return descriptor >= 0 && ::flock(descriptor, LOCK_EX | LOCK_NB) == 0;
}

/// Is a file old by the clock of its disk?
bool is_old(int descriptor, const fs::path& target) {
    const auto [path, probe] = open_temporary(target);
    if (probe < 0)
        return false;
    struct stat now, then;
    const bool old =
        ::fstat(probe, &now) == 0 && ::fstat(descriptor, &then) == 0 && now.st_mtime - then.st_mtime > old_s;
    ::unlink(path.c_str());
    ::close(probe);
    return old;
}

void remove_if_abandoned(const fs::path& temporary, bool of_this_machine, const fs::path& target) {
    int descriptor = ::open(temporary.c_str(), O_WRONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
    if (descriptor < 0) // a lock needs no more where files are not shared
        descriptor = ::open(temporary.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
    if (is_abandoned(descriptor) && (of_this_machine || is_old(descriptor, target)))
        ::unlink(temporary.c_str());
    if (descriptor >= 0)
        ::close(descriptor);
}

/// A new file beside its target, that is gone again unless it took the target's place.
class Successor {
public:
    explicit Successor(const std::filesystem::path& file);
    Successor(const Successor&) = delete;
    Successor& operator=(const Successor&) = delete;
    ~Successor();

    /// Writes from byte number `at` on.
    void write(std::span<const unsigned char> bytes, std::uint64_t at);

    /// No more is written: all of it lies on the disk.
    void complete();

    /// What the file is, now and in its target's place. Throws: Error where it is not there any more.
    FileState state() const;

    void take_over();

private:
    [[noreturn]] void fail(int error) const;

    std::filesystem::path target_, path_;
    int descriptor_ = -1, lock_ = -1;
    bool done_ = false;
};

Successor::Successor(const fs::path& file) : target_(target_of(file)) {
    std::tie(path_, descriptor_) = open_temporary(target_);
    if (descriptor_ >= 0)
        return;
    const int error = errno;
    const auto folder = target_.parent_path().empty() ? fs::path(".") : target_.parent_path();
    std::error_code unknown;
    if ((error == ENOENT || error == ENOTDIR) && !fs::is_directory(folder, unknown))
        refuse(target_, "cannot be written: there is no folder " + folder.string() + "; make it first");
    refuse_making(target_, "cannot be written", error, cure);
}

Successor::~Successor() {
    if (descriptor_ >= 0)
        ::close(descriptor_);
    if (!done_)
        ::unlink(path_.c_str());
    if (lock_ >= 0)
        ::close(lock_);
}

void Successor::write(std::span<const unsigned char> bytes, std::uint64_t at) {
    while (!bytes.empty()) {
        const auto written =
            ::pwrite(descriptor_, bytes.data(), std::min<std::size_t>(bytes.size(), 1u << 30), static_cast<off_t>(at));
        if (written < 0 && errno == EINTR)
            continue;
        if (written <= 0)
            fail(written < 0 ? errno : ENOSPC);
        bytes = bytes.subspan(static_cast<std::size_t>(written));
        at += static_cast<std::uint64_t>(written);
    }
}

void Successor::complete() {
    // What the owner had granted is kept, where the disk has such permissions.
    struct stat old;
    const int unknown = ::stat(target_.c_str(), &old) == 0 ? 0 : errno;
    if (unknown == 0 && ::fchmod(descriptor_, old.st_mode & 07777) != 0 && errno != EPERM && errno != ENOTSUP)
        fail(errno);
    if (unknown == EIO) // it may be a file that is there for nobody else
        fail(unknown);
    lock_ = ::fcntl(descriptor_, F_DUPFD_CLOEXEC, 0); // keeps the lock until the file has its place
    if (::close(std::exchange(descriptor_, -1)) != 0) // where network disks say that they are full
        fail(errno);
}

FileState Successor::state() const {
    const auto state = state_of(path_);
    if (!state)
        fail(ENOENT);
    return *state;
}

void Successor::take_over() {
    if (::rename(path_.c_str(), target_.c_str()) != 0)
        fail(errno);
    done_ = true;
}

void Successor::fail(int error) const {
    refuse_write(target_, "cannot be written", error, cure);
}

} // namespace

void remove_abandoned(std::span<const fs::path> files) {
    std::map<fs::path, std::map<std::string, fs::path>> targets; // of each folder, by the beginning of temporary names
    for (const fs::path& file : files) {
        std::error_code none;
        if (fs::is_directory(file, none))
            continue;
        const fs::path target = followed(file, none);
        const fs::path folder = target.parent_path().empty() ? fs::path(".") : target.parent_path();
        targets[folder].emplace(std::string(begin) + digest(target.filename().native()) + "-", target);
    }
    constexpr std::size_t prefix = begin.size() + 17;
    for (const auto& [folder, of_folder] : targets) {
        std::error_code none;
        for (fs::directory_iterator each(folder, none), last; !none && each != last; each.increment(none)) {
            const std::string name = each->path().filename().native();
            if (!name.starts_with(begin) || !name.ends_with(end) || name.size() < prefix)
                continue;
            if (const auto target = of_folder.find(name.substr(0, prefix)); target != of_folder.end())
                remove_if_abandoned(each->path(), name.substr(prefix).starts_with(machine() + "-"), target->second);
        }
    }
}

std::optional<FileState> state_of(const fs::path& file) {
    std::error_code none;
    const std::uintmax_t size = fs::file_size(file, none);
    const fs::file_time_type time = none ? fs::file_time_type{} : fs::last_write_time(file, none);
    return none ? std::nullopt : std::optional(FileState{size, time.time_since_epoch().count()});
}

void replace_files(std::span<const NewFile> files, const LastFile& last) {
    std::deque<Successor> successors;
    std::set<fs::path> targets;
    std::vector<FileState> states;
    const auto make = [&](const NewFile& file) {
        if (!targets.insert(whole_path(file.file)).second)
            refuse(file.file, "would be written twice; write one of the two elsewhere");
        Successor& successor = successors.emplace_back(file.file);
        successor.write(file.bytes, 0);
        successor.complete();
        states.push_back(successor.state());
    };
    for (const NewFile& file : files)
        make(file);
    if (last)
        make(last(states));
    for (Successor& successor : successors)
        successor.take_over();
}

} // namespace fathom::io
