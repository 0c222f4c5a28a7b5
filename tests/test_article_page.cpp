// docs/research.md names the test that holds each claim: names that drift from the tests fail here. So do the
// patterns of `fathom_tests "..."` on the other pages.

#include "catch.hpp"
#include "places.hpp"

#include <regex>

namespace {

const std::filesystem::path root = fathom::test::places::sources;

std::string text_of(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    INFO(file.string());
    REQUIRE(stream);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

struct Case {
    std::string name, tags;
};

// The string literals that begin at a place, neighbours joined.
std::string literal(const std::string& text, std::size_t& at) {
    std::string value;
    for (;;) {
        const std::size_t quote = text.find_first_not_of(" \n", at);
        if (quote == std::string::npos || text[quote] != '"')
            return value;
        for (at = quote + 1; text[at] != '"'; ++at) {
            if (text[at] == '\\')
                ++at;
            value += text[at];
        }
        ++at;
    }
}

std::vector<Case> all_cases() {
    std::vector<Case> cases;
    for (const auto& entry : std::filesystem::directory_iterator(root / "tests")) {
        if (entry.path().extension() != ".cpp")
            continue;
        const std::string text = text_of(entry.path()), macro = "TEST_CASE(";
        for (std::size_t at = text.find(macro); at != std::string::npos; at = text.find(macro, at)) {
            at += macro.size();
            Case found{literal(text, at), {}};
            if (text[at] == ',') {
                ++at;
                found.tags = literal(text, at);
            }
            if (!found.name.empty())
                cases.push_back(found);
        }
    }
    return cases;
}

// One name of a pattern: a tag, or a name with `*` for anything.
bool matches(const std::string& pattern, const Case& test) {
    if (pattern.front() == '[')
        return contains(test.tags, pattern);
    std::size_t at = 0, begin = 0;
    bool first = true;
    for (;;) {
        const std::size_t star = pattern.find('*', begin);
        const std::string part = pattern.substr(begin, star - begin);
        const std::size_t place = test.name.find(part, at);
        if (place == std::string::npos || (first && place != 0))
            return false;
        at = place + part.size();
        if (star == std::string::npos)
            return part.empty() || at == test.name.size();
        begin = star + 1;
        first = false;
    }
}

} // namespace

TEST_CASE("pages: every test that the articles' page names exists, and it names every test of the articles",
          "[pages]") {
    const std::string page = text_of(root / "docs/research.md");
    std::set<std::string> names, named;
    const std::vector<Case> cases = all_cases();
    for (const Case& each : cases)
        names.insert(each.name);

    // Of what stands between backticks, only names of tests are words, a colon and a space.
    const std::regex name_of_test("[A-Za-z]+: .+");
    std::istringstream parts(page);
    std::string part;
    for (bool code = false; std::getline(parts, part, '`'); code = !code)
        if (code && std::regex_match(part, name_of_test))
            named.insert(part);
    REQUIRE(named.size() >= 20);
    for (const std::string& name : named) {
        INFO("docs/research.md names a test that does not exist: " << name);
        REQUIRE(names.count(name) == 1);
    }
    for (const Case& each : cases) {
        if (!contains(each.tags, "[articles]"))
            continue;
        INFO("docs/research.md does not name the test " << each.name);
        REQUIRE(named.count(each.name) == 1);
    }
}

TEST_CASE("pages: every pattern of tests in the documentation finds a test", "[pages]") {
    const std::vector<Case> cases = all_cases();
    const std::regex command("(?:fathom_tests \"|`\"(?=[a-z_-]+: ))([^\"]+)\""); // or a name in a table
    int patterns = 0;
    std::vector<std::filesystem::path> pages{root / "README.md"};
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root / "docs"))
        if (entry.path().extension() == ".md")
            pages.push_back(entry.path());
    for (const auto& file : pages) {
        const std::string page = text_of(file);
        for (std::sregex_iterator found(page.begin(), page.end(), command), end; found != end; ++found) {
            std::istringstream list((*found)[1]);
            for (std::string pattern; std::getline(list, pattern, ',');) {
                INFO(file.string() << ": fathom_tests \"" << pattern << "\" finds no test");
                REQUIRE(
                    std::any_of(cases.begin(), cases.end(), [&](const Case& each) { return matches(pattern, each); }));
                ++patterns;
            }
        }
    }
    REQUIRE(patterns > 10);
}
