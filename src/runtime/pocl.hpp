#pragma once

#include <filesystem>
#include <string>

/// What PoCL needs beside itself: a folder for what it compiles, and a linker. It says little where one of them is missing, or
/// ends the process, so that both are looked for first.
namespace fathom::runtime {

/// Lets PoCL keep what it compiles where nobody else can write, if POCL_CACHE_DIR is not set and the folder that PoCL would
/// take cannot be used: in a folder of this process that is removed at its end. It is there while drivers are asked for their
/// devices, which is when PoCL reads POCL_CACHE_DIR. No other process inherits that.
class PoclFolder {
public:
    PoclFolder();
    ~PoclFolder();
    PoclFolder(const PoclFolder&) = delete;
    PoclFolder& operator=(const PoclFolder&) = delete;

private:
    bool is_given_ = false;
};

/// Where PoCL keeps what it compiles, as the environment and a `PoclFolder` say.
std::filesystem::path pocl_folder();

/// Removes that folder of this process, where there is one, before a signal ends it.
void remove_folder_of_process();

/// A folder where PoCL cannot write what it compiles.
struct PoclRefusal {
    bool full = false; ///< the disk, or what may be used of it
    std::string words; ///< the folder, why, and the cure; empty where PoCL can write
};
PoclRefusal pocl_refusal();

/// Throws: Error if PoCL has no room for what it compiles of a file of kernels, where its compiler may end the process; and if
/// it cannot write at all, once a build has failed.
void check_pocl_folder(const std::string& file, bool has_failed);

/// Throws: NoDevice if there is no linker, without which PoCL would end the process.
void check_linker();

} // namespace fathom::runtime
