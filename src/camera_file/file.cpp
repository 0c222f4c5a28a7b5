// Files are read whole. Whatever is wrong with one is said in a line.
#include "file.hpp"

#include "require.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <span>
#include <string_view>
#include <system_error>

namespace fs = std::filesystem;

namespace fathom::io {
namespace {

/// Bytes of the UTF-8 character at the beginning of a text; 0 when there is none, or when it is a control character.
std::size_t length_of_character(std::string_view text) {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
    if (byte(0) < 0x80)
        return byte(0) >= ' ' && byte(0) != 0x7f;
    const std::size_t length = byte(0) >= 0xf0 ? 4 : byte(0) >= 0xe0 ? 3 : 2;
    if (byte(0) < 0xc2 || byte(0) > 0xf4 || text.size() < length)
        return 0;
    for (std::size_t i = 1; i < length; ++i)
        if ((byte(i) & 0xc0) != 0x80)
            return 0;
    return length == 2 && byte(0) == 0xc2 && byte(1) < 0xa0 ? 0 : length; // U+0080 to U+009F control terminals
}

/// A file that is read with the system's own calls: its errors have numbers, a stream's have not.
class OpenFile {
public:
    explicit OpenFile(const fs::path& file) : file_(file), number_(::open(file.c_str(), O_RDONLY | O_CLOEXEC)) {
        if (number_ < 0)
            refuse_read(file_, errno);
    }
    OpenFile(const OpenFile&) = delete;
    OpenFile& operator=(const OpenFile&) = delete;
    ~OpenFile() { ::close(number_); }

    std::size_t size() const {
        struct stat status;
        if (::fstat(number_, &status) != 0)
            refuse_read(file_, errno);
        return static_cast<std::size_t>(status.st_size);
    }
    /// Fills the bytes as far as the file goes, and says how far that is.
    std::size_t read(std::span<unsigned char> bytes) {
        std::size_t filled = 0;
        while (filled < bytes.size()) {
            const auto count =
                ::read(number_, bytes.data() + filled, std::min<std::size_t>(bytes.size() - filled, 1u << 30));
            if (count < 0 && errno == EINTR)
                continue;
            if (count < 0)
                refuse_read(file_, errno);
            if (count == 0)
                break;
            filled += static_cast<std::size_t>(count);
        }
        return filled;
    }

private:
    const fs::path& file_;
    int number_;
};

fs::file_status status_of(const fs::path& name) {
    std::error_code error;
    const auto status = fs::status(name, error);
    check_answer(name, error);
    return status;
}

std::string line_about(const fs::path& file, const std::string& what) {
    auto line = file.string();
    std::replace_if(
        line.begin(), line.end(), [](unsigned char c) { return c < ' '; }, ' ');
    return line + ": " + printable(what);
}

constexpr const char* check_disk = "check the disk that it lies on";
constexpr const char* raise_limit = "raise the limit of open files (ulimit -n)";

// Has the process, or the machine, as many open files as it may?
bool is_too_many(int error) {
    return error == EMFILE || error == ENFILE;
}

[[noreturn]] void refuse_unanswered(const fs::path& file, const std::string& what) {
    throw UnansweredRead(line_about(file, what));
}

} // namespace

std::string printable(std::string_view text) {
    constexpr const char* digits = "0123456789abcdef";
    std::string line;
    while (!text.empty()) {
        const auto length = std::max<std::size_t>(length_of_character(text), 1);
        if (length_of_character(text) > 0) {
            line += text.substr(0, length);
        } else if (const auto byte = static_cast<unsigned char>(text[0]); byte < ' ') {
            line += ' ';
        } else {
            line += "\\x";
            line += {digits[byte >> 4], digits[byte & 15]};
        }
        text.remove_prefix(length);
    }
    return line;
}

void refuse(const fs::path& file, const std::string& what) {
    throw Error(line_about(file, what));
}

std::string reason(int error) {
    return std::generic_category().message(error);
}

void refuse_read(const fs::path& file, int error) {
    const bool forbidden = error == EACCES || error == EPERM;
    const std::string what = "cannot be read: " + reason(error) + "; ";
    if (is_too_many(error))
        refuse(file, what + raise_limit);
    if (forbidden || error == ENOENT)
        refuse(file, what + (forbidden ? "check its permissions" : check_disk));
    refuse_unanswered(file, what + check_disk);
}

void refuse_write(const fs::path& file, const std::string& what, int error, const std::string& cure) {
    const bool full = error == ENOSPC || error == EDQUOT || error == EFBIG;
    refuse(file, what + ": " + reason(error) + "; " +
                     (full                    ? "free some space or write elsewhere"
                      : error == EIO          ? check_disk
                      : error == ENAMETOOLONG ? "choose a shorter name"
                      : is_too_many(error)    ? raise_limit
                                              : cure));
}

void refuse_making(const fs::path& file, const std::string& what, int error, const std::string& cure) {
    try {
        refuse_write(file, what, error, cure);
    } catch (const Error& refused) {
        for (const int of_folder : {EACCES, EPERM, EROFS, ENOENT, ENOTDIR, EEXIST})
            if (error == of_folder)
                throw UnwritableFolder(refused.what());
        throw;
    }
}

// FNV-1a, http://www.isthe.com/chongo/tech/comp/fnv
std::string digest(std::string_view text) {
    std::uint64_t hash = 0xcbf29ce484222325;
    for (const char c : text)
        hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
    std::array<char, 17> digits{};
    std::snprintf(digits.data(), digits.size(), "%016llx", static_cast<unsigned long long>(hash));
    return digits.data();
}

std::string host_name() {
    std::array<char, 256> name{};
    return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "unknown";
}

// Names that no file can have are not there, and nothing is in a folder that may not be looked into.
void check_answer(const fs::path& name, const std::error_code& error) {
    constexpr std::array no{0, ENOENT, ENOTDIR, EACCES, ENAMETOOLONG, ELOOP};
    if (std::ranges::find(no, error.value()) == no.end())
        refuse_read(name, error.value());
}

bool is_there(const fs::path& name) {
    return fs::exists(status_of(name));
}

bool is_folder(const fs::path& name) {
    return fs::is_directory(status_of(name));
}

bool is_file(const fs::path& name) {
    return fs::is_regular_file(status_of(name));
}

std::string lower(std::string text) {
    std::ranges::transform(text, text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return text;
}

std::string extension_of(const fs::path& file) {
    const std::string extension = lower(file.extension().native());
    return extension == ".tiff" ? ".tif" : extension == ".jpeg" ? ".jpg" : extension;
}

bool is_same(const fs::path& a, const fs::path& b) {
    const auto found = [](const fs::path& name, struct stat& status) {
        if (::stat(name.c_str(), &status) == 0)
            return true;
        check_answer(name, {errno, std::generic_category()});
        return false;
    };
    struct stat of_a, of_b;
    return found(a, of_a) && found(b, of_b) && of_a.st_dev == of_b.st_dev && of_a.st_ino == of_b.st_ino;
}

fs::path followed(const fs::path& file, std::error_code& error) {
    fs::path target = file;
    for (int links = 0; fs::is_symlink(fs::symlink_status(target, error)); ++links) {
        if (links == 40) // as many as the system follows
            refuse(file, "is a link that leads to itself, or one of over 40 links; remove it");
        const fs::path next = fs::read_symlink(target, error);
        if (error)
            break;
        target = target.parent_path() / next;
    }
    return target;
}

fs::path whole_path(const fs::path& name) {
    std::error_code error;
    const fs::path absolute = fs::absolute(name, error); // of an empty name there is none
    if (error)
        return name;
    std::error_code none;
    const fs::path path = fs::weakly_canonical(followed(absolute, none), error);
    check_answer(name, error);
    return (error ? absolute : path).lexically_normal();
}

std::vector<std::string> names_in(const fs::path& folder) {
    std::vector<std::string> names;
    std::error_code error;
    for (fs::directory_iterator each(folder, error), last; !error && each != last; each.increment(error))
        names.push_back(each->path().filename().native());
    check_answer(folder, error);
    return names;
}

void check_readable(const fs::path& file) {
    require_rounding();
    std::error_code error;
    const auto status = fs::status(file, error);
    if (status.type() == fs::file_type::not_found)
        refuse(file, "there is no such file; check the path");
    if (error)
        refuse_read(file, error.value());
    if (fs::is_directory(status))
        refuse(file, "is a folder; name a file in it");
    if (!fs::is_regular_file(status))
        refuse(file, "is no regular file; copy what it delivers into one");
    if (fs::file_size(file, error) == 0 && !error)
        refuse(file, "is empty; write it again");
    OpenFile opened(file);
}

Bytes read_file(const fs::path& file, std::uint64_t most) {
    check_readable(file);
    OpenFile opened(file);
    if (opened.size() > most)
        refuse(file, "has " + std::to_string(opened.size()) + " bytes, and at most " + std::to_string(most) +
                         " are read of such a file; check that it is the right one");
    Bytes bytes(opened.size());
    if (opened.read(bytes) < bytes.size())
        refuse_unanswered(file, std::string("cannot be read to its end; ") + check_disk);
    return bytes;
}

std::string text_of_file(const fs::path& file, std::uint64_t most) {
    const Bytes bytes = read_file(file, most);
    constexpr Bytes::value_type mark[] = {0xef, 0xbb, 0xbf};
    const bool is_marked = std::ranges::mismatch(bytes, mark).in2 == std::end(mark);
    return {bytes.begin() + (is_marked ? std::ssize(mark) : 0), bytes.end()};
}

Bytes read_head(const fs::path& file, std::size_t most) {
    Bytes bytes(most);
    bytes.resize(OpenFile(file).read(bytes));
    return bytes;
}

} // namespace fathom::io
