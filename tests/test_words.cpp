// One word for one thing: the words of tests/words.txt stand nowhere in the project.

#include "catch.hpp"
#include "places.hpp"

#include <cctype>

namespace {

namespace fs = std::filesystem;

const fs::path root = fathom::test::places::sources;

std::string content(const fs::path& file) {
    std::ostringstream all;
    all << std::ifstream(file).rdbuf();
    return all.str();
}

/// What a file says to the compiler, and what it says to people. Both keep their lines; what belongs to neither is blank.
struct Parts {
    std::string code, text;
};

// Strings are text, and comments if `with_comments`; all else is code.
Parts parts_of_code(const std::string& source, bool with_comments) {
    Parts parts{source, source};
    enum { in_code, in_string, in_raw_string, in_character, in_line, in_block } state = in_code;
    std::string raw_end;
    for (std::size_t i = 0; i < source.size(); ++i) {
        const auto is = [&](const std::string& sign) { return source.compare(i, sign.size(), sign) == 0; };
        const auto was = state;
        std::size_t last = i; // of the sign that ends or begins a part
        if (state == in_code) {
            if (is("//") || is("/*")) {
                state = source[i + 1] == '/' ? in_line : in_block;
                last = i + 1;
            } else if (is("R\"")) {
                last = source.find('(', i);
                raw_end = ")" + source.substr(i + 2, last - i - 2) + "\"";
                state = in_raw_string;
            } else if (source[i] == '"') {
                state = in_string;
            } else if (source[i] == '\'' && (i == 0 || std::isalnum(static_cast<unsigned char>(source[i - 1])) == 0)) {
                state = in_character;
            }
        } else if (((state == in_string || state == in_character) && source[i] == '\\')) {
            last = i + 1;
        } else if ((state == in_string && source[i] == '"') || (state == in_character && source[i] == '\'') ||
                   (state == in_line && source[i] == '\n')) {
            state = in_code;
        } else if (state == in_raw_string && is(raw_end)) {
            state = in_code;
            last = i + raw_end.size() - 1;
        } else if (state == in_block && is("*/")) {
            state = in_code;
            last = i + 1;
        }
        const auto part = was == in_code ? state : was;
        const bool comment = part == in_line || part == in_block;
        for (; i <= last && i < source.size(); ++i) {
            if (source[i] == '\n')
                continue;
            if (part != in_code)
                parts.code[i] = ' ';
            if (part == in_code || (comment && !with_comments))
                parts.text[i] = ' ';
        }
        i = last;
    }
    return parts;
}

// Only headings are read.
std::string headings(const std::string& page) {
    std::istringstream lines(page);
    std::string all;
    for (std::string line; std::getline(lines, line);)
        all += (line.starts_with("#") ? line : "") + "\n";
    return all;
}

bool is_word(char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0;
}

/// Where whole words stand: blank, _ and - are alike, line ends and comment signs too, and a plural is found.
std::size_t find_words(const std::string& text, const std::string& words) {
    const auto same = [](char c, char pattern) {
        return pattern == ' ' ? c == ' ' || c == '_' || c == '-'
                              : std::tolower(static_cast<unsigned char>(c)) == pattern;
    };
    for (auto at = text.begin();; ++at) {
        at = std::search(at, text.end(), words.begin(), words.end(), same);
        if (at == text.end())
            return std::string::npos;
        auto end = at + static_cast<std::ptrdiff_t>(words.size());
        if (end != text.end() && *end == 's')
            ++end;
        if ((at == text.begin() || !is_word(*(at - 1))) && (end == text.end() || !is_word(*end)))
            return static_cast<std::size_t>(at - text.begin());
    }
}

std::string trimmed(const std::string& text) {
    const auto first = text.find_first_not_of(' '), last = text.find_last_not_of(' ');
    return first == std::string::npos ? "" : text.substr(first, last - first + 1);
}

struct Word {
    std::string where, pattern, instead;
};

std::vector<Word> read_words() {
    std::istringstream lines(content(root / "tests/words.txt"));
    std::vector<Word> words;
    for (std::string line; std::getline(lines, line);) {
        if (line.empty() || line.starts_with("#"))
            continue;
        std::istringstream fields(line);
        Word word;
        std::getline(fields, word.where, '|');
        std::getline(fields, word.pattern, '|');
        std::getline(fields, word.instead);
        words.push_back({trimmed(word.where), trimmed(word.pattern), trimmed(word.instead)});
    }
    return words;
}

struct Source {
    std::string name;
    Parts parts;
};

std::vector<Source> read_sources() {
    std::vector<Source> sources;
    const auto add = [&](const fs::path& file) {
        const std::string extension = file.extension().string(), name = file.lexically_relative(root).generic_string();
        if (extension == ".md")
            sources.push_back({name, {"", headings(content(file))}});
        else if (extension == ".cpp" || extension == ".hpp" || extension == ".h" || extension == ".cl")
            sources.push_back({name, parts_of_code(content(file), name.starts_with("include/"))});
    };
    for (const char* folder : {"include", "src", "kernels", "bench", "examples", "tests", "docs"})
        for (const auto& entry : fs::recursive_directory_iterator(root / folder))
            if (entry.is_regular_file() && entry.path().filename() != "test_words.cpp")
                add(entry.path());
    add(root / "README.md");
    add(root / "CONTRIBUTING.md");
    return sources;
}

} // namespace

TEST_CASE("words: code, text and comments are told apart", "[words]") {
    const Parts parts = parts_of_code("int a; // near reach\nf(\"b\\\"c\", 'd'); /* e */ auto r = R\"(g)\";", false);
    CHECK(parts.code == "int a;              \nf(      ,    );         auto r =       ;");
    CHECK(trimmed(parts.text.substr(parts.text.find('\n') + 1)).starts_with("\"b\\\"c\""));
    CHECK(parts.text.find("near") == std::string::npos);
    CHECK(parts_of_code("/// near reach\nint a;", true).text.starts_with("/// near reach"));
}

TEST_CASE("words: a pattern is found as whole words only", "[words]") {
    CHECK(find_words("int near_reach;", "near reach") == 4);
    CHECK(find_words("--near-reach", "near reach") == 2);
    CHECK(find_words("two Peers met", "peer") == 4);
    CHECK(find_words("appear, peered", "peer") == std::string::npos);
    CHECK(headings("# A title\ntext\n## B\n") == "# A title\n\n## B\n");
}

TEST_CASE("words: what tests/words.txt lists stands nowhere", "[words]") {
    const std::vector<Word> words = read_words();
    REQUIRE(words.size() >= 30);
    const std::vector<Source> sources = read_sources();
    REQUIRE(sources.size() >= 100);
    for (const Word& word : words) {
        REQUIRE((word.where == "code" || word.where == "text" || word.where == "all"));
        REQUIRE(!word.pattern.empty());
        REQUIRE(!word.instead.empty());
        for (const Source& source : sources) {
            const auto look = [&](const std::string& text) {
                const std::size_t at = find_words(text, word.pattern);
                if (at != std::string::npos)
                    FAIL_CHECK(source.name
                               << ':'
                               << 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n')
                               << ": \"" << word.pattern << "\"; say " << word.instead);
            };
            if (word.where != "text")
                look(source.parts.code);
            if (word.where != "code")
                look(source.parts.text);
        }
    }
    std::cout << words.size() << " words, " << sources.size() << " files\n";
}
