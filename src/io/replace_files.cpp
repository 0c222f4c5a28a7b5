// Files are replaced whole.
#include "replace_files.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <deque>
#include <system_error>
#include <utility>

namespace fs = std::filesystem;

namespace fathom::io {
namespace {

std::string reason(int error) {
    return std::generic_category().message(error);
}

/// A new file beside the target that is gone again unless it took the target's place.
class Successor {
public:
    explicit Successor(const fs::path& target) : target_(target) {
        static std::atomic<unsigned> count = 0;
        do {
            // A short name of its own: the target's may already be as long as names can be.
            const auto name = ".fathom-" + std::to_string(::getpid()) + "-" + std::to_string(count++) + ".tmp";
            path_ = target.parent_path() / name;
            descriptor_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        } while (descriptor_ < 0 && errno == EEXIST);
        if (descriptor_ < 0)
            fail(errno);
    }
    Successor(const Successor&) = delete;
    Successor& operator=(const Successor&) = delete;
    ~Successor() {
        if (descriptor_ >= 0)
            ::close(descriptor_);
        if (!done_)
            ::unlink(path_.c_str());
    }

    void write(std::span<const unsigned char> bytes) {
        while (!bytes.empty()) {
            const auto written = ::write(descriptor_, bytes.data(), std::min<std::size_t>(bytes.size(), 1u << 30));
            if (written < 0 && errno == EINTR)
                continue;
            if (written <= 0)
                fail(written < 0 ? errno : ENOSPC);
            bytes = bytes.subspan(static_cast<std::size_t>(written));
        }
    }

    void complete() {
        if (struct stat old; ::stat(target_.c_str(), &old) == 0)
            static_cast<void>(::fchmod(descriptor_, old.st_mode & 07777)); // keeps what the owner had granted
        if (::close(std::exchange(descriptor_, -1)) != 0)                  // where network disks say that they are full
            fail(errno);
    }

    void take_over() {
        if (::rename(path_.c_str(), target_.c_str()) != 0)
            fail(errno);
        done_ = true;
    }

private:
    [[noreturn]] void fail(int error) {
        const auto folder = target_.parent_path().empty() ? fs::path(".") : target_.parent_path();
        std::error_code unknown;
        if ((error == ENOENT || error == ENOTDIR) && !fs::is_directory(folder, unknown))
            refuse(target_, "cannot be written: there is no folder " + folder.string() + "; make it first");
        if (error == ENOSPC || error == EDQUOT || error == EFBIG)
            refuse(target_, "cannot be written: " + reason(error) + "; free some space or write elsewhere");
        refuse(target_, "cannot be written: " + reason(error) + "; choose a folder that you may write into");
    }

    fs::path target_;
    fs::path path_;
    int descriptor_ = -1;
    bool done_ = false;
};

/// Where a file's content belongs. A link stays a link: what it points to is replaced, or made.
fs::path target_of(const fs::path& file) {
    std::error_code error;
    const auto status = fs::status(file, error);
    if (fs::is_directory(status))
        refuse(file, "is a folder; name a file in it");
    if (fs::exists(status) && !fs::is_regular_file(status))
        refuse(file, "is no regular file; write to one and copy it");
    fs::path target = file; // the system refuses chains longer than 40
    for (int links = 0; links < 40 && fs::is_symlink(fs::symlink_status(target, error)); ++links)
        target = target.parent_path() / fs::read_symlink(target);
    return target;
}

} // namespace

void replace_files(std::span<const NewFile> files) {
    std::deque<Successor> successors;
    for (const NewFile& file : files) {
        Successor& successor = successors.emplace_back(target_of(file.file));
        successor.write(file.bytes);
        successor.complete();
    }
    for (Successor& successor : successors)
        successor.take_over();
}

} // namespace fathom::io
