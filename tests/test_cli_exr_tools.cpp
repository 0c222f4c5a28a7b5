// OpenEXR files that other programs made: what OpenImageIO's oiiotool says of a file's header it says of a result's, too.
#include "program.hpp"
#include "real_inputs.hpp"

using namespace fathom;
using namespace fathom::test;

namespace {

/// What a shell prints.
std::string printed(const std::string& command) {
    std::string text;
    FILE* pipe = popen((command + " 2>&1").c_str(), "r");
    REQUIRE(pipe);
    std::array<char, 4096> piece;
    while (const std::size_t count = fread(piece.data(), 1, piece.size(), pipe))
        text.append(piece.data(), count);
    INFO(command << "\n" << text);
    REQUIRE(pclose(pipe) == 0);
    return text;
}

bool is_installed(const std::string& program) {
    return std::system(("command -v " + program + " > /dev/null").c_str()) == 0;
}

using Header = std::map<std::string, std::string>;

/// What oiiotool says of each part's header, but for how the pixels are packed.
std::vector<Header> headers_of(const std::string& file) {
    static const std::set<std::string> packing{"channel list",   "compression",          "tile size",
                                               "oiio:subimages", "openexr:chunkCount",   "openexr:lineOrder",
                                               "MIP-map levels", "openexr:roundingmode", "textureformat"};
    std::vector<Header> headers(1);
    std::istringstream lines(printed("oiiotool --info -v -a '" + file + "'"));
    for (std::string line; std::getline(lines, line);) {
        if (line.starts_with(" subimage") && !contains(line, "subimage  0"))
            headers.emplace_back();
        const auto colon = line.find(": ");
        if (!line.starts_with("    ") || colon == std::string::npos)
            continue;
        const std::string name = line.substr(4, colon - 4);
        if (!packing.contains(name) && !contains(name, "subimages"))
            headers.back()[name] = line.substr(colon + 2);
    }
    return headers;
}

} // namespace

TEST_CASE("exr tools: oiiotool reads every result by the names that other programs know", "[slow]") {
    if (!is_installed("oiiotool")) {
        WARN("skipped: there is no oiiotool (openimageio-tools)");
        return;
    }
    const Folder folder;
    const std::string camera = folder / "camera.json", file = folder / "a.exr", picture = folder / "out/seen.tif";
    write(camera, R"({"perspective": {"fov_y_deg": 60, "near": 0.1}, "encoding": "inverse", "scale": 10})");
    printed("oiiotool --pattern fill:topleft=2,0,0,1,1:topright=3,1,0,0,1:bottomleft=4,0,1,0,1:bottomright=5,1,1,1,1 "
            "24x16 5 --chnames Z,R,G,B,A -o '" +
            file + "'");
    struct Case {
        Arguments arguments;
        std::string own, alone, appended; ///< the first channel's names
    };
    for (const Case& each :
         {Case{{"linearize"}, "Z", "Y", "Fathom.linear.Z"}, Case{{"ssao", "--radius", "1"}, "AO", "Y", "Fathom.AO.G"},
          Case{{"normals"}, "N.X", "N.X", "Fathom.N.X"}, Case{{"unproject"}, "P.X", "P.X", "Fathom.P.X"},
          Case{{"dof-masks", "--circle", "9,99"}, "coc", "Y", "Fathom.coc.B"},
          Case{{"dof", "--color", file, "--circle", "9,99"}, "R", "R", "Fathom.dof.R"},
          Case{{"fog", "--color", file, "--density", "0.1"}, "R", "R", "Fathom.fog.R"}}) {
        const std::string alone = folder / "out/alone.exr", appended = folder / "out/appended.exr";
        const Arguments command = joined(each.arguments, {file, "--camera", camera, "--quiet"});
        check_done(joined(command, {"-o", alone}));
        check_done(joined(command, {"-o", appended, "--append"}));
        for (const auto& [result, name] : {std::pair(alone, each.alone), {appended, each.appended}}) {
            INFO(result << " " << name);
            printed("oiiotool '" + result + "' --ch " + name + " -d float -o '" + picture + "'");
            CHECK(same(channel(picture), channel(alone, each.own)));
        }
    }
}

TEST_CASE("exr tools: headers and windows of Blender's and a studio's files survive", "[real]") {
    if (!is_installed("oiiotool")) {
        WARN("skipped: there is no oiiotool (openimageio-tools)");
        return;
    }
    const Folder folder;
    for (const char* name :
         {"blender/perspective/sharp.exr", "blender/orthographic/sharp.exr", "openexr/beachball-singlepart.exr"}) {
        const fs::path file = fs::path(places::shared_data) / name;
        if (!fs::exists(file)) {
            WARN("skipped: ../shared/data is not there");
            return;
        }
        const std::string result = folder / "out/n.exr", own = file.parent_path() / "camera.json",
                          other = folder / "camera.json";
        write(other, R"({"perspective": {"fov_y_deg": 60}, "encoding": "view-z", "missing": 0})");
        const bool is_blender = fs::exists(own);
        check_done({"normals", file.string(), "--camera", is_blender ? own : other, "-o", result, "--quiet",
                    "--channel", is_blender ? "ViewLayer.Depth.Z" : "Z"});
        CHECK(headers_of(result) == headers_of(file.string()));
    }
}
