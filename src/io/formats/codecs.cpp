// OpenCV's codecs bring GDAL and some hundred libraries, which take 0.15 s to load: so they are loaded when an image needs them.
#include "codecs.hpp"

#include <fathom/error.hpp>

#include <opencv2/imgcodecs.hpp>

#include <dlfcn.h>
#include <sys/mman.h>
#include <unistd.h>
#include <zlib.h>

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

thread_local bool quiet = false;           // what this thread prints to stderr goes nowhere
thread_local std::string first_tiff_error; // which OpenCV forgives in places

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

/// OpenCV prints to std::cerr, and libpng and libjpeg to C's stderr, what a refusal says in one line. While one of these lives, its
/// thread prints nothing there.
class Quiet {
public:
    Quiet() {
        const std::lock_guard lock(mutex);
        static FILE* const others_only = [] {
            const auto write = [](void*, const char* text, std::size_t size) {
                if (!quiet)
                    std::fwrite(text, 1, size, before);
                return static_cast<ssize_t>(size);
            };
            FILE* stream = fopencookie(nullptr, "w", {nullptr, write, nullptr, nullptr});
            std::setvbuf(stream, nullptr, _IONBF, 0);
            return stream;
        }();
        if (!dynamic_cast<OthersOnly*>(std::cerr.rdbuf()))
            std::cerr.rdbuf(new OthersOnly(std::cerr.rdbuf())); // for as long as anything prints
        if (alive++ == 0)
            before = std::exchange(stderr, others_only);
        quiet = true;
    }
    Quiet(const Quiet&) = delete;
    Quiet& operator=(const Quiet&) = delete;
    ~Quiet() {
        const std::lock_guard lock(mutex);
        quiet = false;
        if (--alive == 0)
            stderr = before;
    }

private:
    static inline std::mutex mutex;
    static inline int alive = 0;
    static inline FILE* before = nullptr;
};

using TiffErrorHandler = void (*)(void* file, const char* from, const char* format, std::va_list);
TiffErrorHandler others_errors = nullptr;

void keep_tiff_error(void* file, const char* from, const char* format, std::va_list arguments) {
    if (!quiet) {
        if (others_errors)
            others_errors(file, from, format, arguments);
    } else if (first_tiff_error.empty()) {
        char text[256];
        std::vsnprintf(text, sizeof text, format, arguments);
        first_tiff_error = text;
    }
}

struct Codecs {
    cv::Mat (*read)(const cv::String&, int) = nullptr;
    bool (*encode)(const cv::String&, cv::InputArray, std::vector<unsigned char>&, const std::vector<int>&) = nullptr;
};

const Codecs& codecs() {
    static const Codecs loaded = [] {
        void* library = dlopen(FATHOM_IMGCODECS, RTLD_LAZY | RTLD_LOCAL);
        Codecs found;
        const auto find = [&](auto& function, const char* name) {
            if (library)
                function = reinterpret_cast<std::decay_t<decltype(function)>>(dlsym(library, name));
        };
        find(found.read, "_ZN2cv6imreadERKNSt7__cxx1112basic_stringIcSt11char_traitsIcESaIcEEEi");
        find(found.encode, "_ZN2cv8imencodeERKNSt7__cxx1112basic_stringIcSt11char_traitsIcESaIcEEERKNS_11_InputArrayE"
                           "RSt6vectorIhSaIhEERKSB_IiSaIiEE");
        if (!found.read || !found.encode)
            throw Error(std::string("OpenCV's codecs, which read and write .png, .jpg, .tif, .pgm and .hdr, cannot be "
                                    "loaded (") +
                        [] {
                            const char* said = dlerror();
                            return std::string(said ? said : "of another kind");
                        }() +
                        "); install OpenCV's imgcodecs, or use .exr, .npy or .pfm");
        TiffErrorHandler (*set_handler)(TiffErrorHandler) = nullptr;
        find(set_handler, "TIFFSetErrorHandlerExt");
        if (set_handler)
            others_errors = set_handler(keep_tiff_error);
        return found;
    }();
    return loaded;
}

/// A file in memory that has a name for others.
class MemoryFile {
public:
    explicit MemoryFile(View bytes) : descriptor_(memfd_create("image", MFD_CLOEXEC)) {
        while (descriptor_ >= 0 && !bytes.empty()) {
            const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
            if (written < 0 && errno != EINTR)
                return;
            bytes = bytes.subspan(static_cast<std::size_t>(std::max<ssize_t>(written, 0)));
        }
        is_whole_ = descriptor_ >= 0 && ::access(name().c_str(), R_OK) == 0;
    }
    MemoryFile(const MemoryFile&) = delete;
    MemoryFile& operator=(const MemoryFile&) = delete;
    ~MemoryFile() { ::close(descriptor_); }

    bool is_whole() const { return is_whole_; }
    std::string name() const { return "/proc/self/fd/" + std::to_string(descriptor_); }

private:
    int descriptor_;
    bool is_whole_ = false;
};

} // namespace

// From a file in memory: cv::imdecode refuses tiles of a TIFF that cv::imread takes, and writes Radiance's pictures into /tmp.
cv::Mat decoded(const std::filesystem::path& file, Bytes& bytes, cv::Size size) {
    const Codecs& by = codecs();
    const MemoryFile memory(bytes);
    if (!memory.is_whole())
        refuse(file, std::string("cannot be handed to OpenCV through a file in memory (") + std::strerror(errno) +
                         "); check the limits of memory and of file sizes, and that /proc is there");
    Bytes().swap(bytes);
    cv::Mat image;
    first_tiff_error.clear();
    try {
        const Quiet here;
        image = by.read(memory.name(), cv::IMREAD_UNCHANGED);
    } catch (const cv::Exception&) { // which is told as what returns no image
    }
    if (first_tiff_error.starts_with(memory.name()))
        first_tiff_error.erase(0, memory.name().size() + 2);
    if (!first_tiff_error.empty())
        refuse(file, "is damaged or cut short (" + first_tiff_error + "); write or copy it again");
    if (image.size() != size || image.empty())
        refuse_undecoded(file);
    return image;
}

void check_codec_size(const std::filesystem::path& file, long long width, long long height) {
    constexpr long long longest = 1 << 20;
    check_size(file, width, height);
    if (std::max(width, height) > longest)
        refuse(file,
               "has " + described(cv::Size(static_cast<int>(width), static_cast<int>(height))) +
                   " pixels; OpenCV reads at most 1048576 of its kind in a row or column: save .exr, .npy or .pfm");
}

Bytes encoded(const std::string& extension, const cv::Mat& bgr, const std::vector<int>& parameters) {
    const Codecs& by = codecs();
    Bytes bytes;
    bool done = false;
    try {
        const Quiet here;
        done = by.encode(extension, bgr, bytes, parameters);
    } catch (const cv::Exception&) {
    }
    if (!done)
        throw Error("OpenCV writes no " + extension + " of " + described(bgr.size()) +
                    " pixels; write an .exr or .npy");
    return bytes;
}

Bytes deflated(View content) {
    uLongf length = compressBound(static_cast<uLong>(content.size()));
    Bytes compressed(length);
    compress(compressed.data(), &length, content.data(), static_cast<uLong>(content.size()));
    compressed.resize(length);
    return compressed;
}

std::optional<PictureFile> read_by_opencv(const std::filesystem::path& file, Bytes& bytes, bool as_counted) {
    using namespace std::string_view_literals;
    const std::string_view begin(reinterpret_cast<const char*>(bytes.data()), std::min<std::size_t>(bytes.size(), 10));
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
    if (is_one_of({"P2", "P5"}) && begin.size() > 2 && " \t\n\v\f\r"sv.find(begin[2]) != begin.npos)
        return read_pgm(file, bytes, as_counted);
    return std::nullopt;
}

} // namespace fathom::io
