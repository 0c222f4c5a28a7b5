#pragma once

#include "io/formats.hpp"

#include <OpenEXR/IexErrnoExc.h>
#include <OpenEXR/ImfMultiPartInputFile.h>

#include <cerrno>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <string>

namespace fathom::io {

/// The file, once the lengths in its header were compared with its own. Throws: Error, and what OpenEXR does.
Imf::MultiPartInputFile open_exr(const std::filesystem::path& file);

/// Each thread of OpenEXR takes memory for a whole tile, however small the image is.
/// Throws: Error, if a tile of more than 16 MiB has more pixels than its image.
void check_tiles(const std::filesystem::path& file, const Imf::MultiPartInputFile& exr);

/// Bytes of a file that is there.
std::uint64_t size_of_file(const std::filesystem::path& file);

/// OpenEXR's reason without the file's name, which stands in front of our line already.
std::string exr_reason(const std::string& what);

/// What `read` gives. What OpenEXR throws becomes an Error: the file is damaged, or its disk does not answer.
template <typename Read>
auto refusing_damage(const std::filesystem::path& file, const Read& read) {
    try {
        return within_memory(file, read);
    } catch (const Error&) {
        throw;
    } catch (const Iex::EioExc&) { // exceptions of OpenEXR have a type for each number
        refuse_read(file, EIO);
    } catch (const Iex::EstaleExc&) {
        refuse_read(file, ESTALE);
    } catch (const std::exception& error) {
        refuse(file, "is damaged or cut short (" + exr_reason(error.what()) + "); render or copy it again");
    }
}

} // namespace fathom::io
