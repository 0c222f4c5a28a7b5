// The page is page.html with page.css, elements.js, page.js and the data in their places.
// The data is JSON inside of a script element. Only </script, <!-- and <script mean something there, so every < is written
// as \u003c, which is the same text in JSON; > and & go the same way.
// Source: HTML standard, 4.12.1.3, Restrictions for contents of script elements.
#include "page.hpp"

#include <fmt/format.h>

#include <map>
#include <string_view>

const std::map<std::string, std::string>& fathom_report_files(); // what the build embeds

namespace fathom::cli {
namespace {

std::string escaped(const std::string& json) {
    std::string text;
    text.reserve(json.size());
    for (const char c : json)
        if (c == '<' || c == '>' || c == '&')
            text += fmt::format("\\u{:04x}", static_cast<int>(c));
        else
            text += c;
    return text;
}

} // namespace

std::string page_of(const nlohmann::ordered_json& data) {
    const auto& files = fathom_report_files();
    const std::map<std::string_view, std::string> parts{
        {"style", files.at("page.css")},
        {"script", files.at("elements.js") + files.at("page.js")},
        {"data", escaped(data.dump(-1, ' ', true, nlohmann::ordered_json::error_handler_t::replace))}};
    std::string page;
    std::string_view rest = files.at("page.html");
    for (std::size_t begin; (begin = rest.find("{{")) != rest.npos;) {
        const std::size_t end = rest.find("}}", begin);
        page += rest.substr(0, begin);
        page += parts.at(rest.substr(begin + 2, end - begin - 2));
        rest.remove_prefix(end + 2);
    }
    return page += rest;
}

} // namespace fathom::cli
