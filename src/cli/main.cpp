// The program `fathom`: its commands, its options and its exit codes.
#include "codecs.hpp"
#include "command.hpp"
#include "help.hpp"
#include "interrupt.hpp"
#include "messages.hpp"
#include "run_log.hpp"

#include <fathom/error.hpp>

#include <CLI/CLI.hpp>

#include <cstdio>
#include <new>

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace {

using namespace fathom::cli;

constexpr const char* exit_codes = R"(Exit codes:
  0    done
  1    some input failed; the others were done
  2    wrong usage; nothing was done
  3    no OpenCL device as asked for
  130  interrupted (Ctrl-C) after the inputs in work; no half-written file is left
  143  the same after SIGTERM)";

constexpr const char* exit_codes_in_short =
    "Exit codes: 0 done, 1 some input failed, 2 wrong usage, 3 no such device, 130 and 143 interrupted.";

// Runs what the arguments ask for.
int run(int argc, char** argv) {
    CLI::App program("fathom: exact depth, positions, normals, ambient occlusion, depth of field and fog\n"
                     "from depth images, on any OpenCL device",
                     "fathom");
    program.formatter(help_layout());
    program.set_help_flag("-h,--help", "print this help, or that of a command");
    program.set_version_flag("--version", "fathom " FATHOM_VERSION, "print the version");
    program.require_subcommand(1);
    program.footer("Example:\n  fathom linearize frame.exr --camera camera.json -o frame.z.exr\n\n" +
                   std::string(exit_codes));

    std::function<int()> action;
    for (const Command* command : commands()) {
        CLI::App* app = program.add_subcommand(command->name, command->summary);
        app->footer(command->notes + std::string("\n\n") + exit_codes_in_short);
        app->parse_complete_callback([&action, run = command->configure(*app)] { action = run; });
    }

    try {
        program.parse(argc, argv);
    } catch (const CLI::Success& wanted) { // --help, --version
        return program.exit(wanted);
    } catch (const CLI::ParseError& error) {
        complain(explain(program, error));
        return wrong_usage;
    }
    return action();
}

// Gives every end of a run its exit code, and every bad one its line.
int guarded_run(int argc, char** argv) {
    try {
        const int code = run(argc, argv);
        if (std::fflush(stdout) != 0 || std::ferror(stdout))
            throw fathom::Error("standard output: cannot be written; check what it is sent to");
        return code;
    } catch (const UsageError& error) {
        complain(error.what());
        return wrong_usage;
    } catch (const fathom::NoDevice& error) {
        complain(error.what());
        return no_device;
    } catch (const Interrupted& stop) {
        complain("interrupted; files that were finished are complete");
        return 128 + stop.signal;
    } catch (const std::bad_alloc&) {
        complain("not enough memory");
        return input_failed;
    } catch (const std::exception& error) {
        complain(error.what());
        return input_failed;
    }
}

} // namespace

// A frame takes the memory of the one before it. Otherwise each image would go back to the system and come again page by
// page, which costs more than most operations.
void keep_freed_memory() {
#ifdef __GLIBC__
    mallopt(M_ARENA_MAX, 1); // what one thread frees, another one takes
    mallopt(M_MMAP_MAX, 0);
    mallopt(M_TRIM_THRESHOLD, -1); // none
#endif
}

int main(int argc, char** argv) {
    keep_freed_memory();
    prepare_streams();
    remember_command_line(argc, argv);
    return guarded_run(argc, argv);
}
