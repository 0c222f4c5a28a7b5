// Where PoCL keeps what it compiles, and what it links with. Its compiled kernels are code that this process runs, so that
// they may lie in no folder into which somebody else can write. Source: PoCL 3.1 and 6.0, "Environment variables", and
// lib/CL/pocl_cache.c, for the names in its folder.
#include "runtime/pocl.hpp"

#include "text.hpp"

#include <fathom/error.hpp>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <sstream>
#include <system_error>
#include <thread>

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

namespace fathom::runtime {
namespace {

namespace fs = std::filesystem;

std::string variable(const char* name) {
    const char* const value = std::getenv(name);
    return value ? value : "";
}

/// The folder that PoCL was given in place of its usual one.
fs::path& given_folder() {
    static fs::path folder;
    return folder;
}

} // namespace

fs::path pocl_folder() {
    if (!given_folder().empty())
        return given_folder();
    if (const std::string own = variable("POCL_CACHE_DIR"); !own.empty())
        return own;
    if (const std::string cache = variable("XDG_CACHE_HOME"); !cache.empty())
        return fs::path(cache) / "pocl/kcache";
    const std::string home = variable("HOME");
    return home.empty() ? "/tmp/pocl/kcache" : fs::path(home) / ".cache/pocl/kcache";
}

namespace {

// Why as much as a kernel takes cannot be written into a folder; 0 where it can be.
int refusal_to_write(const fs::path& folder) {
    std::error_code failure;
    fs::create_directories(folder, failure);
    if (failure)
        return failure.value();
    std::string name = (folder / ("fathom-" + std::string(6, 'X'))).string(); // mkstemp asks for these six
    const int file = mkstemp(name.data());
    if (file < 0)
        return errno;
    constexpr off_t most = 1 << 20;
    rlimit limit{};
    const bool limited =
        getrlimit(RLIMIT_FSIZE, &limit) == 0 && limit.rlim_cur < rlim_t{most}; // to try would be a signal
    const int refusal = limited ? EFBIG : posix_fallocate(file, 0, most);
    close(file);
    unlink(name.c_str());
    return refusal;
}

bool is_full(int refusal) {
    return refusal == ENOSPC || refusal == EDQUOT;
}

std::string described(int refusal) {
    return text(pocl_folder().string(), ", where ", refusal == EFBIG ? "files must be small" : "nothing can be written",
                " (", std::generic_category().message(refusal), "); ",
                refusal == EFBIG ? "raise the limit of file sizes (ulimit -f)"
                                 : "make room there, or let POCL_CACHE_DIR name another folder");
}

/// Can PoCL's usual folder be written, or made where it would lie? It is not made here, because PoCL may not be installed.
bool has_usual_folder() {
    std::error_code ignored;
    if (variable("XDG_CACHE_HOME").empty() && !fs::is_directory(variable("HOME"), ignored))
        return false;
    fs::path folder = pocl_folder();
    while (folder.has_relative_path() && !fs::exists(folder, ignored))
        folder = folder.parent_path();
    const int refusal = refusal_to_write(folder);
    return refusal == 0 || refusal == EFBIG;
}

/// A folder that goes when the process that made it ends.
class FolderOfProcess;
std::atomic<const FolderOfProcess*> folder_of_process = nullptr;

class FolderOfProcess {
public:
    FolderOfProcess() {
        std::error_code none;
        std::string name = (fs::temp_directory_path(none) / "fathom-kernels-").string() + std::string(6, 'X');
        if (mkdtemp(name.data())) // which replaces the six letters; of mode 0700
            path_ = name;
        folder_of_process = this;
    }
    ~FolderOfProcess() {
        folder_of_process = nullptr;
        remove();
    }
    FolderOfProcess(const FolderOfProcess&) = delete;
    FolderOfProcess& operator=(const FolderOfProcess&) = delete;

    const fs::path& path() const { return path_; }

    void remove() const {
        if (path_.empty() || getpid() != process_)
            return;
        std::error_code failure;
        constexpr int most = 300, enough = 3; // a kernel that is being compiled may make it anew meanwhile
        for (int i = 0, gone = 0; i < most && gone < enough; ++i) {
            gone = fs::exists(path_, failure) ? 0 : gone + 1;
            if (gone == 0)
                fs::remove_all(path_, failure);
            else
                std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
    }

private:
    fs::path path_;
    pid_t process_ = getpid();
};

bool has_linker() {
    std::istringstream folders(variable("PATH"));
    for (std::string folder; std::getline(folders, folder, ':');)
        if (const fs::path file = fs::path(folder) / "ld"; access(file.c_str(), X_OK) == 0 && !fs::is_directory(file))
            return true;
    return false;
}

} // namespace

void remove_folder_of_process() {
    if (const FolderOfProcess* const folder = folder_of_process)
        folder->remove();
}

PoclFolder::PoclFolder() {
    if (const char* const own = std::getenv("POCL_CACHE_DIR"); own && !*own)
        unsetenv("POCL_CACHE_DIR"); // PoCL ends the process
    else if (own)
        return;
    static const bool usual = has_usual_folder();
    if (!usual && given_folder().empty()) {
        static const FolderOfProcess own;
        given_folder() = own.path();
    }
    is_given_ = !given_folder().empty();
    if (is_given_)
        setenv("POCL_CACHE_DIR", given_folder().c_str(), 1);
}

PoclFolder::~PoclFolder() {
    if (is_given_)
        unsetenv("POCL_CACHE_DIR");
}

PoclRefusal pocl_refusal() {
    const int refusal = refusal_to_write(pocl_folder());
    return {.full = is_full(refusal), .words = refusal == 0 || refusal == EFBIG ? "" : described(refusal)};
}

void check_pocl_folder(const std::string& file, bool has_failed) {
    if (const int refusal = refusal_to_write(pocl_folder()); is_full(refusal) || (has_failed && refusal != 0))
        throw Error(text("kernels/", file, " is not compiled: PoCL keeps what it compiles in ", described(refusal)));
}

void check_linker() {
    static const bool found = has_linker();
    if (!found)
        throw NoDevice("PoCL compiles no kernel, since there is no linker: no folder of PATH holds \"ld\"; install the "
                       "package binutils");
}

} // namespace fathom::runtime
