// Preloaded into the program: loads its libraries once, and then forks a process for each run that is asked for. Half of the
// time of a short run goes into finding the symbols of some 150 libraries. Asked for are runs with the same arguments.
#include <array>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <string>

#include <dlfcn.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace {

using Main = int (*)(int, char**, char**);
Main program = nullptr;

void send_to(const char* file, int stream) {
    const int opened = open(file, O_WRONLY | O_CREAT | O_TRUNC, 0666);
    if (opened < 0 || dup2(opened, stream) < 0)
        _exit(126);
    close(opened);
}

// The next line that asks for a run; false where there is none.
bool read_line(int pipe, std::string& line) {
    line.clear();
    char byte = 0;
    while (read(pipe, &byte, 1) == 1) {
        if (byte == '\n')
            return true;
        line += byte;
    }
    return false;
}

// FATHOM_SERVER: "ASKED TOLD", two pipes. A line NAME=VALUE<tab>… asks for a run with these variables. Its number is told when
// it has stopped before main(), and its status at its end. Gives true in the process of a run, false when nobody asks any more.
bool serve(const char* pipes, const char* out, const char* err) {
    int asked = -1, told = -1;
    if (std::sscanf(pipes, "%d %d", &asked, &told) != 2)
        std::abort();
    dlopen("libpocl.so.2", RTLD_NOW | RTLD_LOCAL); // brings LLVM; where it is called otherwise, each run loads its own
    for (std::string line; read_line(asked, line);) {
        const pid_t run = fork();
        if (run == 0) {
            close(asked);
            close(told);
            send_to(out, STDOUT_FILENO);
            send_to(err, STDERR_FILENO);
            std::istringstream variables(line);
            for (std::string name, value; std::getline(variables, name, '=') && std::getline(variables, value, '\t');)
                setenv(name.c_str(), value.c_str(), 1);
            prctl(PR_SET_PTRACER, PR_SET_PTRACER_ANY, 0, 0, 0); // fails where the system does not ask for it
            raise(SIGSTOP);                                     // until a tracer is there
            return true;
        }
        std::array<int, 1> number{run};
        int status = 0;
        const bool good = run > 0 && waitpid(run, &status, WUNTRACED) == run &&
                          write(told, number.data(), sizeof number) == sizeof number;
        while (good && waitpid(run, &status, 0) == run && !WIFEXITED(status) && !WIFSIGNALED(status)) {
        }
        if (!good || write(told, &status, sizeof status) != sizeof status)
            std::abort();
    }
    return false;
}

int serve_and_run(int count, char** arguments, char** environment) {
    const char* const pipes = std::getenv("FATHOM_SERVER");
    if (pipes && !serve(pipes, std::getenv("FATHOM_SERVER_OUT"), std::getenv("FATHOM_SERVER_ERR")))
        return 0;
    return program(count, arguments, environment);
}

} // namespace

// The C library's way into main().
extern "C" __attribute__((visibility("default"))) int __libc_start_main(Main main, int count, char** arguments,
                                                                        void (*begin)(), void (*end)(),
                                                                        void (*at_exit)(), void* stack) {
    program = main;
    const auto start = reinterpret_cast<decltype(&__libc_start_main)>(dlsym(RTLD_NEXT, "__libc_start_main"));
    return start(serve_and_run, count, arguments, begin, end, at_exit, stack);
}
