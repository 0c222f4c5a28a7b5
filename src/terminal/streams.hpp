#pragma once

#include <string_view>

namespace fathom::cli {

/// Opens whatever of stdin, stdout and stderr the caller left closed, so that no file of ours takes their place,
/// and turns OpenCV's log off.
void prepare_streams();

void write_to_stderr(std::string_view text);

} // namespace fathom::cli
