#include "runtime/launch.hpp"

#include "runtime/pocl.hpp"

#include <algorithm>
#include <array>

namespace fathom::runtime {

std::string bare_type(std::string_view reported) {
    constexpr std::array<std::string_view, 6> qualifiers{"__global", "global", "__private",
                                                         "const",    "struct", "restrict"};
    std::string type;
    std::string word;
    const auto end_word = [&] {
        if (std::ranges::find(qualifiers, word) == qualifiers.end())
            type += word;
        word.clear();
    };
    for (const char c : reported.substr(0, reported.find('\0'))) {
        if (c == ' ' || c == '*')
            end_word();
        if (c == '*')
            type += c;
        else if (c != ' ')
            word += c;
    }
    end_word();
    return type;
}

void check(Kernel& kernel, const std::vector<std::string>& types, std::size_t group) {
    if (kernel.compiled)
        check_linked(*kernel.compiled, kernel.name, group);
    const auto declared = kernel.kernel.getInfo<CL_KERNEL_NUM_ARGS>();
    if (declared != types.size()) {
        throw Error(text(kernel.description, " takes ", declared, " arguments and was given ", types.size()));
    }
    for (cl_uint i = 0; i < declared; ++i) {
        std::string type;
        try {
            type = bare_type(kernel.kernel.getArgInfo<CL_KERNEL_ARG_TYPE_NAME>(i));
        } catch (const cl::Error&) {
            break; // a driver that keeps no names
        }
        if (type != types[i]) {
            throw Error(text(kernel.description, ": argument ", i, " is a ", type, " and was given a ", types[i]));
        }
    }
}

std::size_t group_size(const Device& device, Kernel& kernel) {
    if (kernel.group_limit == 0)
        kernel.group_limit = kernel.kernel.getWorkGroupInfo<CL_KERNEL_WORK_GROUP_SIZE>(device.state().shared->device);
    return std::min(static_cast<std::size_t>(device.options().group_size), kernel.group_limit);
}

} // namespace fathom::runtime
