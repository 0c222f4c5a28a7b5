// fathom presets.
#include "io_files.hpp"
#include "program.hpp"

#include <fathom/presets.hpp>

#include <nlohmann/json.hpp>

using namespace fathom;
using namespace fathom::test;

TEST_CASE("presets program: lists every source with its formula and what it needs") {
    const Outcome list = check_done({"presets"});
    const Outcome json = check_done({"presets", "--json"});
    const auto all = nlohmann::json::parse(json.out);
    CHECK(all.size() == presets().size());
    for (const Preset& preset : presets()) {
        INFO(preset.name);
        CHECK(("\n" + list.out).find("\n" + preset.name + " ") != std::string::npos);
        CHECK(contains(list.out, preset.formula + "; needs "));
        const Outcome one = check_done({"presets", preset.name});
        CHECK(contains(one.out, preset.source));

        // The camera file to start from is one, as soon as each question mark is a number.
        std::string file = one.out.substr(one.out.find("\n{") + 1);
        const TempFolder folder;
        if (contains(file, '?'))
            check_says([&] { read_camera(put(folder / "camera.json", file)); }, {"camera.json", "\"?\"", "number"});
        for (std::size_t at = 0, value = 1; (at = file.find("\"?\"")) != std::string::npos; ++value)
            file.replace(at, 3, std::to_string(value));
        CHECK(read_camera(put(folder / "camera.json", file)).preset == preset.name);
    }
    check_refused({"presets", "kinekt"}, 2, "did you mean kinect?");
}
