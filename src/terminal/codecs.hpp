#pragma once

#include <string_view>

namespace fathom::cli {

/// Opens whatever of stdin, stdout and stderr the caller left closed, so that no file of ours takes their place,
/// and turns OpenCV's log off.
void prepare_streams();

/// While one lives in any thread, output of libraries on stderr is dropped: libpng and libtiff report a damaged file
/// themselves, but the program prints one line of its own, with `write_to_stderr`.
class StderrSilenced {
public:
    StderrSilenced();
    ~StderrSilenced();
    StderrSilenced(const StderrSilenced&) = delete;
    StderrSilenced& operator=(const StderrSilenced&) = delete;
};

/// Writes on stderr, also while it is silenced.
void write_to_stderr(std::string_view text);

} // namespace fathom::cli
