#pragma once

#include "catch.hpp"

#include <fathom/error.hpp>

#include <fcntl.h>
#include <unistd.h>

/// Folders, files and refusals, for the tests of everything that touches a disk.
namespace fathom::test {

namespace fs = std::filesystem;
using Bytes = std::vector<unsigned char>;

/// An empty folder that is gone with everything in it at the end of the test.
class TempFolder {
public:
    TempFolder() {
        std::string name = (fs::temp_directory_path() / "fathom-test-XXXXXX").string();
        REQUIRE(::mkdtemp(name.data()) != nullptr);
        path_ = name;
    }
    TempFolder(const TempFolder&) = delete;
    TempFolder& operator=(const TempFolder&) = delete;
    ~TempFolder() {
        std::error_code ignored;
        fs::remove_all(path_, ignored);
    }

    fs::path operator/(const std::string& name) const { return path_ / name; }
    const fs::path& path() const { return path_; }
    std::ptrdiff_t files() const { return std::distance(fs::directory_iterator(path_), fs::directory_iterator()); }

private:
    fs::path path_;
};

inline fs::path put(const fs::path& file, const Bytes& bytes) {
    std::ofstream(file, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    return file;
}

inline fs::path put(const fs::path& file, const std::string& text) {
    return put(file, Bytes(text.begin(), text.end()));
}

inline Bytes get(const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return Bytes(std::istreambuf_iterator<char>(stream), {});
}

/// What `act` is refused with: one line.
template <typename Act>
std::string refusal(Act act) {
    try {
        act();
    } catch (const Error& error) {
        const std::string line = error.what();
        CHECK(std::none_of(line.begin(), line.end(), [](unsigned char c) { return c < ' '; }));
        return line;
    }
    return "(nothing was refused)";
}

inline void check_says(const std::string& line, const std::vector<std::string>& parts) {
    INFO(line);
    for (const auto& part : parts) {
        INFO("must say: " << part);
        CHECK(contains(line, part));
    }
}

/// The same of what `act` is refused with.
template <std::invocable Act>
void check_says(Act act, const std::vector<std::string>& parts) {
    check_says(refusal(act), parts);
}

/// What reaches the process's stderr, whoever writes it.
class StderrCapture {
public:
    explicit StderrCapture(const TempFolder& folder) : file_(folder / "stderr"), kept_(::dup(2)) {
        const int into = ::open(file_.c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0600);
        ::dup2(into, 2);
        ::close(into);
    }
    StderrCapture(const StderrCapture&) = delete;
    StderrCapture& operator=(const StderrCapture&) = delete;
    ~StderrCapture() { end(); }

    std::string end() {
        if (kept_ >= 0) {
            ::dup2(kept_, 2);
            ::close(std::exchange(kept_, -1));
        }
        const auto bytes = get(file_);
        return {bytes.begin(), bytes.end()};
    }

private:
    fs::path file_;
    int kept_;
};

} // namespace fathom::test
