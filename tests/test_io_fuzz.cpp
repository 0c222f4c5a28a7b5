// The corpus of the fuzzer, once more and without it: whatever was found stays found.
#include "catch.hpp"
#include "places.hpp"

#include "targets.hpp"

namespace fs = std::filesystem;
using namespace fathom::fuzz;

TEST_CASE("fuzz: what was found stays read or refused in one line", "[io]") {
    constexpr std::size_t largest_corpus = 300'000; // bytes
    std::size_t inputs = 0, size = 0;
    for (const auto all : {text_targets(), image_targets()})
        for (const Target& target : all) {
            std::size_t of_target = 0;
            for (const auto& entry :
                 fs::directory_iterator(fs::path(fathom::test::places::sources) / "tests/fuzz/corpus" / target.name)) {
                std::ifstream file(entry.path(), std::ios::binary);
                Bytes bytes(std::istreambuf_iterator<char>(file), {});
                INFO(entry.path());
                CHECK(bytes.size() <= 2048);
                CHECK_NOTHROW(target.run(bytes));
                // The fuzzer's repairs leave what is whole as it is, and are safe whatever they get.
                const Bytes whole = bytes;
                if (target.repair)
                    target.repair(bytes);
                CHECK((bytes == whole || entry.path().filename().string().starts_with("found")));
                ++of_target;
                size += bytes.size();
            }
            INFO(target.name);
            CHECK(of_target >= 3);
            inputs += of_target;
        }
    std::cout << "fuzz: " << inputs << " inputs of " << size << " bytes\n";
    CHECK(size <= largest_corpus);
}
