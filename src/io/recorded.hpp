#pragma once

#include "camera_file/file.hpp"

#include <fathom/io.hpp>

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

/// Records: a line of text that lies in a file beside its pixels and says what made them.
namespace fathom::io {

/// The bytes of a file but for its record: those before it, and those behind it.
using Rest = std::array<std::span<const unsigned char>, 2>;

/// A file with its record.
struct RecordedFile {
    Bytes bytes;
    std::string record;
    std::size_t first = 0, last = 0; ///< of `bytes`, where the record lies, if it lies in the file itself

    Rest rest() const { return {std::span(bytes).first(first), std::span(bytes).subspan(last)}; }
};

/// Where the record of a file lies whose format has no place for one: FILE.fathom.json.
std::filesystem::path sidecar_of(const std::filesystem::path& file);

/// Can the type of file that the name stands for hold a record?
bool holds_record(const std::filesystem::path& file);

/// The record of an EXR (a string attribute of its first part) or of a PNG (text), both called fathom:record, or that of the
/// sidecar. None: there is no such file, or no whole record.
std::optional<RecordedFile> read_recorded(const std::filesystem::path& file);

/// Makes the record of files of which these are the bytes, one each. The record's length does not depend on them.
using RecordOf = std::function<std::string(const std::vector<Rest>&)>;

/// Writes images as `write_images` does, with a record in the first one, or beside it. The file that has the record takes its
/// place last: where it lies, all of them lie.
void write_recorded(const std::vector<ImageFile>& images, const RecordOf& record_of);

/// A PNG with a record in it, behind its first chunk.
RecordedFile png_with_record(Bytes png, const std::string& record);

/// All bytes of a file; none if it cannot be read.
std::optional<Bytes> read_if_there(const std::filesystem::path& file);

/// Finds the record in the bytes of an EXR or a PNG.
std::optional<RecordedFile> find_record(Bytes bytes);

} // namespace fathom::io
