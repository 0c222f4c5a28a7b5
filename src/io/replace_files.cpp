// Files are replaced whole.
#include "replace_files.hpp"

#include "require.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <deque>
#include <set>
#include <string>
#include <system_error>
#include <tuple>
#include <utility>

namespace fs = std::filesystem;

namespace fathom::io {
namespace {

constexpr const char* cure = "choose a folder that you may write into";

/// A new file that nobody has, in the folder of the target. Its name says which file it is for, and is short: the target's
/// may already be as long as names can be.
std::pair<fs::path, int> open_temporary(const fs::path& target) {
    static std::atomic<unsigned> count = 0;
    const std::string name = ".fathom-" + digest(target.filename().native()) + "-" + std::to_string(::getpid()) + "-";
    for (;;) {
        fs::path path = target.parent_path() / (name + std::to_string(count++) + ".tmp");
        const int descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (descriptor >= 0 || errno != EEXIST)
            return {std::move(path), descriptor};
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

/// A new file beside its target, that is gone again unless it took the target's place.
class Successor {
public:
    explicit Successor(const fs::path& file) : target_(target_of(file)) {
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
    Successor(const Successor&) = delete;
    Successor& operator=(const Successor&) = delete;
    ~Successor() {
        if (descriptor_ >= 0)
            ::close(descriptor_);
        if (!done_)
            ::unlink(path_.c_str());
    }

    /// What it holds, all of which then lies on the disk.
    void write(std::span<const unsigned char> bytes) {
        while (!bytes.empty()) {
            const auto written = ::write(descriptor_, bytes.data(), std::min<std::size_t>(bytes.size(), 1u << 30));
            if (written < 0 && errno == EINTR)
                continue;
            if (written <= 0)
                fail(written < 0 ? errno : ENOSPC);
            bytes = bytes.subspan(static_cast<std::size_t>(written));
        }
        // What the owner had granted is kept, where the disk has such permissions.
        struct stat old;
        const int unknown = ::stat(target_.c_str(), &old) == 0 ? 0 : errno;
        if (unknown == 0 && ::fchmod(descriptor_, old.st_mode & 07777) != 0 && errno != EPERM && errno != ENOTSUP)
            fail(errno);
        if (unknown == EIO) // it may be a file that is there for nobody else
            fail(unknown);
        if (::close(std::exchange(descriptor_, -1)) != 0) // where network disks say that they are full
            fail(errno);
    }

    /// What the file is, now and in its target's place. Throws: Error where it is not there any more.
    FileState state() const {
        const auto state = state_of(path_);
        if (!state)
            fail(ENOENT);
        return *state;
    }

    void take_over() {
        if (::rename(path_.c_str(), target_.c_str()) != 0)
            fail(errno);
        done_ = true;
    }

private:
    [[noreturn]] void fail(int error) const { refuse_write(target_, "cannot be written", error, cure); }

    fs::path target_, path_;
    int descriptor_ = -1;
    bool done_ = false;
};

} // namespace

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
        successor.write(file.bytes);
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
