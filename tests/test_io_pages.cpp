// The pages: camera files in them are read, C++ in them is compiled as an example, and their links lead somewhere.
#include "io_files.hpp"
#include "places.hpp"

#include <fathom/camera.hpp>
#include <fathom/io.hpp>

#include <cctype>
#include <regex>

using namespace fathom;
using namespace fathom::test;

namespace {

const fs::path root = places::sources;

std::string text_of(const fs::path& file) {
    const Bytes bytes = get(file);
    return {bytes.begin(), bytes.end()};
}

std::vector<fs::path> pages() {
    std::vector<fs::path> files{root / "README.md", root / "CONTRIBUTING.md"};
    for (const auto& entry : fs::recursive_directory_iterator(root / "docs"))
        if (entry.path().extension() == ".md")
            files.push_back(entry.path());
    return files;
}

// Everything that a pattern's first group matches.
std::vector<std::string> all(const std::string& text, const std::string& pattern) {
    const std::regex regex(pattern);
    std::vector<std::string> found;
    for (std::sregex_iterator i(text.begin(), text.end(), regex), end; i != end; ++i)
        found.push_back((*i)[1]);
    return found;
}

// What stands between ``` lines of a language.
std::vector<std::string> blocks(const std::string& text, const std::string& language) {
    std::vector<std::string> found;
    const std::string begin = "\n```" + language + "\n", end = "\n```";
    for (std::size_t at = text.find(begin); at != std::string::npos; at = text.find(begin, at + 1)) {
        const std::size_t first = at + begin.size();
        found.push_back(text.substr(first, text.find(end, first) - first));
    }
    return found;
}

// A heading's anchor, as GitHub makes it: small letters, figures, _ and -; a space is a -.
std::string anchor_of(const std::string& heading) {
    std::string anchor;
    for (const char c : heading)
        if (c == ' ')
            anchor += '-';
        else if (std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_')
            anchor += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return anchor;
}

/// How depth of a packing lies in memory once it is read.
Storage storage_of(std::optional<Packing> packing) {
    if (packing == Packing::uint8)
        return Storage::uint8;
    if (packing == Packing::uint24 || packing == Packing::uint24_high)
        return Storage::uint24;
    if (packing == Packing::rgb_red_low || packing == Packing::rgb_red_high)
        return Storage::bgr8_red_low;
    return Storage::float32;
}

std::set<std::string> anchors(const fs::path& page) {
    std::set<std::string> found;
    for (const std::string& heading : all(text_of(page), "\n#+ ([^\n]+)"))
        found.insert(anchor_of(heading));
    return found;
}

} // namespace

TEST_CASE("pages: every camera file in them is read, and decodes", "[io]") {
    const TempFolder folder;
    std::size_t count = 0;
    for (const fs::path& page : pages()) {
        const std::string text = text_of(page);
        std::vector<std::string> files = blocks(text, "json");
        for (const std::string& keys : all(text, "\\| `(\"[a-z_]+\": [^`]+)` \\|\n")) // a row of the README's table
            files.push_back("{" + keys + "}");
        for (const std::string& json : files) {
            INFO(page.native() << ": " << json);
            const CameraFile file = read_camera(put(folder / "camera.json", json));
            const Camera camera = camera_for(file, file.camera.width ? file.camera.width : 64,
                                             file.camera.height ? file.camera.height : 48);
            if (camera.lens)
                CHECK_NOTHROW(PixelRays(camera));
            else
                CHECK_NOTHROW(depth_form(camera, storage_of(file.packing)));
            ++count;
        }
    }
    CHECK(count >= 9);
}

TEST_CASE("pages: every preset with its keys in them is a camera", "[io]") {
    std::size_t count = 0;
    for (const fs::path& page : pages()) {
        for (const std::string& preset : all(text_of(page), "`([a-z0-9-]+:[a-z_]+=[^`…]+)`")) {
            INFO(page.native() << ": " << preset);
            if (!contains(preset, "scale=")) // which stands for what a text says about it alone
                CHECK_NOTHROW(preset_file(preset));
            ++count;
        }
        for (const std::string& preset : all(text_of(page), "--preset ([a-z0-9-]+:[a-z_]+=[^ `]+)"))
            CHECK_NOTHROW(preset_file(preset));
    }
    CHECK(count >= 8);
}

TEST_CASE("pages: all C++ in them stands in a file of examples/", "[io]") {
    std::vector<std::string> examples;
    for (const auto& entry : fs::directory_iterator(root / "examples"))
        if (entry.path().extension() == ".cpp")
            examples.push_back(text_of(entry.path()));
    std::size_t count = 0;
    for (const fs::path& page : pages())
        for (const std::string& code : blocks(text_of(page), "cpp")) {
            INFO(page.native() << ":\n" << code);
            CHECK(std::ranges::any_of(examples, [&](const std::string& e) { return contains(e, code); }));
            ++count;
        }
    CHECK(count >= 2);
}

TEST_CASE("pages: every link within the project leads to a file and a heading", "[io]") {
    std::size_t count = 0;
    for (const fs::path& page : pages())
        for (const std::string& link : all(text_of(page), "\\]\\(([^)\\s]+)\\)")) {
            if (link.starts_with("http"))
                continue;
            INFO(page.native() << ": " << link);
            const std::size_t hash = link.find('#');
            const fs::path target = hash == 0 ? page : page.parent_path() / link.substr(0, hash);
            CHECK(fs::exists(target));
            if (hash != std::string::npos && target.extension() == ".md")
                CHECK(anchors(target).contains(link.substr(hash + 1)));
            ++count;
        }
    CHECK(count > 100);
}
