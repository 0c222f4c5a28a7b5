#define CATCH_CONFIG_RUNNER
#include "catch.hpp"

int main(int argc, char* argv[]) {
    setenv("OPENCL_LAYERS", FATHOM_LAYER, 1);
    setenv("POCL_DEVICES", "pthread pthread", 1); // two devices, of which each has to build its programs
    return Catch::Session().run(argc, argv);
}
