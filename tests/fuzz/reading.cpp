#include "reading.hpp"

#include "camera_file/file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <stdexcept>
#include <system_error>

namespace fs = std::filesystem;

namespace fathom::fuzz {
namespace {

/// A folder that goes with the process. /dev/shm is memory, where there is one.
class Folder {
public:
    Folder() {
        std::error_code none;
        const fs::path above = fs::is_directory("/dev/shm", none) ? fs::path("/dev/shm") : fs::temp_directory_path();
        std::string name = above / "fathom-fuzz-XXXXXX";
        expect(::mkdtemp(name.data()) != nullptr, "no folder can be made in " + above.native());
        path_ = name;
    }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
    ~Folder() {
        std::error_code none;
        fs::remove_all(path_, none);
    }
    const fs::path& path() const { return path_; }

private:
    fs::path path_;
};

} // namespace

void expect(bool good, const std::string& what) {
    if (!good)
        throw std::logic_error(what);
}

void check_line(std::string_view line, std::string_view subject) {
    constexpr std::size_t longest = 4000;
    expect(line.size() <= longest, "a message of " + std::to_string(line.size()) + " bytes");
    expect(io::printable(line) == line, "a message that is no printable line: " + io::printable(line));
    expect(line.find(subject) != line.npos, "a message that does not name its file: " + std::string(line));
}

fs::path file_with(const std::string& name, Input content) {
    static const Folder folder;
    fs::path path = folder.path() / name;
    const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    const bool written =
        file >= 0 && ::write(file, content.data(), content.size()) == static_cast<ssize_t>(content.size());
    expect(file >= 0 && ::close(file) == 0 && written, "cannot write " + path.native());
    return path;
}

const Target* find_target(std::string_view name) {
    for (const auto all : {text_targets(), image_targets()})
        for (const Target& target : all)
            if (target.name == name)
                return &target;
    return nullptr;
}

} // namespace fathom::fuzz
