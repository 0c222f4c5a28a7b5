#pragma once

#include "camera_file/file.hpp"

#include <cstdint>
#include <filesystem>
#include <span>

namespace fathom::io {

/// What a file is to hold.
struct NewFile {
    std::filesystem::path file;
    Bytes bytes;
};

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

    void take_over();

private:
    [[noreturn]] void fail(int error) const;

    std::filesystem::path target_, path_;
    int descriptor_ = -1, lock_ = -1;
    bool done_ = false;
};

/// Replaces, in this order, files' contents, or makes them: whoever looks sees the old file or the new one, never a part. The first takes
/// its place only once all of them lie complete on their disks: whatever goes wrong before (no such folder, no permission,
/// a full disk), the old ones stay and nothing else is left behind.
///
/// Until then each content lies beside its file as `.fathom-TARGET-MACHINE-PROCESS-NUMBER.tmp`, with a lock (flock) that ends
/// with the process.
void replace_files(std::span<const NewFile> files);

/// Removes what killed processes left beside these files, which need not be there. What a process of this machine works on
/// is locked; what another machine left must also be old, by the clock of the disk.
void remove_abandoned(std::span<const std::filesystem::path> files);

} // namespace fathom::io
