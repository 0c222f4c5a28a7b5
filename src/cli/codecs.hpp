#pragma once

namespace fathom::cli {

/// Opens whatever of stdin, stdout and stderr the caller left closed, so that no file of ours takes their place,
/// and turns OpenCV's log off.
void prepare_streams();

/// While it lives, what libraries print on stderr goes nowhere: libpng and libtiff announce a damaged file themselves,
/// which would be more lines beside the one that the program prints.
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
