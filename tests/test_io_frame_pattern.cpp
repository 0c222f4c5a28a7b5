// Names of frames: what stands for a number, how the number is written, and which files on disk have such a name. The
// values that a file gives to frames. And ranges of frames: fileseq's answers, which tests/frame_ranges/make has written down.
#include "io_files.hpp"
#include "places.hpp"

#include "sequence/frames.hpp"

#include <fathom/error.hpp>

using namespace fathom::sequence;
using namespace fathom::test;

namespace {

std::string put_text(const fs::path& file, const std::string& text) {
    return put(file, text).string();
}

std::string name(const std::string& pattern, Frame frame) {
    const auto found = FramePattern::in(pattern);
    return found ? found->name(frame) : "none";
}

using Values = std::map<Frame, std::string>;

void check_refused(const std::string& range, const std::string& said) {
    INFO(range);
    CHECK_THROWS_WITH(parse_frames(range), ContainsSubstring(said) && ContainsSubstring(range));
}

} // namespace

TEST_CASE("frame patterns: a zero has no minus, which its name would lose") {
    const auto of = FramePattern::of("shot.-00.exr");
    REQUIRE(of);
    CHECK(of->second == 0);
    CHECK(of->first.name(0) == "shot.-00.exr");
    CHECK(FramePattern::of("shot.-01.exr")->second == -1);
}

TEST_CASE("frame patterns: a name may have more zeros than a number has figures") {
    const std::string file = "shot." + std::string(60, '0') + "12.exr";
    const auto of = FramePattern::of(file);
    REQUIRE(of);
    CHECK(of->second == 12);
    CHECK(of->first.name(12) == file);
    CHECK(of->first.name(-3) == "shot.-" + std::string(60, '0') + "3.exr");
}

TEST_CASE("frame patterns: printf's and # are the same number") {
    CHECK(name("shot.%04d.exr", 7) == "shot.0007.exr");
    CHECK(name("shot.####.exr", 7) == "shot.0007.exr");
    CHECK(name("shot.%d.exr", 7) == "shot.7.exr");
    CHECK(name("shot.#.exr", 7) == "shot.7.exr");
    CHECK(name("####", 1) == "0001");
    CHECK(name("a#1.####.exr", 7) == "a#1.0007.exr");  // the last run
    CHECK(name("a/c#.%03d.exr", 7) == "a/c#.007.exr"); // % before #
    CHECK(name("s%02d/shot.%04d.%d.exr", 7) == "s07/shot.0007.7.exr");
    for (const char* plain : {"shot.exr", "shot.@@@@.exr", "100%.exr", "%s.exr", "%.exr", "a#/b.exr", "me@work/b.exr",
                              "%", "", "%099d.exr"})
        CHECK(name(plain, 1) == "none");
}

TEST_CASE("frame patterns: numbers are padded as printf pads them, and read back") {
    char expected[64];
    for (const int figures : {1, 2, 3, 4, 9})
        for (const Frame frame : {-123456, -1000, -999, -12, -1, 0, 1, 9, 10, 99, 100, 9999, 10000, 123456}) {
            const std::string pattern = "a-%0" + std::to_string(figures) + "d.exr";
            std::snprintf(expected, sizeof expected, "a-%0*d.exr", figures, static_cast<int>(frame));
            CHECK(name(pattern, frame) == expected);
            CHECK(FramePattern::in(pattern)->frame(expected) == frame);
            CHECK(name("a-" + std::string(static_cast<std::size_t>(figures), '#') + ".exr", frame) == expected);
        }
    const FramePattern four = *FramePattern::in("a.####.exr"), twice = *FramePattern::in("a%d/b%03d.exr");
    for (const char* other : {"a.1.exr", "a.00001.exr", "a.-0.exr", "a.-01.exr", "a.0001.png", "b.0001.exr",
                              "a.000x.exr", "a..exr", "a.exr", "a.+001.exr", "a.99999999999999999999.exr"})
        CHECK(!four.frame(other));
    CHECK(twice.frame("a7/b007.exr") == 7);
    CHECK(!twice.frame("a7/b008.exr"));
    CHECK(FramePattern::in("v#0.exr")->frame("v120.exr") == 12);
}

TEST_CASE("frame patterns: the pattern that a file is of, by its last figures") {
    const auto check = [](const std::string& file, const std::string& pattern, Frame frame) {
        const auto found = FramePattern::of(file);
        REQUIRE(found);
        CHECK(found->first.text() == pattern);
        CHECK(found->second == frame);
        CHECK(found->first.name(frame) == file);
    };
    check("shot.0007.exr", "shot.%04d.exr", 7);
    check("s2/shot_v3.0007.exr", "s2/shot_v3.%04d.exr", 7);
    check("shot.0007.v2.exr", "shot.%04d.v2.exr", 7);
    check("shot_010_frame0007.png", "shot_010_frame%04d.png", 7);
    check("depth12.tar.exr", "depth%01d.tar.exr", 12);
    check("12.exr", "%01d.exr", 12);
    check("shot.-003.exr", "shot.%04d.exr", -3);
    check("-3.exr", "%01d.exr", -3);
    check("shot-003.exr", "shot-%03d.exr", 3);
    check("0", "%01d", 0);
    for (const char* none : {"shot.exr", "v2/shot.exr", "", "a/", ".exr", "9999999999999.exr"})
        CHECK(!FramePattern::of(none));

    using Files = std::vector<std::string>;
    CHECK(FramePattern::common(Files{"a.998.exr", "a.1000.exr"})->first.text() == "a.%01d.exr");
    CHECK(FramePattern::common(Files{"a.10000.exr", "a.0998.exr"})->first.text() == "a.%04d.exr");
    for (const Files& none :
         {Files{"a.1.exr", "b.2.exr"}, Files{"a.01.exr", "a.1.exr"}, Files{"a.1.exr", "a.exr"}, Files{}})
        CHECK(!FramePattern::common(none));
}

TEST_CASE("frame patterns: the files that are there") {
    const TempFolder folder;
    for (const std::string file :
         {"a.0001.exr", "a.0010.exr", "a.-002.exr", "a.12345.exr", "a.1.exr", "a.0003.png", "b.0004.exr"})
        put_text(folder / file, "x");
    fs::create_directory(folder / "a.0005.exr");
    const std::string pattern = (folder / "a.####.exr").string();
    Values expected;
    for (const Frame frame : {-2, 1, 10, 12345})
        expected[frame] = name(pattern, frame);
    CHECK(FramePattern::in(pattern)->files() == expected);

    for (const std::string part : {"s01/f.1.exr", "s02/f.2.exr", "s02/f.3.exr", "s3/f.3.exr"}) {
        fs::create_directories((folder / part).parent_path());
        put_text(folder / part, "x");
    }
    const std::string deep = (folder / "s%02d/f.%d.exr").string();
    CHECK(FramePattern::in(deep)->files() == Values{{1, name(deep, 1)}, {2, name(deep, 2)}});
    CHECK(FramePattern::in((folder / "nowhere/a.#.exr").string())->files().empty());

    CHECK(matching_files((folder / "a.000?.*").string()) ==
          std::vector<std::string>{(folder / "a.0001.exr").string(), (folder / "a.0003.png").string()});
    put_text(folder / "s02/notes.txt", "x");
    put_text(folder / "s02/.hidden.exr", "x");
    CHECK(matching_files((folder / "s0?/*.[e]*").string()) ==
          std::vector<std::string>{(folder / "s01/f.1.exr").string(), (folder / "s02/f.2.exr").string(),
                                   (folder / "s02/f.3.exr").string()});
    CHECK(matching_files((folder / "s0?/f.2.exr").string()) ==
          std::vector<std::string>{(folder / "s02/f.2.exr").string()});
    CHECK(matching_files((folder / "s0?").string()).empty()); // folders
    CHECK(depth_files_in(folder / "s02") ==
          std::vector<std::string>{(folder / "s02/f.2.exr").string(), (folder / "s02/f.3.exr").string()});
}

TEST_CASE("frame values: CSV and JSON say the same") {
    const TempFolder folder;
    const Values expected{{-1, "0.5"}, {1, "2.5"}, {2, "inf"}, {10, "640,360"}};
    for (const std::string text : {"-1,0.5\n1,2.5\n2,inf\n10,\"640,360\"\n",
                                   "frame,focus_at\r\n1,2.5\r\n\r\n# a pull\r\n2,inf\r\n10,\"640,360\"\r\n-1,0.5",
                                   "\xEF\xBB\xBF"
                                   "focus-at;frame;radius\n0.5;-1;7\n2.5;1;7\n inf ; 2 ; 7\n640,360;10;7\n",
                                   "frame\tvalue\n-1\t0.5\n0001\t2.5\n2\tinf\n10\t640,360\n",
                                   " {\"-1\": 0.5, \"1\": 2.5, \"2\": \"inf\", \"10\": [640, 360]}"}) {
        INFO(text);
        CHECK(read_frame_values(put_text(folder / "values", text), "focus-at") == expected);
    }
    CHECK(read_frame_values(put_text(folder / "values", "1,\"say \"\"so\"\"\""), "x") == Values{{1, "say \"so\""}});
}

TEST_CASE("frame values: what is wrong is told with its line and the cure") {
    const TempFolder folder;
    const std::vector<std::pair<std::string, std::string>> cases{
        {"1,2\n1,3\n", "line 2: frame 1 is there twice"},
        {"1,2\nx,3\n", "line 2: 'x' is no frame"},
        {"1,2\n2\n", "line 2 has 1 cell instead of 2"},
        {"1,2\n2,640,360\n", "line 2 has 3 cells instead of 2; put a value that holds ','"},
        {"a,b\n1,2\n", "no column \"frame\""},
        {"frame,a,b\n1,2,3\n", "no column \"focus\""},
        {"frame\n1\n", "no column \"focus\""},
        {"frame,radius\n1,2\n", "no column \"focus\""},
        {"# nothing\n", "holds no frame"},
        {"", "is empty"},
        {"{}", "holds no frame"},
        {"{\"a\": 1}", "'a' is no frame"},
        {"{\"1\": 1, \"01\": 2}", "frame 1 is there twice"},
        {"{\"1\": 1, \"1\": 2}", "1"},
        {"{\"1\": ", "line 1"},
    };
    for (const auto& [text, said] : cases) {
        INFO(text);
        const std::string file = put_text(folder / "values.csv", text);
        CHECK_THROWS_WITH(read_frame_values(file, "focus"), ContainsSubstring(said) && ContainsSubstring(file));
    }
    CHECK_THROWS_WITH(read_frame_values(folder / "none.csv", "focus"), ContainsSubstring("there is no such file"));
}

TEST_CASE("frame ranges: fileseq reads them alike") {
    std::ifstream file(std::string(places::sources) + "/tests/frame_ranges/fileseq.txt");
    std::string line;
    std::getline(file, line); // which version it is of
    std::size_t read = 0, refused = 0;
    while (std::getline(file, line)) {
        const std::size_t tab = line.rfind('\t');
        const std::string range = line.substr(0, tab),
                          expected = range.find_first_of("y:") == range.npos ? line.substr(tab + 1) : "refused";
        std::string found;
        try {
            for (const Frame frame : parse_frames(range))
                found += (found.empty() ? "" : ",") + std::to_string(frame);
            ++read;
        } catch (const std::invalid_argument& error) {
            CHECK(std::string(error.what()).starts_with("'" + range + "': "));
            found = "refused";
            ++refused;
        }
        INFO(range);
        CHECK(found == expected);
    }
    std::cout << read << " ranges read, " << refused << " refused\n";
    CHECK(read > 30);
    CHECK(refused > 15);
}

TEST_CASE("frame ranges: what is wrong is told with the cure") {
    check_refused("1-5z2", "'1-5z2' is no frames; write");
    check_refused("", "names no frame");
    check_refused("1-5y1", "'1-5y1' is no frames");
    check_refused("1-", "'1-' is no frames");
    check_refused("1-5x0", "a step must be above 0");
    check_refused("1.5", "'1.5' is no frames");
    check_refused("1 2", "'1 2' is no frames");
    check_refused("9999999999999", "more than 12 figures");
}

TEST_CASE("frame ranges: ten million frames are read, and more refused without using their memory") {
    CHECK(parse_frames("1-10000000").size() == most_frames);
    CHECK(parse_frames("1-999999999999x100001").size() == 999'999'999'998 / 100'001 + 1);
    for (const std::string range :
         {"1-10000001", "1-5000000,5000001-10000001", "-999999999999-999999999999", "1-999999999999x2"})
        check_refused(range, "more than 10000000 frames");
}
