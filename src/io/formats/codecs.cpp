// OpenCV's codecs bring GDAL and some hundred libraries, which take 0.15 s to load: so they are loaded when an image needs them.
#include "codecs.hpp"

#include <fathom/error.hpp>

#include <opencv2/imgcodecs.hpp>

#include <dlfcn.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <mutex>
#include <streambuf>
#include <string_view>

namespace fathom::io {
namespace {

thread_local bool quiet = false; // what this thread prints to stderr goes nowhere

/// What other threads print goes on to where it went before.
class OthersOnly : public std::streambuf {
public:
    explicit OthersOnly(std::streambuf* before) : before_(before) {}

private:
    int_type overflow(int_type c) override { return quiet ? traits_type::not_eof(c) : before_->sputc(char(c)); }
    std::streamsize xsputn(const char* text, std::streamsize size) override {
        return quiet ? size : before_->sputn(text, size);
    }
    int sync() override { return quiet ? 0 : before_->pubsync(); }

    std::streambuf* before_;
};

FILE* stderr_before = nullptr;
std::mutex quieting;
int quiet_threads = 0;

using TiffErrorHandler = void (*)(void* file, const char* from, const char* format, std::va_list);
TiffErrorHandler others_errors = nullptr;

void keep_tiff_error(void* file, const char* from, const char* format, std::va_list arguments) {
    if (!quiet) {
        if (others_errors)
            others_errors(file, from, format, arguments);
    } else if (Quiet::tiff_error().empty()) {
        std::array<char, 256> text{};
        std::vsnprintf(text.data(), text.size(), format, arguments);
        const std::string said = text.data();
        const std::size_t name = said.starts_with("/proc/") ? said.find(": ") : std::string::npos;
        Quiet::tiff_error() = name == std::string::npos ? said : said.substr(name + 2);
    }
}

} // namespace

// OpenCV prints to std::cerr, and libpng and libjpeg to C's stderr, what a refusal says in one line.
Quiet::Quiet() {
    const std::lock_guard lock(quieting);
    static FILE* const others_only = [] {
        const auto write = [](void*, const char* text, std::size_t size) {
            if (!quiet)
                std::fwrite(text, 1, size, stderr_before);
            return static_cast<ssize_t>(size);
        };
        FILE* stream = fopencookie(nullptr, "w", {nullptr, write, nullptr, nullptr});
        std::setvbuf(stream, nullptr, _IONBF, 0);
        return stream;
    }();
    if (!dynamic_cast<OthersOnly*>(std::cerr.rdbuf()))
        std::cerr.rdbuf(new OthersOnly(std::cerr.rdbuf())); // for as long as anything prints
    if (quiet_threads++ == 0)
        stderr_before = std::exchange(stderr, others_only);
    quiet = true;
    tiff_error().clear();
}

Quiet::~Quiet() {
    const std::lock_guard lock(quieting);
    quiet = false;
    if (--quiet_threads == 0)
        stderr = stderr_before;
}

std::string& Quiet::tiff_error() {
    static thread_local std::string first;
    return first;
}

void* codec_function(const char* name) {
    static std::string why;
    static void* const library = [] {
        void* loaded = dlopen(FATHOM_IMGCODECS, RTLD_LAZY | RTLD_LOCAL);
        if (!loaded)
            why = dlerror();
        else if (void* set_handler = dlsym(loaded, "TIFFSetErrorHandlerExt"))
            others_errors = reinterpret_cast<TiffErrorHandler (*)(TiffErrorHandler)>(set_handler)(keep_tiff_error);
        return loaded;
    }();
    void* function = library ? dlsym(library, name) : nullptr;
    if (!function)
        throw Error("OpenCV's codecs, which read and write .png, .jpg, .tif and .hdr, cannot be loaded (" +
                    (why.empty() ? std::string("they have no ") + name : why) +
                    "); install OpenCV's imgcodecs, or use .exr, .npy or .pfm");
    return function;
}

MemoryFile::MemoryFile(const std::filesystem::path& file, View bytes)
    : descriptor_(memfd_create("image", MFD_CLOEXEC)) {
    bool good = descriptor_ >= 0;
    while (good && !bytes.empty()) {
        const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
        good = written >= 0 || errno == EINTR;
        bytes = bytes.subspan(static_cast<std::size_t>(std::max<ssize_t>(written, 0)));
    }
    if (good && ::access(name().c_str(), R_OK) == 0)
        return;
    const int error = errno;
    if (descriptor_ >= 0)
        ::close(descriptor_);
    refuse(file, std::string("cannot be handed to OpenCV through a file in memory (") + std::strerror(error) +
                     "); check the limits of memory and of file sizes, and that /proc is there");
}

MemoryFile::~MemoryFile() {
    ::close(descriptor_);
}

std::string MemoryFile::name() const {
    return "/proc/self/fd/" + std::to_string(descriptor_);
}

// From a file in memory: cv::imdecode refuses tiles of a TIFF that cv::imread takes, and writes Radiance's pictures into /tmp.
cv::Mat decoded(const std::filesystem::path& file, const MemoryFile& memory, cv::Size size) {
    constexpr int longest = 1 << 20;
    if (std::max(size.width, size.height) > longest)
        refuse(file, "has " + described(size) +
                         " pixels; OpenCV reads at most 1048576 of its kind in a row or column: save .exr, .npy or "
                         ".pfm");
    const auto read = reinterpret_cast<decltype(&cv::imread)>(
        codec_function("_ZN2cv6imreadERKNSt7__cxx1112basic_stringIcSt11char_traitsIcESaIcEEEi"));
    cv::Mat image;
    try {
        const Quiet here;
        image = read(memory.name(), cv::IMREAD_UNCHANGED);
    } catch (const cv::Exception&) { // which is told as what returns no image
    }
    if (!Quiet::tiff_error().empty())
        refuse(file, "is damaged or cut short (" + Quiet::tiff_error() + "); write or copy it again");
    if (image.size() != size || image.empty())
        refuse_undecoded(file);
    return image;
}

cv::Mat decoded(const std::filesystem::path& file, Bytes& bytes, cv::Size size) {
    const MemoryFile memory(file, bytes);
    Bytes().swap(bytes);
    return decoded(file, memory, size);
}

Bytes encoded(const std::string& extension, const cv::Mat& bgr, const std::vector<int>& parameters) {
    const auto encode = reinterpret_cast<decltype(&cv::imencode)>(
        codec_function("_ZN2cv8imencodeERKNSt7__cxx1112basic_stringIcSt11char_traitsIcESaIcEEERKNS_11_InputArrayE"
                       "RSt6vectorIhSaIhEERKSB_IiSaIiEE"));
    Bytes bytes;
    bool done = false;
    try {
        const Quiet here;
        done = encode(extension, bgr, bytes, parameters);
    } catch (const cv::Exception&) {
    }
    if (!done)
        throw Error("OpenCV writes no " + extension + " of " + described(bgr.size()) +
                    " pixels; write an .exr or .npy");
    return bytes;
}

std::optional<PictureFile> read_by_opencv(const std::filesystem::path& file, Bytes& bytes) {
    using namespace std::string_view_literals;
    const std::string_view begin = text_of(bytes).substr(0, 10);
    const auto is_one_of = [&](std::initializer_list<std::string_view> magics) {
        return std::ranges::any_of(magics, [&](std::string_view magic) { return begin.starts_with(magic); });
    };
    if (is_one_of({"\x89PNG\r\n\x1a\n"}))
        return read_png(file, bytes);
    if (is_one_of({"\xff\xd8\xff"}))
        return read_jpeg(file, bytes);
    if (is_one_of({"II\x2a\0"sv, "II\x2b\0"sv, "MM\0\x2a"sv, "MM\0\x2b"sv}))
        return read_tiff(file, bytes);
    if (is_one_of({"#?RADIANCE", "#?RGBE"}))
        return read_radiance(file, bytes);
    return std::nullopt;
}

} // namespace fathom::io
