#pragma once

namespace fathom::cli {

/// Opens whatever of stdin, stdout and stderr the caller left closed, so that no file of ours takes their place,
/// and turns OpenCV's log off.
void prepare_streams();

/// While it lives, output of libraries on stderr is dropped: libpng and libtiff report a damaged file themselves, but
/// the program prints one line of its own.
class StderrSilenced {
public:
    StderrSilenced();
    ~StderrSilenced();
    StderrSilenced(const StderrSilenced&) = delete;
    StderrSilenced& operator=(const StderrSilenced&) = delete;

private:
    int kept_;
};

} // namespace fathom::cli
