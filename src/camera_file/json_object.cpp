// A JSON object, whose keys may be known.
#include "json_object.hpp"

#include "file.hpp"
#include "known_words.hpp"

#include <algorithm>
#include <functional>
#include <limits>
#include <set>
#include <string_view>

namespace fathom::io {

using nlohmann::json;

std::string shown(const json& value) {
    constexpr std::size_t most = 60;
    const auto text = value.dump();
    return text.size() > most ? text.substr(0, most) + "..." : text;
}

namespace {

/// Refuses a key that is given twice, and values that are nested too deeply: whoever prints or compares one recurses too often.
/// json::parse with a callback could do it, too, but looks through the whole of an array after each of its objects.
class Checked : public nlohmann::json_sax<json> {
public:
    explicit Checked(const std::filesystem::path& file) : file_(file) {}
    bool null() override { return true; }
    bool boolean(bool) override { return true; }
    bool number_integer(number_integer_t) override { return true; }
    bool number_unsigned(number_unsigned_t) override { return true; }
    bool number_float(number_float_t, const string_t&) override { return true; }
    bool string(string_t&) override { return true; }
    bool binary(binary_t&) override { return true; }
    bool start_object(std::size_t) override { return opened(); }
    bool start_array(std::size_t) override { return opened(); }
    bool end_object() override { return closed(); }
    bool end_array() override { return closed(); }
    bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception&) override { return false; }
    bool key(string_t& key) override {
        if (!open_.back().insert(key).second)
            refuse(file_, "key " + shown(key) + " is given twice; keep one");
        return true;
    }

private:
    bool opened() {
        constexpr std::size_t deepest = 100;
        open_.emplace_back();
        if (open_.size() > deepest)
            refuse(file_,
                   "is no JSON of a camera: its values are nested more than " + std::to_string(deepest) + " deep");
        return true;
    }
    bool closed() {
        open_.pop_back();
        return true;
    }

    const std::filesystem::path& file_;
    std::vector<std::set<std::string>> open_; ///< keys of the objects that the parser is in
};

} // namespace

bool are_numbers(const json& list) {
    return list.is_array() && std::ranges::all_of(list, [](const json& each) { return each.is_number(); });
}

void merge(json& keys, const json& by) {
    for (const auto& [key, value] : by.items())
        if (value.is_object() && keys.contains(key) && keys[key].is_object())
            keys[key].update(value);
        else
            keys[key] = value;
}

json parsed_json(const std::filesystem::path& file, std::span<const unsigned char> bytes) {
    Checked checked(file);
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    json::sax_parse(text, &checked);
    try {
        return json::parse(text);
    } catch (const json::exception& error) {
        // "[json.exception.parse_error.101] parse error at line 3, column 5: ..."
        std::string what = error.what();
        what.erase(0, what.find("] ") == std::string::npos ? 0 : what.find("] ") + 2);
        refuse(file, "is no JSON: " + what.substr(0, what.find("; last read"))); // which may be anything but text
    }
}

json parsed_json(const std::filesystem::path& file) {
    return parsed_json(file, read_file(file));
}

JsonObject::JsonObject(std::filesystem::path file, std::string name, json value, const std::vector<std::string>& known,
                       const std::vector<std::string>& above)
    : file_(std::move(file)), name_(std::move(name)), known_(known), value_(std::move(value)) {
    if (!value_.is_object())
        refuse(file_,
               (name_.empty() ? "holds " : "\"" + name_ + "\": ") + shown(value_) + "; it must be an object, {...}");
    if (!known_.empty())
        check_keys(above);
}

void JsonObject::check_keys(const std::vector<std::string>& above) const {
    const auto holds = [](const std::vector<std::string>& keys, const std::string& key) {
        return std::find(keys.begin(), keys.end(), key) != keys.end();
    };
    for (const auto& item : value_.items()) {
        const std::string& key = item.key();
        if (holds(known_, key))
            continue;
        const std::string unknown = "unknown key " + shown(path_to(key)) + "; ";
        if (key == "reversed" &&
            (name_ == "lens" || name_ == "intrinsics" || name_ == "orthographic" || has("lens") || has("intrinsics")))
            refuse(file_, unknown + "beside \"" + (name_ == "orthographic" ? name_ : "intrinsics") +
                              "\" a reversed depth buffer has \"depth_range\": [1, 0]");
        if (const std::string object = object_of(key); !object.empty() && object != name_)
            refuse(file_, unknown + "it belongs in \"" + object + "\": {...}");
        if (const std::string meant = key_for(key); !meant.empty())
            refuse(file_, unknown + "write " + meant);
        if (holds(above, key))
            refuse(file_, unknown + "it belongs beside \"" + name_ + "\", not in it");
        if (const std::string nearest = nearest_words(known_, key, 1).front(); is_near(nearest, key))
            refuse(file_, unknown + "the nearest known one is \"" + path_to(nearest) + "\"");
        refuse(file_,
               unknown +
                   "no key is like it: is it a camera of another program? A camera file has, for instance, "
                   "\"intrinsics\": {\"fx\": ..., \"fy\": ..., \"cx\": ..., \"cy\": ...} (docs/cameras.md says which "
                   "number goes where)");
    }
}

void JsonObject::fill_in(const json& defaults) {
    for (const auto& [key, value] : defaults.items())
        if (!has(key))
            value_[key] = value;
}

JsonObject JsonObject::object(const std::string& key, const std::vector<std::string>& known) const {
    return {file_, path_to(key), value_.at(key), known, known_};
}

template <typename Value, typename Fits>
std::optional<Value> JsonObject::value(const std::string& key, const Fits& fits, const std::string& must) const {
    if (!has(key))
        return std::nullopt;
    if (!std::invoke(fits, value_[key]))
        refuse_value(key, must);
    return value_[key].get<Value>();
}

std::optional<double> JsonObject::number(const std::string& key) const {
    return value<double>(key, &json::is_number, "must be a number");
}

std::optional<double> JsonObject::number_or_infinity(const std::string& key) const {
    if (holds(key, "infinity"))
        return std::numeric_limits<double>::infinity();
    return value<double>(key, &json::is_number, "must be a number or \"infinity\"");
}

std::optional<int> JsonObject::count(const std::string& key) const {
    const auto fits = [](const json& each) {
        return each.is_number_integer() && each >= 1 && each <= std::numeric_limits<int>::max();
    };
    return value<int>(key, fits, "must be a whole number from 1 on");
}

std::optional<bool> JsonObject::boolean(const std::string& key) const {
    return value<bool>(key, &json::is_boolean, "must be true or false");
}

std::optional<std::string> JsonObject::string(const std::string& key) const {
    return value<std::string>(key, &json::is_string, "must be a word in quotes");
}

std::optional<std::vector<double>> JsonObject::numbers(const std::string& key, std::size_t how_many) const {
    const auto fits = [&](const json& each) { return are_numbers(each) && each.size() == how_many; };
    return value<std::vector<double>>(key, fits, "must be a list of " + std::to_string(how_many) + " numbers");
}

std::optional<std::vector<double>> JsonObject::list(const std::string& key) const {
    return value<std::vector<double>>(key, are_numbers, "must be numbers, [...]");
}

std::optional<Eigen::Matrix4d> JsonObject::matrix(const std::string& key) const {
    if (!has(key))
        return std::nullopt;
    const auto& rows = value_[key];
    if (!rows.is_array() || rows.size() != 4)
        refuse_value(key, "must be four rows of four numbers");
    Eigen::Matrix4d matrix;
    for (Eigen::Index r = 0; r < 4; ++r) {
        const auto& row = rows[static_cast<std::size_t>(r)];
        if (!row.is_array() || row.size() != 4)
            refuse_value(key, "must be four rows of four numbers, but row " + std::to_string(r) + " is " + shown(row));
        for (Eigen::Index c = 0; c < 4; ++c) {
            const auto& element = row[static_cast<std::size_t>(c)];
            if (!element.is_number())
                refuse(file_, "\"" + path_to(key) + "\": row " + std::to_string(r) + ", column " + std::to_string(c) +
                                  " is " + shown(element) + "; it must be a finite number");
            matrix(r, c) = element.get<double>();
        }
    }
    return matrix;
}

double JsonObject::needed(const std::string& key) const {
    if (!has(key))
        refuse_missing(key, "it must be a number");
    return *number(key);
}

void JsonObject::refuse_word(const std::string& key, const std::vector<std::string>& known) const {
    constexpr std::size_t most = 12; // words that a line takes
    if (known.size() > most && value_[key].is_string())
        refuse_value(key, "is unknown; the nearest is \"" +
                              nearest_words(known, value_[key].get<std::string>(), 1).front() + "\"");
    std::string must = "must be one of ";
    for (std::size_t i = 0; i < known.size(); ++i)
        must += (i == 0 ? "\"" : ", \"") + known[i] + "\"";
    if (value_[key].is_string())
        must += "; the nearest is \"" + nearest_words(known, value_[key].get<std::string>(), 1).front() + "\"";
    refuse_value(key, must);
}

void JsonObject::refuse_value(const std::string& key, const std::string& must) const {
    refuse(file_, "\"" + path_to(key) + "\": " + shown(value_.at(key)) + " " + must);
}

void JsonObject::refuse_missing(const std::string& key, const std::string& why) const {
    refuse(file_, "\"" + path_to(key) + "\" is missing; " + why);
}

void JsonObject::refuse_whole(const std::string& what) const {
    refuse(file_, name_.empty() ? what : "\"" + name_ + "\": " + what);
}

} // namespace fathom::io
