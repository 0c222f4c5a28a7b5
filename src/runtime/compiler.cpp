// The process that compiles. A first process waits for it, tells how it ended and starts the next; it does nothing else, so that a
// fork of it is safe while this process has threads.
#include "runtime/compiler.hpp"

#include "runtime/pocl.hpp"
#include "runtime/program.hpp"
#include "text.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <sstream>

#include <dlfcn.h>
#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

namespace fathom::runtime {
namespace {

constexpr std::string_view pocl = "Portable Computing Language";

// Messages are packets, which arrive whole. A request is lines; its answer is one of these two, or how the process ended.
const std::string compiled = "compiled", not_compiled = "not compiled";

bool write_message(int socket, const std::string& message) {
    return send(socket, message.data(), message.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(message.size());
}

// Nothing where the other side has gone.
std::optional<std::string> read_message(int socket) {
    const ssize_t size = recv(socket, nullptr, 0, MSG_PEEK | MSG_TRUNC);
    std::string message(static_cast<std::size_t>(std::max<ssize_t>(size, 0)), '\0');
    if (size <= 0 || recv(socket, message.data(), message.size(), 0) != size)
        return std::nullopt;
    return message;
}

/// A device of PoCL in the process that compiles, which asks no other driver for anything.
struct OfPocl {
    cl::Device device;
    cl::Context context{device};
    cl::CommandQueue queue{context, device};
    cl::Buffer buffer{context, CL_MEM_READ_WRITE, 4096};
    std::map<std::string, cl::Program> programs = {}; // by file and options
};

OfPocl& device_called(const std::string& name) {
    static std::map<std::string, OfPocl> all;
    if (const auto found = all.find(name); found != all.end())
        return found->second;
    std::vector<cl::Platform> platforms;
    cl::Platform::get(&platforms);
    for (const cl::Platform& platform : platforms) {
        std::vector<cl::Device> devices;
        if (platform.getInfo<CL_PLATFORM_NAME>().starts_with(pocl))
            platform.getDevices(CL_DEVICE_TYPE_ALL, &devices);
        for (const cl::Device& device : devices)
            if (device.getInfo<CL_DEVICE_NAME>().starts_with(name))
                return all.emplace(name, OfPocl{device}).first->second;
    }
    throw Error("PoCL has no device called " + name);
}

// PoCL compiles a kernel when it is started, for groups of a size, and for grids below or above a width. So one group of it runs
// here. With zeros for all numbers a kernel has no pixels and does nothing, which scripts/check-builds tries.
const std::string& compile_here(const std::string& request) {
    std::istringstream from(request);
    std::string device, file, options, name;
    for (std::string* const line : {&device, &file, &options, &name})
        std::getline(from, *line);
    OfPocl& on = device_called(device);
    cl::Program& program = on.programs[file + ' ' + options];
    if (!program()) {
        const Build built = build(on.context, on.device, file, options, true);
        if (!built.succeeded)
            return not_compiled;
        program = built.program;
    }
    if (name.empty())
        return compiled;
    std::size_t of_grid = 0, group = 0, columns = 0, rows = 0, bytes = 0;
    from >> of_grid >> group >> columns >> rows;
    cl::Kernel kernel(program, name.c_str());
    for (cl_uint index = 0; from >> bytes; ++index)
        if (bytes == 0)
            kernel.setArg(index, on.buffer);
        else
            kernel.setArg(index, bytes, std::vector<char>(bytes).data());
    if (of_grid == build_of_grid(1, 1))
        columns = group, rows = 1;
    on.queue.enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(columns, rows), cl::NDRange(group, 1));
    on.queue.finish();
    return compiled;
}

[[noreturn]] void serve(int socket) {
    // What a compiler that gives up may call. Nothing else is to run then: it would wait for threads that a fork leaves out.
    std::atexit([] { std::_Exit(1); });
    while (const auto request = read_message(socket)) {
        std::string answer = not_compiled; // who asked will compile it then, and say what is wrong
        try {
            answer = compile_here(*request);
        } catch (const std::exception&) {
        }
        if (!write_message(socket, answer))
            break;
    }
    std::_Exit(0); // who asked has gone
}

// The last line about an error that a process printed, after a colon.
std::string last_error(int file) {
    std::string text(std::size_t{1} << 16, '\0');
    text.resize(static_cast<std::size_t>(std::max<ssize_t>(pread(file, text.data(), text.size(), 0), 0)));
    const std::size_t error = text.rfind("ERROR"), first = text.rfind('\n', error) + 1;
    return error == std::string::npos ? "" : ": " + text.substr(first, text.find('\n', error) - first);
}

// A child of this process, which ends with it.
pid_t fork_that_ends_with_parent() {
    const pid_t parent = getpid(), child = fork();
    if (child == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        if (getppid() != parent) // which has gone already
            std::_Exit(0);
    }
    return child;
}

[[noreturn]] void wait_for_compilers(int given) {
    constexpr int socket = STDERR_FILENO + 1; // and nothing else stays open, of what others may wait for
    dup2(given, socket);
    close_range(socket + 1, ~0u, 0);
    const int quiet = open("/dev/null", O_RDWR | O_CLOEXEC), said = memfd_create("said", MFD_CLOEXEC);
    dup2(quiet, STDIN_FILENO);
    dup2(quiet, STDOUT_FILENO);
    dup2(said, STDERR_FILENO);
    const rlimit none{};
    setrlimit(RLIMIT_CORE, &none);
    std::signal(SIGCHLD, SIG_DFL);
    for (;;) {
        if (ftruncate(said, 0) != 0 || lseek(said, 0, SEEK_SET) != 0)
            std::_Exit(0);
        const pid_t process = fork_that_ends_with_parent();
        if (process == 0)
            serve(socket);
        int status = 0;
        while (process > 0 && waitpid(process, &status, 0) < 0 && errno == EINTR) {
        }
        if (process < 0 || status == 0)
            std::_Exit(0);
        const std::string how = !WIFSIGNALED(status)          ? text("exit code ", WEXITSTATUS(status))
                                : WTERMSIG(status) == SIGKILL ? "killed, as where memory runs out"
                                                              : strsignal(WTERMSIG(status));
        if (!write_message(socket, how + last_error(said)))
            std::_Exit(0);
    }
}

// What was compiled, a hash a line. A line that is damaged is asked for once more.
std::filesystem::path list_of_compiled() {
    return pocl_folder() / "fathom-compiled";
}

std::set<std::string> read_compiled() {
    std::set<std::string> all;
    std::ifstream lines(list_of_compiled());
    for (std::string line; std::getline(lines, line);)
        all.insert(line);
    return all;
}

// What PoCL is linked with, LLVM above all, takes a while to load, and both processes have it where it is loaded before the fork.
void load_pocl() {
    const char* const chosen = std::getenv("OCL_ICD_VENDORS");
    std::error_code ignored;
    for (const auto& entry :
         std::filesystem::directory_iterator(chosen && *chosen ? chosen : "/etc/OpenCL/vendors", ignored)) {
        std::string library;
        if (entry.path().extension() == ".icd" && entry.path().filename().string().find("pocl") != std::string::npos &&
            entry.is_regular_file(ignored) && std::getline(std::ifstream(entry.path()), library))
            dlopen(library.c_str(), RTLD_LAZY);
    }
}

struct Compiler {
    std::mutex mutex;
    std::atomic<int> socket = -1;
    std::atomic<pid_t> process = 0; // that waits
    std::atomic<bool> stopped = false;
    std::string version;
    std::optional<std::set<std::string>> known;
};

Compiler& compiler() {
    static Compiler* const only = new Compiler;
    return *only;
}

// Both processes end at once where nobody compiles, and nobody has to look after them then.
void end_compiler() {
    Compiler& of = compiler();
    const std::unique_lock lock(of.mutex, std::try_to_lock);
    if (!lock || of.socket < 0)
        return;
    close(of.socket.exchange(-1));
    waitpid(of.process, nullptr, 0);
}

// `what`: the lines of a request that say what is compiled. `launch`: all else of it.
void compile(const Device& device, const std::string& file, const std::string& what, const std::string& launch) {
    Compiler& of = compiler();
    const std::lock_guard lock(of.mutex);
    if (of.socket < 0 || device.info().platform != pocl)
        return;
    const std::string driver = "PoCL " + device.state().shared->device.getInfo<CL_DRIVER_VERSION>();
    const char* const processor = std::getenv("POCL_KERNELLIB_NAME");
    const std::string hash = std::to_string(std::hash<std::string>()(
        text(driver, ' ', device.info().version, ' ', processor ? processor : "", ' ', what, ' ', of.version)));
    if (!of.known)
        of.known = read_compiled();
    if (of.known->contains(hash))
        return;
    const auto answer =
        write_message(of.socket, device.info().name + '\n' + what + launch) ? read_message(of.socket) : std::nullopt;
    while (of.stopped) // this process is about to end
        pause();
    if (!answer) // nobody is there: compiled here from now on
        close(of.socket.exchange(-1));
    else if (answer == compiled && of.known->insert(hash).second)
        std::ofstream(list_of_compiled(), std::ios::app) << hash + '\n';
    else if (answer != compiled && answer != not_compiled) {
        check_pocl_folder(file, true);
        throw CompilerCrashed(text("kernels/", file, " cannot be compiled for ", device.info().name,
                                   ": the compiler of ", driver, " crashed on it (", *answer, ")"),
                              device.options().vector_width);
    }
}

} // namespace

void compile_apart(const std::string& version) {
    const char* const cache = std::getenv("POCL_KERNEL_CACHE");
    Compiler& of = compiler();
    int sockets[2];
    if (of.socket >= 0 || (cache && std::string_view(cache) == "0") ||
        socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, sockets) != 0)
        return;
    const PoclFolder chosen; // for both
    if (std::error_code ignored; !std::filesystem::exists(list_of_compiled(), ignored))
        load_pocl(); // which most runs do not need before the fork, and a first one does
    of.process = fork_that_ends_with_parent();
    if (of.process == 0)
        wait_for_compilers(sockets[1]);
    of.socket = sockets[0];
    of.version = version;
    close(sockets[1]);
    std::atexit(end_compiler);
}

void stop_compiling() {
    Compiler& of = compiler();
    of.stopped = true;
    if (of.socket < 0)
        return;
    kill(of.process, SIGKILL); // which ends the one that compiles
    constexpr int most = 1000; // milliseconds
    pollfd until_both_have_gone{of.socket, 0, 0};
    poll(&until_both_have_gone, 1, most);
}

void compile_program(const Device& device, const std::string& file, const std::string& options) {
    compile(device, file, file + '\n' + options + "\n\n", "");
}

unsigned build_of_grid(std::size_t columns, std::size_t rows) {
    const std::size_t size = std::max(columns, rows);
    return size < 32768 ? 1 : size < 65535 ? 2 : 4;
}

void compile_kernel(const Device& device, const Kernel& kernel, const std::vector<std::size_t>& sizes,
                    const std::array<std::size_t, 2>& global, std::size_t group) {
    std::string launch = text(' ', global[0], ' ', global[1]);
    for (const std::size_t size : sizes)
        launch += text(' ', size);
    compile(device, kernel.file,
            text(kernel.file, '\n', kernel.options, '\n', kernel.name, '\n', build_of_grid(global[0], global[1]), ' ',
                 group),
            launch);
}

std::string take_another_width(const Device& device, const CompilerCrashed& crashed) {
    Device::State& state = device.state();
    if (state.options.vector_width != crashed.vector_width)
        return "";
    state.crashed_widths |= crashed.vector_width; // each is a bit of its own
    for (const int width : {16, 8, 4, 1})
        if (!(state.crashed_widths & width)) {
            state.options.vector_width = width;
            return text(crashed.what(), "; fathom goes on with a vector width of ", width, " instead of ",
                        crashed.vector_width, ", which may be slower");
        }
    throw CompilerCrashed(text(crashed.what(), " at every vector width; choose another device with --device, or "
                                               "install another version of the driver"),
                          crashed.vector_width);
}

} // namespace fathom::runtime
