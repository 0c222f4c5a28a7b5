#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

/// Everything that reads what somebody else wrote, each as a function of bytes. tests/fuzz/fuzzer.cpp gives them to libFuzzer,
/// tests/test_io_fuzz.cpp repeats the corpus.
namespace fathom::fuzz {

using Bytes = std::vector<unsigned char>;
using Input = std::span<const unsigned char>;

struct Target {
    std::string_view name;

    /// Reads it. A refusal is good if it is one printable line that names the file.
    /// Throws: std::logic_error for any other, and what a reader throws that it must not.
    void (*run)(Input);

    /// Makes check sums and offsets right again that stand in the way of what lies behind them. Null: there are none.
    void (*repair)(Bytes&);

    std::size_t largest; ///< bytes of an input
};

std::span<const Target> text_targets();
std::span<const Target> image_targets();

/// The target of that name; null if there is none.
const Target* find_target(std::string_view name);

} // namespace fathom::fuzz
