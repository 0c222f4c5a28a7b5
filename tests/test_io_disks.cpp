// What is said of files of which the disk says nothing, and of names that are none.
#include "io_files.hpp"

#include "camera_file/file.hpp"

#include <cerrno>

using namespace fathom;
using namespace fathom::test;

TEST_CASE("disks: one that does not answer is told from a file that is forbidden or not there", "[io]") {
    CHECK_THROWS_AS(io::refuse_read("a.exr", EIO), io::UnansweredRead);
    CHECK_THROWS_AS(io::check_answer("a.exr", {EIO, std::generic_category()}), io::UnansweredRead);
    for (const int error : {EACCES, ENOENT}) {
        try {
            io::refuse_read("a.exr", error);
        } catch (const io::UnansweredRead&) {
            FAIL("is told as a disk that does not answer");
        } catch (const Error&) {
        }
        CHECK_NOTHROW(io::check_answer("a.exr", {error, std::generic_category()}));
    }
}

TEST_CASE("disks: two names of one file are the same, and no name of none is", "[io]") {
    const TempFolder folder;
    const fs::path file = put(folder / "a", std::string("text")), link = folder / "b";
    CHECK_FALSE(io::is_same(file, link));
    CHECK_FALSE(io::is_same(link, link));
    fs::create_symlink(file, link);
    CHECK(io::is_same(file, link));
    CHECK(io::whole_path(link) == fs::canonical(file));
    CHECK(io::whole_path(folder / "none" / ".." / "a") == fs::canonical(file));
    CHECK(io::whole_path("").empty());
}
