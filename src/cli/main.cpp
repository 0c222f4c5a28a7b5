// The program `fathom`: its streams, its memory and its exit codes.
#include "program.hpp"

#include "runtime/pocl.hpp"
#include "shot/shot.hpp"

#include <fathom/error.hpp>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <new>
#include <system_error>

#include <unistd.h>

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace {

using namespace fathom::terminal;

// Gives every end of a run its exit code, and every bad one its line.
int guarded_run(int argc, char** argv) {
    try {
        fathom::cli::Program program; // the options that the action reads
        const int code = program.parse(argc, argv)();
        check_output();
        return code;
    } catch (const UsageError& error) {
        complain(error.what());
        return wrong_usage;
    } catch (const fathom::NoDevice& error) {
        complain(error.what());
        return no_device;
    } catch (const Interrupted& stop) {
        if (stop.signal != SIGPIPE) // who has stopped reading knows
            complain("interrupted; files that were finished are complete");
        return 128 + stop.signal;
    } catch (const std::bad_alloc&) {
        complain("not enough memory");
        return input_failed;
    } catch (const std::system_error& error) {
        const bool of_output = std::ferror(stdout) != 0;
        if (of_output && error.code().value() == EPIPE)
            return 128 + SIGPIPE;
        complain(of_output ? unwritable_output(error.code().value()) : error.what());
        return input_failed;
    } catch (const std::exception& error) {
        complain(error.what());
        return input_failed;
    }
}

} // namespace

// Where a lack of memory meets what lets no exception out, such as CLI11 and what is made before `main`, it ends in a line, too,
// which takes no memory.
[[gnu::constructor(101)]] void end_in_one_line() {
    static const std::terminate_handler otherwise = std::get_terminate();
    std::set_terminate([] {
        try {
            if (std::current_exception())
                throw;
        } catch (const std::bad_alloc&) {
            constexpr std::string_view line = "fathom: not enough memory\n";
            std::_Exit(::write(STDERR_FILENO, line.data(), line.size()) < 0 ? 128 + SIGABRT : input_failed);
        } catch (...) {
        }
        otherwise();
    });
}

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
    watch_interrupts([] {
        fathom::runtime::stop_compiling(); // into the folder that goes
        fathom::runtime::remove_folder_of_process();
    });
    prepare_streams();
    fathom::shot::remember_command_line(argc, argv);
    return guarded_run(argc, argv);
}
