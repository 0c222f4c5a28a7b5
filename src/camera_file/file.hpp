#pragma once

#include <fathom/error.hpp>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

namespace fathom::io {

using Bytes = std::vector<unsigned char>;

/// Text that does no harm on a terminal: control characters become spaces, bytes that are no UTF-8 become \xNN.
std::string printable(std::string_view text);

/// Throws `fathom::Error`, one printable line: the file, then what is wrong with it and what would be right.
[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& what);

/// What the system says of an error's number.
std::string reason(int error);

/// Refuses a file that cannot be written for a reason of the system; `cure` is what helps unless the disk is full.
[[noreturn]] void refuse_write(const std::filesystem::path& file, const std::string& what, int error,
                               const std::string& cure);

/// A folder in which no file can be made, whatever it is called.
class UnwritableFolder : public Error {
public:
    using Error::Error;
};

/// The same for a file that cannot be made. Throws: UnwritableFolder where the folder is the reason.
[[noreturn]] void refuse_making(const std::filesystem::path& file, const std::string& what, int error,
                                const std::string& cure);

/// 16 figures for a text, which are the same on all machines.
std::string digest(std::string_view text);

/// This machine's name.
std::string host_name();

/// The disk of a file does not answer. Nobody knows what it holds, so that what is guessed about other files is not about it.
class UnansweredRead : public Error {
public:
    using Error::Error;
};

/// What `read` gives, or nothing where the file has no such thing.
template <typename Read>
auto if_any(const Read& read) -> std::optional<decltype(read())> {
    try {
        return read();
    } catch (const UnansweredRead&) {
        throw;
    } catch (const Error&) {
        return std::nullopt;
    }
}

/// Refuses a file that cannot be read for a reason of the system. Throws: UnansweredRead unless it is forbidden or not there.
[[noreturn]] void refuse_read(const std::filesystem::path& file, int error);

/// Is there anything of this name, a folder, a file? Throws: Error when the disk does not answer.
bool is_there(const std::filesystem::path& name);
bool is_folder(const std::filesystem::path& name);
bool is_file(const std::filesystem::path& name);

std::string lower(std::string text);

/// Names for a message, between commas; of a long list the first ones.
template <typename Each, typename Name = std::identity>
std::string listed(const std::vector<Each>& all, const Name& name = {}) {
    constexpr std::size_t most = 24;
    std::string list;
    for (std::size_t i = 0; i < std::min(all.size(), most); ++i)
        list += (i ? ", " : "") + std::invoke(name, all[i]);
    return all.size() > most ? list + ", and " + std::to_string(all.size() - most) + " more" : list;
}

/// What a file's name says of its type: in small letters, .tif for .tiff and .jpg for .jpeg.
std::string extension_of(const std::filesystem::path& file);

/// Refuses a name of which the system says this, unless it says that there is no such file or that it may not be seen.
void check_answer(const std::filesystem::path& name, const std::error_code& error);

/// Are these two names of one file? Not where one of them is none. Throws: Error when the disk does not answer.
bool is_same(const std::filesystem::path& a, const std::filesystem::path& b);

/// The file that a link points to, there or not.
std::filesystem::path followed(const std::filesystem::path& file, std::error_code& error);

/// The path of a file from the root on, without links as far as there are folders; a link that is the file itself is followed to
/// what is not there yet, too. Throws: Error when the disk does not answer.
std::filesystem::path whole_path(const std::filesystem::path& name);

/// Names of the files and folders in a folder; none if there is no such folder. Throws: Error when the disk does not answer.
std::vector<std::string> names_in(const std::filesystem::path& folder);

/// Refuses what cannot be read as a file: missing, a directory, empty, no permission.
void check_readable(const std::filesystem::path& file);

/// Bytes of the longest text.
constexpr std::uint64_t most_text = 256 << 20;

/// The whole file; one of more than `most` bytes is refused before it is read.
Bytes read_file(const std::filesystem::path& file, std::uint64_t most = most_text);

/// A text without the byte order mark of UTF-8 that some editors put before it.
std::string text_of_file(const std::filesystem::path& file, std::uint64_t most = most_text);

/// The first bytes of a file that is there; fewer than `most` of a shorter one.
Bytes read_head(const std::filesystem::path& file, std::size_t most);

} // namespace fathom::io
