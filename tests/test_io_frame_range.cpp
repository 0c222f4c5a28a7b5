// Frame ranges: closed forms, and fileseq's answers, which tests/frame_ranges/make has written down.
#include "catch.hpp"
#include "places.hpp"

#include "sequence/frames.hpp"

using namespace fathom::sequence;

namespace {

using Frames = std::vector<Frame>;

void check_refused(const std::string& range, const std::string& said) {
    INFO(range);
    CHECK_THROWS_WITH(parse_frames(range), ContainsSubstring(said) && ContainsSubstring(range));
}

} // namespace

TEST_CASE("frame ranges: steps, from one frame to another and back") {
    CHECK(parse_frames("1-10x3") == Frames{1, 4, 7, 10});
    CHECK(parse_frames("10-1x4") == Frames{10, 6, 2});
    CHECK(parse_frames("-3--1,0007") == Frames{-3, -2, -1, 7});
    CHECK(parse_frames("5,1-6x2") == Frames{5, 1, 3});
}

TEST_CASE("frame ranges: fileseq reads them alike") {
    std::ifstream file(std::string(fathom::test::places::sources) + "/tests/frame_ranges/fileseq.txt");
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
