// How far a word is from another, for suggestions.
#include "edit_distance.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace fathom::io {

std::size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> before, above(b.size() + 1), row(b.size() + 1);
    std::iota(above.begin(), above.end(), std::size_t{0});
    for (std::size_t i = 1; i <= a.size(); ++i) {
        row[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            row[j] = std::min({above[j] + 1, row[j - 1] + 1, above[j - 1] + (a[i - 1] != b[j - 1])});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                row[j] = std::min(row[j], before[j - 2] + 1);
        }
        before = std::exchange(above, row);
    }
    return above.back();
}

std::vector<std::string> nearest_words(std::vector<std::string> known, std::string_view word, std::size_t most) {
    word = word.substr(0, 100); // longer than whatever is known
    std::vector<std::pair<std::size_t, std::string>> far;
    for (std::string& each : known) {
        const std::size_t edits = edit_distance(each, word);
        far.emplace_back(edits, std::move(each));
    }
    std::ranges::stable_sort(far, {}, &std::pair<std::size_t, std::string>::first);
    far.resize(std::min(far.size(), most));
    known.clear();
    for (auto& each : far)
        known.push_back(std::move(each.second));
    return known;
}

} // namespace fathom::io
