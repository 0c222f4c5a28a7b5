// What an OpenEXR file says that it holds, from its header alone.
#include "formats.hpp"

#include <fathom/error.hpp>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfPartType.h>

namespace fathom {
namespace {

std::string type_of(const Imf::Header& part, Imf::PixelType type) {
    const char* name = type == Imf::HALF ? "half" : type == Imf::FLOAT ? "float" : "uint";
    return (part.hasType() && Imf::isDeepData(part.type()) ? "deep " : "") + std::string(name);
}

} // namespace

std::vector<Channel> list_channels(const std::filesystem::path& file) try {
    io::check_readable(file);
    std::vector<Channel> channels;
    if (!io::begins_like_exr(file))
        return channels;
    const Imf::MultiPartInputFile exr(file.c_str());
    for (int i = 0; i < exr.parts(); ++i) {
        const Imf::Header& part = exr.header(i);
        const std::string prefix = exr.parts() > 1 && part.hasName() ? part.name() + "." : "";
        for (auto each = part.channels().begin(); each != part.channels().end(); ++each)
            channels.push_back({prefix + each.name(), type_of(part, each.channel().type)});
    }
    return channels;
} catch (const Error&) {
    throw;
} catch (const std::exception& error) {
    io::refuse(file, std::string("its header is damaged (") + error.what() + "); render or copy it again");
}

} // namespace fathom
