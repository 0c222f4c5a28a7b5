// The process that compiles. A first process waits for it, tells how it ended and starts the next; it does nothing else, so that a
// fork of it is safe while this process has threads.
#include "runtime/compiler.hpp"

#include "runtime/context.hpp"
#include "runtime/pocl.hpp"
#include "runtime/program.hpp"
#include "text.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <list>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <utility>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

namespace fathom::runtime {
namespace {

/// What one asks for: a program, or one of its kernels where that has a name.
struct Request {
    std::string device, file, options, kernel;
    std::vector<std::pair<std::size_t, std::string>> arguments; // bytes, and their values where these are params
    std::array<std::size_t, 2> global;
    std::size_t group;
};

/// How it was answered: a number of Answer, or a negative one for the signal or the exit code that ended the process.
enum Answer : int { compiled = 0, not_compiled = 1 };

// Bytes through a socket. False where the other side has gone.
bool pass(const std::function<ssize_t(char*, std::size_t)>& some, void* bytes, std::size_t count) {
    for (auto* at = static_cast<char*>(bytes); count > 0;) {
        const ssize_t passed = some(at, count);
        if (passed < 0 && errno == EINTR)
            continue;
        if (passed <= 0)
            return false;
        at += passed;
        count -= static_cast<std::size_t>(passed);
    }
    return true;
}

/// Writes or reads values one after the other: the same code says what a request is made of on either side.
class Stream {
public:
    Stream(int socket, bool writes) : socket_(socket), writes_(writes) {}

    bool ok() const { return ok_; }

    template <typename Value>
    Stream& operator&(Value& value) {
        static_assert(std::is_trivially_copyable_v<Value>);
        return bytes(&value, sizeof value);
    }
    Stream& operator&(std::string& text) {
        std::size_t size = text.size();
        *this& size;
        text.resize(ok_ ? size : 0);
        return bytes(text.data(), text.size());
    }
    Stream& operator&(Request& request) {
        std::size_t count = request.arguments.size();
        *this& request.device& request.file& request.options& request.kernel& count& request.global& request.group;
        request.arguments.resize(ok_ ? count : 0);
        for (auto& [size, value] : request.arguments)
            *this& size& value;
        return *this;
    }

private:
    Stream& bytes(void* at, std::size_t count) {
        const auto some = [&](char* part, std::size_t size) {
            return writes_ ? send(socket_, part, size, MSG_NOSIGNAL) : recv(socket_, part, size, 0);
        };
        ok_ = ok_ && pass(some, at, count);
        return *this;
    }

    int socket_;
    bool writes_, ok_ = true;
};

/// Zeros that take no memory before they are written.
class Zeros {
public:
    explicit Zeros(std::size_t bytes)
        : bytes_(bytes),
          place_(mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0)) {
        if (place_ == MAP_FAILED)
            throw std::bad_alloc();
    }
    ~Zeros() { munmap(place_, bytes_); }
    Zeros(const Zeros&) = delete;
    Zeros& operator=(const Zeros&) = delete;

    cl::Buffer buffer(const cl::Context& context) const { return {context, CL_MEM_USE_HOST_PTR, bytes_, place_}; }

private:
    std::size_t bytes_;
    void* place_;
};

constexpr std::string_view pocl = "Portable Computing Language";

/// A device of PoCL in the process that compiles, which asks no other driver for anything.
struct OfPocl {
    cl::Device device;
    cl::Context context;
    cl::CommandQueue queue;
    std::map<std::string, cl::Program> programs; // by file and options

    explicit OfPocl(const cl::Device& found) : device(found), context(found), queue(context, found) {}
};

OfPocl& device_called(const std::string& name) {
    static std::map<std::string, OfPocl> all;
    if (const auto found = all.find(name); found != all.end())
        return found->second;
    std::vector<cl::Platform> platforms;
    cl::Platform::get(&platforms);
    for (const cl::Platform& platform : platforms) {
        if (!platform.getInfo<CL_PLATFORM_NAME>().starts_with(pocl))
            continue;
        std::vector<cl::Device> devices;
        platform.getDevices(CL_DEVICE_TYPE_ALL, &devices);
        for (const cl::Device& device : devices)
            if (device.getInfo<CL_DEVICE_NAME>().starts_with(name))
                return all.emplace(name, device).first->second;
    }
    throw Error("PoCL has no device called " + name);
}

// PoCL compiles a kernel when it is started, for groups of a size, and for grids below or above a width. So one group of it runs
// here, on zeros in place of images.
Answer compile_here(const Request& request) {
    OfPocl& on = device_called(request.device);
    const auto [found, is_new] = on.programs.try_emplace(request.file + ' ' + request.options);
    if (is_new) {
        const Build built = build(on.context, on.device, request.file, request.options, true);
        if (!built.succeeded)
            return not_compiled;
        found->second = built.program;
    }
    if (request.kernel.empty())
        return compiled;
    constexpr std::size_t small_grid = 32768; // PoCL's own limit is 65535
    cl::Kernel kernel(found->second, request.kernel.c_str());
    std::list<Zeros> zeros;
    std::list<cl::Buffer> buffers; // which no argument keeps
    cl_uint index = 0;
    for (const auto& [bytes, value] : request.arguments)
        if (value.empty()) {
            zeros.emplace_back(std::max<std::size_t>(bytes, 1));
            kernel.setArg(index++, buffers.emplace_back(zeros.back().buffer(on.context)));
        } else {
            kernel.setArg(index++, value.size(), value.data());
        }
    const bool is_small = std::ranges::max(request.global) < small_grid;
    const cl::NDRange global =
        is_small ? cl::NDRange(request.group, 1) : cl::NDRange(request.global[0], request.global[1]);
    on.queue.enqueueNDRangeKernel(kernel, cl::NullRange, global, cl::NDRange(request.group, 1));
    on.queue.finish();
    return compiled;
}

[[noreturn]] void serve(int socket) {
    std::atexit(
        [] { std::_Exit(1); }); // which a compiler calls that gives up: no other process's threads are waited for
    for (;;) {
        Request request;
        if (!(Stream(socket, false) & request).ok())
            std::_Exit(0);         // who asked has gone
        int answer = not_compiled; // who asked will compile it then, and say what is wrong
        try {
            answer = compile_here(request);
        } catch (const std::exception&) {
        }
        std::string none;
        if (!(Stream(socket, true) & answer & none).ok())
            std::_Exit(0);
    }
}

// The last line about an error that a process printed.
std::string last_error(int file) {
    std::string text(std::size_t{1} << 12, '\0');
    const off_t size = lseek(file, 0, SEEK_END);
    const ssize_t count =
        pread(file, text.data(), text.size(), std::max<off_t>(size - static_cast<off_t>(text.size()), 0));
    text.resize(static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
    const std::size_t error = text.rfind("ERROR"), first = text.rfind('\n', error) + 1;
    return error == std::string::npos ? "" : text.substr(first, text.find('\n', error) - first);
}

void end_with_parent() {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
}

[[noreturn]] void wait_for_compilers(int socket, pid_t parent) {
    end_with_parent();
    if (getppid() != parent) // which has gone already
        std::_Exit(0);
    const int quiet = open("/dev/null", O_RDWR), said = memfd_create("said", 0);
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
        dup2(stream == STDERR_FILENO && said >= 0 ? said : quiet, stream);
    const rlimit none{};
    setrlimit(RLIMIT_CORE, &none);
    std::signal(SIGCHLD, SIG_DFL);
    for (;;) {
        if (said >= 0 && ftruncate(said, 0) == 0)
            lseek(said, 0, SEEK_SET);
        const pid_t self = getpid(), compiler = fork();
        if (compiler == 0) {
            end_with_parent();
            if (getppid() != self)
                std::_Exit(0);
            serve(socket);
        }
        int status = 0;
        while (compiler > 0 && waitpid(compiler, &status, 0) < 0 && errno == EINTR) {
        }
        if (compiler < 0 || status == 0)
            std::_Exit(0);
        int answer = WIFSIGNALED(status) ? -WTERMSIG(status) : -1000 - WEXITSTATUS(status);
        std::string words = said >= 0 ? last_error(said) : "";
        if (!(Stream(socket, true) & answer & words).ok())
            std::_Exit(0);
    }
}

/// Hashes of what was compiled, in a file of PoCL's folder.
class Compiled {
public:
    Compiled() {
        const std::string name = pocl_folder() / "fathom-compiled";
        file_ = open(name.c_str(), O_RDWR | O_APPEND | O_CREAT | O_CLOEXEC, 0600);
        struct stat found {};
        if (file_ >= 0 && fstat(file_, &found) == 0 && found.st_size % static_cast<off_t>(sizeof(std::size_t)) != 0 &&
            ftruncate(file_, 0) != 0) // damaged
            close(std::exchange(file_, -1));
        std::size_t hash = 0;
        while (file_ >= 0 && read(file_, &hash, sizeof hash) == sizeof hash)
            all_.insert(hash);
    }

    bool holds(std::size_t hash) const { return all_.contains(hash); }

    void add(std::size_t hash) {
        all_.insert(hash);
        if (file_ >= 0 && write(file_, &hash, sizeof hash) != sizeof hash) // the next run asks again
            close(std::exchange(file_, -1));
    }

private:
    std::set<std::size_t> all_;
    int file_ = -1;
};

struct Compiler {
    std::mutex mutex;
    int socket = -1;
    std::optional<Compiled> compiled;
};

Compiler& compiler() {
    static Compiler* const only = new Compiler;
    return *only;
}

std::string driver_of(const Device& device) {
    const cl::Platform platform(device.state().shared->device.getInfo<CL_DEVICE_PLATFORM>());
    return platform.getInfo<CL_PLATFORM_VERSION>();
}

// "PoCL 6.0 with LLVM 18.1.8", of "OpenCL 3.0 PoCL 6.0  Linux, Release, RELOC, SPIR-V, LLVM 18.1.8, SLEEF, DISTRO, POCL_DEBUG"
std::string in_short(const std::string& driver) {
    const auto after = [&](const std::string& word) {
        const std::size_t at = std::min(driver.find(word), driver.size());
        return driver.substr(at, driver.find_first_of(" ,", at + word.size()) - at);
    };
    return text(after("PoCL "), " with ", after("LLVM "));
}

std::string in_words(int answer) {
    return answer > -1000 ? strsignal(-answer) : text("exit code ", -answer - 1000);
}

// Of all kernels: whichever changes, all are asked for once more, and those that did not are in the cache.
std::size_t hash_of_sources() {
    static const std::size_t hash = [] {
        std::size_t all = 0;
        for (const auto& [path, content] : fathom_kernel_files())
            all = 31 * all + std::hash<std::string>()(content);
        return all;
    }();
    return hash;
}

void compile(const Device& device, Request& request) {
    Compiler& of = compiler();
    if (device.info().platform != pocl)
        return;
    const std::lock_guard lock(of.mutex);
    if (of.socket < 0)
        return;
    if (!of.compiled)
        of.compiled.emplace();
    const char* const processor = std::getenv("POCL_KERNELLIB_NAME");
    const std::size_t hash = std::hash<std::string>()(
        text(driver_of(device), ' ', device.info().version, ' ', processor ? processor : "", ' ', request.options, ' ',
             request.file, ' ', request.kernel, ' ', request.group, ' ', hash_of_sources()));
    if (of.compiled->holds(hash))
        return;
    request.device = device.info().name;
    int answer = not_compiled;
    std::string words;
    if (!(Stream(of.socket, true) & request).ok() || !(Stream(of.socket, false) & answer & words).ok()) {
        close(std::exchange(of.socket, -1)); // nobody is there: compiled here from now on
        return;
    }
    if (answer == compiled)
        of.compiled->add(hash);
    if (answer >= 0)
        return;
    check_pocl_folder(request.file, true);
    throw CompilerEnded(text("kernels/", request.file, " cannot be compiled for ", device.info().name,
                             ": the compiler of ", in_short(driver_of(device)), " ended over it (", in_words(answer),
                             words.empty() ? "" : ": ", words, ")"),
                        device.options().vector_width);
}

} // namespace

void compile_apart() {
    const char* const cache = std::getenv("POCL_KERNEL_CACHE");
    int sockets[2];
    if (compiler().socket >= 0 || (cache && std::string_view(cache) == "0") ||
        socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, sockets) != 0)
        return;
    const PoclFolder chosen; // for both
    const pid_t parent = getpid(), process = fork();
    if (process == 0) {
        close(sockets[0]);
        wait_for_compilers(sockets[1], parent);
    }
    close(sockets[1]);
    if (process < 0)
        close(sockets[0]);
    else
        compiler().socket = sockets[0];
}

void compile_program(const Device& device, const std::string& file, const std::string& options) {
    Request request{"", file, options, {}, {}, {}, 0};
    compile(device, request);
}

void compile_kernel(const Device& device, const Kernel& kernel, const std::vector<Argument>& arguments,
                    const std::array<std::size_t, 2>& global, std::size_t group) {
    Request request{"", kernel.file, kernel.options, kernel.name, {}, global, group};
    for (const auto& [bytes, value] : arguments)
        request.arguments.emplace_back(bytes, value ? std::string(static_cast<const char*>(value), bytes) : "");
    compile(device, request);
}

std::string take_another_width(const Device& device, const CompilerEnded& ended) {
    Device::State& state = device.state();
    if (state.options.vector_width != ended.vector_width)
        return "";
    state.ended_widths |= ended.vector_width; // each is a bit of its own
    for (const int width : {16, 8, 4, 1})
        if (!(state.ended_widths & width)) {
            state.options.vector_width = width;
            return text(ended.what(), "; it goes on with a vector width of ", width, " in place of ",
                        ended.vector_width, ", which may take longer");
        }
    throw CompilerEnded(text(ended.what(), ", however many pixels it computes at a time; choose another device with "
                                           "--device, or install another version of the driver"),
                        ended.vector_width);
}

} // namespace fathom::runtime
