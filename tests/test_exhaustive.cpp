// Every 16-bit and every 24-bit code of a dozen cameras, with both arithmetics.
// The truth is long double here, itself held against __float128.

#include "catch.hpp"
#include "judge.hpp"

#include <fathom/fathom.hpp>

#include <mutex>

using namespace fathom;
using oracle::Subject;

namespace {

constexpr int side = 4096; // side² codes of 24 bits
constexpr double infinity = std::numeric_limits<double>::infinity();

std::vector<Subject> cameras() {
    const DepthSpan far_away{0.1, 1e8}, reversed{0.1, infinity, DepthOrder::reversed};
    Subject logarithmic = oracle::from_field_of_view(1.1, 1.5, {0.1, 1e4});
    logarithmic.camera.encoding = Encoding::logarithmic;
    logarithmic.camera.far_plane = 1e4;
    Subject median = logarithmic;
    median.camera.encoding = Encoding::median;
    median.camera.median = 4;
    const Subject room = oracle::from_field_of_view(1.1, 1.5, {0.1, 100});
    const Subject cases[] = {
        oracle::named(oracle::from_edges({-0.01, 0.2, 0.3, 0.5}, far_away), "off-centre, far/near 1e9"),
        oracle::named(oracle::from_field_of_view(1.1, 1.5, reversed, Convention::direct3d()), "reversed infinite"),
        oracle::named(with_oblique_near_plane(room, {0.3, 0.2, -1, -0.2}), "oblique"),
        oracle::named(oracle::from_orthographic({-5, 7, -4, 3}, {-3, 1e3}, Convention::vulkan()), "orthographic"),
        oracle::named(
            with_oblique_near_plane(oracle::from_orthographic({-5, 7, -4, 3}, {-3, 100}), {0.3, -0.2, -1, -2}),
            "oblique orthographic"),
        oracle::named(oracle::from_matrix(oracle::tilted(oracle::perspective_matrix(0.7, 0.5, 0.1, 100), 0.2, -0.1)),
                      "tilted"),
        oracle::named(median, "median"),
        oracle::named(logarithmic, "logarithmic"),
    };
    std::vector<Subject> subjects(std::begin(cases), std::end(cases));
    for (Subject& subject : subjects)
        subject.camera.width = subject.camera.height = side;
    return subjects;
}

struct Outcome {
    oracle::Worst worst;
    oracle::Faults faults;
};

/// Every code of a storage against the truth, on all cores.
template <typename Code>
void every_code(const Subject& subject, Storage storage, int width) {
    const auto count = static_cast<std::size_t>(width) * static_cast<std::size_t>(width);
    std::vector<Code> codes(count);
    for (std::size_t i = 0; i < count; ++i)
        codes[i] = static_cast<Code>(i);
    const oracle::Truth truth(subject, storage);
    const Form form = depth_form(subject.camera, storage).form;

    constexpr Arithmetic arithmetics[] = {Arithmetic::fp64, Arithmetic::two_float};
    std::vector<float> depth[2];
    oracle::Promise promises[2];
    Outcome outcomes[2];
    for (std::size_t i = 0; i < 2; ++i) {
        depth[i].resize(count);
        promises[i] = oracle::promise(form, arithmetics[i]);
        const Device& device = oracle::device(arithmetics[i]);
        const Image image = Image::from_host(device, element_of(storage), codes.data(), {width, width});
        const Image result = Image::onto_host(device, Element::f32, depth[i].data(), {width, width});
        linearize({image, subject.camera, storage}, result, {Background::decode});
        result.download(depth[i].data());
    }

    std::mutex mutex;
    const auto judge_rows = [&](int begin, int end) {
        Outcome mine[2];
        for (int row = begin; row < end; ++row)
            for (int column = 0; column < width; ++column) {
                const auto at =
                    static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column);
                const auto v = static_cast<double>(at);
                const double x = column + 0.5, y = row + 0.5;
                const long double exact = truth.quick_depth(v, x, y);
                const double unit = oracle::quick_ulp(static_cast<double>(exact));
                for (std::size_t i = 0; i < 2; ++i) {
                    const auto error =
                        static_cast<double>(std::abs(static_cast<long double>(depth[i][at]) - exact)) / unit;
                    if (!(error <= promises[i].ulps) || !(exact > 0)) // what needs more than a glance
                        mine[i].faults.add(
                            oracle::judge(subject, truth, form, promises[i], v, x, y, depth[i][at], mine[i].worst));
                    else if (error > mine[i].worst.ulps)
                        mine[i].worst.add(error, promises[i].ulps, 0, 1, subject.name, v, x, y);
                    else
                        ++mine[i].worst.checked;
                }
            }
        const std::lock_guard lock(mutex);
        for (std::size_t i = 0; i < 2; ++i) {
            outcomes[i].worst.add(mine[i].worst);
            outcomes[i].faults.add(mine[i].faults.text());
        }
    };
    const int workers = std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 16);
    std::vector<std::thread> threads;
    for (int i = 0; i < workers; ++i)
        threads.emplace_back(judge_rows, width * i / workers, width * (i + 1) / workers);
    for (std::thread& thread : threads)
        thread.join();
    for (std::size_t i = 0; i < 2; ++i) {
        outcomes[i].worst.print(subject.name + ", " + to_string(storage) + ", " + oracle::name(arithmetics[i]));
        CHECK(outcomes[i].faults.text() == "");
        CHECK(static_cast<std::size_t>(outcomes[i].worst.checked) > count / 3);
    }
}

} // namespace

TEST_CASE("oracle: long double is __float128 to a thousandth of an ulp, and to the condition of its sums", "[exact]") {
    for (const Subject& subject : cameras()) {
        const oracle::Truth truth(subject, Storage::uint24);
        const Form form = depth_form(subject.camera, Storage::uint24).form;
        double worst = 0;
        for (int code = 0; code < side * side; code += 4099) {
            const double x = code % side + 0.5, y = code / side + 0.5;
            const oracle::Quad exact = truth.depth(code, x, y);
            const auto quick = static_cast<oracle::Quad>(truth.quick_depth(code, x, y));
            if (quick == exact)
                continue; // infinities too
            const auto error =
                static_cast<double>((quick > exact ? quick - exact : exact - quick) / oracle::ulp(exact));
            const auto condition = static_cast<double>(truth.condition(form, code, x, y));
            worst = std::max(worst, error / (1e-3 + condition * 0x1p-36));
        }
        INFO(subject.name);
        CHECK(worst <= 1);
    }
}

TEST_CASE("exhaustive: all 65536 codes of 16 bits", "[exact]") {
    for (const Subject& subject : cameras())
        every_code<std::uint16_t>(subject, Storage::uint16, 256);
}

TEST_CASE("exhaustive: all 16777216 codes of 24 bits", "[exhaustive]") {
    for (const Subject& subject : cameras())
        every_code<std::uint32_t>(subject, Storage::uint24, side);
}
