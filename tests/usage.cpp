#include "program.hpp"

#include "cli/program.hpp"

namespace fathom::test {

std::string usage_refusal(const Arguments& arguments) {
    std::vector<const char*> argv{"fathom"};
    for (const std::string& argument : arguments)
        argv.push_back(argument.c_str());
    try {
        cli::Program().parse(static_cast<int>(argv.size()), argv.data());
    } catch (const cli::UsageError& error) {
        return error.what();
    }
    return {};
}

} // namespace fathom::test
