#include "runtime/launch.hpp"

namespace fathom::runtime {

void check_arguments(Kernel& kernel, const std::vector<std::string>& types) {
    const auto declared = kernel.kernel.getInfo<CL_KERNEL_NUM_ARGS>();
    if (declared != types.size()) {
        throw Error(text(kernel.description, " takes ", declared, " arguments and was given ", types.size()));
    }
    for (cl_uint i = 0; i < declared; ++i) {
        std::string type;
        try {
            type = kernel.kernel.getArgInfo<CL_KERNEL_ARG_TYPE_NAME>(i);
        } catch (const cl::Error&) {
            break; // a driver that keeps no names
        }
        type.erase(std::find(type.begin(), type.end(), '\0'), type.end());
        if (type != types[i]) {
            throw Error(text(kernel.description, ": argument ", i, " is a ", type, " and was given a ", types[i]));
        }
    }
    kernel.checked = true;
}

} // namespace fathom::runtime
