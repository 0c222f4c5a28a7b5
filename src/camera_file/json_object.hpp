#pragma once

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include <filesystem>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace fathom::io {

/// The JSON in a file, or in the part of it that is given. Refused: syntax errors (with line and column), keys given
/// twice.
nlohmann::json parsed_json(const std::filesystem::path& file);
nlohmann::json parsed_json(const std::filesystem::path& file, std::span<const unsigned char> bytes);

/// A value as it stands in the file, cut where a line gets too long.
std::string shown(const nlohmann::json& value);

/// Is it a list of numbers only?
bool are_numbers(const nlohmann::json& list);

/// Gives an object the keys of another, and so its objects, of which both keep what only one has.
void merge(nlohmann::json& keys, const nlohmann::json& by);

/// A JSON object, whose keys may be known. Whatever is not as it should be is refused with the file, the key, its value and what would
/// be right.
class JsonObject {
public:
    /// `file` stands in messages: a file's name, or what takes its place. `name`: of the object within the file, empty for the
    /// outermost. `known`: its keys; of none any key will do. `above`: the known keys of the object that holds this one.
    JsonObject(std::filesystem::path file, std::string name, nlohmann::json value,
               const std::vector<std::string>& known = {}, const std::vector<std::string>& above = {});

    /// Takes over what another object has and this one has not. Nothing is checked.
    void fill_in(const nlohmann::json& defaults);

    /// The object under a key.
    JsonObject object(const std::string& key, const std::vector<std::string>& known = {}) const;

    const std::filesystem::path& file() const { return file_; }

    bool has(const std::string& key) const { return value_.contains(key); }

    /// Has the object under `object` this key?
    bool has_within(const std::string& object, const std::string& key) const {
        return has(object) && value_[object].contains(key);
    }
    /// Is the value this one?
    bool holds(const std::string& key, const nlohmann::json& value) const { return has(key) && value_[key] == value; }

    std::optional<double> number(const std::string& key) const;
    std::optional<double> number_or_infinity(const std::string& key) const; ///< "infinity" is a number, too
    std::optional<int> count(const std::string& key) const;                 ///< a whole number from 1 on
    std::optional<bool> boolean(const std::string& key) const;
    std::optional<std::string> string(const std::string& key) const;
    std::optional<std::vector<double>> numbers(const std::string& key, std::size_t how_many) const;
    std::optional<std::vector<double>> list(const std::string& key) const; ///< any count of numbers
    std::optional<Eigen::Matrix4d> matrix(const std::string& key) const;   ///< four rows of four

    double needed(const std::string& key) const; ///< a number that must be there

    /// One of several words.
    template <typename Value>
    std::optional<Value> one_of(const std::string& key,
                                std::initializer_list<std::pair<const char*, Value>> choices) const {
        if (!has(key))
            return std::nullopt;
        std::vector<std::string> words;
        for (const auto& [word, value] : choices) {
            if (value_[key] == word)
                return value;
            words.emplace_back(word);
        }
        refuse_word(key, words);
    }

    /// `known`: the words that the value may be.
    [[noreturn]] void refuse_word(const std::string& key, const std::vector<std::string>& known) const;
    /// `must`: "must be positive".
    [[noreturn]] void refuse_value(const std::string& key, const std::string& must) const;
    /// `why`: "the encoding needs it".
    [[noreturn]] void refuse_missing(const std::string& key, const std::string& why) const;
    [[noreturn]] void refuse_whole(const std::string& what) const;

private:
    /// A value that `fits`; any other is refused.
    template <typename Value, typename Fits>
    std::optional<Value> value(const std::string& key, const Fits& fits, const std::string& must) const;
    void check_keys(const std::vector<std::string>& above) const;
    std::string path_to(const std::string& key) const { return name_.empty() ? key : name_ + "." + key; }

    std::filesystem::path file_;
    std::string name_;
    std::vector<std::string> known_;
    nlohmann::json value_;
};

/// The camera file that a text NAME:key=value,... or key=value,... stands for. `source` stands in messages where a
/// file's name would.
nlohmann::json parsed_preset(const std::string& source, const std::string& text);

} // namespace fathom::io
