#define CATCH_CONFIG_RUNNER
#include "catch.hpp"

int main(int argc, char* argv[]) {
    setenv("POCL_DEVICES", "pthread pthread", 1); // two devices
    return Catch::Session().run(argc, argv);
}
