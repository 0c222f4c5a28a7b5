// What the bench hands on to programs: CSV as its definition has it, and files that are whole or not there.

#include "catch.hpp"
#include "judge.hpp"
#include "table.hpp"

#include <fathom/error.hpp>

namespace {

using fathom::bench::Table;

std::string without_origin(const std::string& csv) {
    const auto& info = oracle::device(fathom::Arithmetic::fp64).info();
    CHECK(contains(csv, info.platform));
    CHECK(contains(csv, fathom::bench::commit()));
    std::string rest;
    for (std::size_t at = 0; at < csv.size();) {
        const std::size_t end = csv.find('\n', at);
        const std::string line = csv.substr(at, end - at);
        rest += line.substr(!contains(line, "method,") ? line.find("\"a, b\"") : line.find("method,"));
        rest += '\n';
        at = end + 1;
    }
    return rest;
}

Table table() {
    Table table(oracle::device(fathom::Arithmetic::fp64), {"method", "says", "ms", "error"});
    table.add({"a, b", "\"yes\"", 1234.5678, std::nan("")});
    return table;
}

} // namespace

TEST_CASE("bench: a table is CSV with quotes where they are needed and nothing for what is no number", "[bench]") {
    CHECK(without_origin(table().csv()) == "method,says,ms,error\n\"a, b\",\"\"\"yes\"\"\",1234.57,\n");
}

TEST_CASE("bench: rows of another length are refused, and files that cannot be written leave nothing", "[bench]") {
    Table short_row = table();
    CHECK_THROWS_AS(short_row.add({1.0}), std::logic_error);
    const auto folder = std::filesystem::temp_directory_path() / "fathom_bench_table";
    std::filesystem::remove_all(folder);
    CHECK_THROWS_AS(table().write_csv(folder / "none.csv"), fathom::Error);
    std::filesystem::create_directory(folder);
    table().write_csv(folder / "one.csv");
    std::ifstream file(folder / "one.csv");
    CHECK(std::string(std::istreambuf_iterator<char>(file), {}) == table().csv());
    CHECK(std::distance(std::filesystem::directory_iterator(folder), {}) == 1);
    std::filesystem::remove_all(folder);
}
