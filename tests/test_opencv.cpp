// cv::Mat in and out: the library's own results, without a copy on a CPU.
#include "catch.hpp"
#include "opencv_forms.hpp"

#include <fathom/opencv.hpp>

#include <opencv2/core.hpp>

using namespace fathom;
using namespace fathom::opencv_forms;

TEST_CASE("opencv: a matrix's type says how depth is stored", "[opencv]") {
    CHECK(storage_of(cv::Mat(1, 1, CV_32FC1)) == Storage::float32);
    CHECK(storage_of(cv::Mat(1, 1, CV_16FC1)) == Storage::float16);
    CHECK(storage_of(cv::Mat(1, 1, CV_16UC1)) == Storage::uint16);
    CHECK(storage_of(cv::Mat(1, 1, CV_32SC1)) == Storage::uint24);
    for (const int type : {CV_8UC1, CV_8UC3, CV_8UC4, CV_64FC1, CV_32FC3, CV_16SC1})
        CHECK_THROWS_AS(storage_of(cv::Mat(1, 1, type)), std::invalid_argument);
}

TEST_CASE("opencv: a matrix goes to the device and comes back, whatever its type", "[opencv]") {
    const auto device = Device::open("cpu");
    for (const int type : {CV_8UC3, CV_16UC1, CV_32SC1, CV_16FC1, CV_32FC1, CV_32FC3, CV_32FC4}) {
        cv::Mat mat(20, 30, type);
        cv::randu(mat.reshape(1), 0, 100);
        const auto part = mat(cv::Rect(3, 5, 17, 9));
        CHECK(same(to_mat(to_device(device, mat)), mat));
        CHECK(same(to_mat(to_device(device, part)), part.clone()));
    }
    const cv::Mat empty, doubles(2, 2, CV_64FC1);
    CHECK_THROWS_AS(to_device(device, empty), std::invalid_argument);
    CHECK_THROWS_AS(to_device(device, doubles), std::invalid_argument);
}

TEST_CASE("opencv: on a CPU the device sees the matrix itself", "[opencv]") {
    const auto device = Device::open("cpu");
    cv::Mat mat(20, 32, CV_32FC1, cv::Scalar(1));
    const auto image = to_device(device, mat);
    mat.at<float>(3, 4) = 5;
    CHECK(to_mat(image).at<float>(3, 4) == 5);
}

// Only a matrix that lives on can be handed to the device.
template <typename Mat>
concept goes_to_device = requires(const Device& device, Mat&& mat) {
    to_device(device, std::forward<Mat>(mat));
};
static_assert(goes_to_device<cv::Mat&> && goes_to_device<const cv::Mat&> && goes_to_device<cv::Mat1f&>);
static_assert(!goes_to_device<cv::Mat> && !goes_to_device<const cv::Mat> && !goes_to_device<cv::Mat1f>);

TEST_CASE("opencv: every operation gives what it gives on images, and reuses a result that fits", "[opencv]") {
    const auto device = Device::open("cpu");
    const cv::Mat stored = depths(), color = picture();
    const Part stored_part(stored), color_part(color);
    for (const Given& form : forms(device, device, stored, color)) {
        INFO(form.name);
        cv::Mat fresh;
        form.run(stored, color, fresh);
        CHECK(same(fresh, form.expected));

        cv::Mat reused(form.expected.size(), form.expected.type(), cv::Scalar::all(7));
        const void* const data = reused.data;
        form.run(stored, color, reused);
        CHECK(reused.data == data);
        CHECK(same(reused, form.expected));

        cv::Mat other(3, 3, CV_8UC1);
        form.run(stored, color, other);
        CHECK(same(other, form.expected));

        Part onto(cv::Mat::zeros(form.expected.size(), form.expected.type()));
        const cv::Mat before = onto.around.clone();
        const void* const within = onto.within.data;
        form.run(stored_part.within, color_part.within, onto.within);
        CHECK(onto.within.data == within);
        CHECK(same(onto.within.clone(), form.expected));
        CHECK(onto.same_around(before));
    }
}

TEST_CASE("opencv: all results of an operation come in one call", "[opencv]") {
    const auto device = Device::open("cpu");
    const cv::Mat stored = depths();
    const StoredDepth depth{to_device(device, stored), camera()};
    const Occlusion occlusion = ssao(depth, 0.5, {.bent_normal = true, .confidence = true});
    cv::Mat visibility, bent_normal, confidence;
    ssao(device, stored, camera(), 0.5,
         {.visibility = visibility, .bent_normal = bent_normal, .confidence = confidence},
         {.bent_normal = true, .confidence = true});
    CHECK(same(visibility, to_mat(occlusion.visibility)));
    CHECK(same(bent_normal, to_mat(occlusion.bent_normal)));
    CHECK(same(confidence, to_mat(occlusion.confidence)));
    constexpr DofMasksOptions weights{.near_weight = true, .focus_weight = true, .far_weight = true};
    const DofMasks masks = dof_masks(depth, lens, weights);
    cv::Mat coc, near_weight, focus_weight, far_weight;
    dof_masks(device, stored, camera(), lens,
              {.coc = coc, .near_weight = near_weight, .focus_weight = focus_weight, .far_weight = far_weight},
              weights);
    CHECK(same(coc, to_mat(masks.coc)));
    CHECK(same(near_weight, to_mat(masks.near_weight)));
    CHECK(same(focus_weight, to_mat(masks.focus_weight)));
    CHECK(same(far_weight, to_mat(masks.far_weight)));
    CHECK_THROWS_WITH(dof_masks(device, stored, camera(), lens, {.tile_min_coc = coc}),
                      "tile_min_coc has a matrix to be written into, but the options do not ask for it");
    CHECK_THROWS_WITH(ssao(device, stored, camera(), 0.5, visibility, {.confidence = true}),
                      "confidence is asked for and has no matrix to be written into");
    ssao(device, stored, camera(), 0.5, visibility, {.region = Region{3, 4, 11, 7}});
    CHECK(same(visibility, to_mat(occlusion.visibility)(cv::Rect(3, 4, 11, 7)).clone()));
}

TEST_CASE("opencv: a float matrix may be its own result", "[opencv]") {
    const auto device = Device::open("cpu");
    const cv::Mat stored = depths();
    cv::Mat expected;
    linearize(device, stored, camera(), expected);
    cv::Mat both = stored.clone();
    const void* const data = both.data;
    linearize(device, both, camera(), both);
    CHECK(both.data == data);
    CHECK(same(both, expected));
    cv::Mat codes(20, 30, CV_16UC1, cv::Scalar(40000)), kept = codes;
    linearize(device, codes, camera(), codes); // another type: a new matrix
    CHECK(codes.type() == CV_32FC1);
    CHECK(kept.at<ushort>(3, 4) == 40000);
}

TEST_CASE("opencv: three and four bytes are read alike, and another storage can be asked for", "[opencv]") {
    const auto device = Device::open("cpu");
    cv::Mat three(20, 30, CV_8UC3), four(20, 30, CV_8UC4), plain, dropped;
    cv::randu(three, 0, 256);
    cv::randu(four, 0, 256);
    constexpr int from_to[] = {0, 0, 1, 1, 2, 2};
    cv::mixChannels(&three, 1, &four, 1, from_to, 3);
    linearize(device, three, camera(), plain, {}, Storage::bgr8_red_low);
    linearize(device, four, camera(), dropped, {}, Storage::bgr8_red_low);
    CHECK_THROWS_WITH(linearize(device, three, camera(), plain), ContainsSubstring("IMREAD_UNCHANGED"));
    CHECK_THROWS_WITH(linearize(device, cv::Mat(), camera(), plain), ContainsSubstring("empty"));
    CHECK(same(plain, dropped));
    cv::Mat turned;
    linearize(device, three, camera(), turned, {}, Storage::rgb8_red_low);
    CHECK(same(turned, to_mat(linearize({to_device(device, three), camera(), Storage::rgb8_red_low}).image)));
    CHECK(!same(turned, plain));
    cv::Mat result;
    CHECK_THROWS_AS(linearize(device, three, camera(), result, {}, Storage::uint16), std::invalid_argument);
}

TEST_CASE("opencv: matrices that do not fit are refused", "[opencv]") {
    const auto device = Device::open("cpu");
    const cv::Mat stored = depths();
    cv::Mat result;
    CHECK_THROWS_AS(unproject(device, stored, camera(), result, {.channels = 2}), std::invalid_argument);
    auto unsized = camera();
    unsized.width = unsized.height = 0; // taken from the matrix
    linearize(device, stored, unsized, result);
    CHECK(same(result, to_mat(linearize({to_device(device, stored), camera()}).image)));
    // A region has the whole's camera, which is cropped, or its own.
    cv::Mat whole;
    const cv::Rect part(3, 2, 7, 7);
    unproject(device, stored, camera(), whole);
    unproject(device, stored(part), camera(), result);
    CHECK(same(result, whole(part).clone()));
    unproject(device, stored(part), cropped(camera(), 3, 2, 7, 7), result);
    CHECK(same(result, whole(part).clone()));
    CHECK_THROWS_WITH(unproject(device, stored(part), unsized, result), ContainsSubstring("the camera has no size"));
    CHECK_THROWS_AS(linearize(device, stored(part).clone(), camera(), result), std::invalid_argument);
    CHECK_THROWS_AS(linearize(device, cv::Mat(), camera(), result), std::invalid_argument);
    const cv::Mat color = picture();
    CHECK_THROWS_AS(dof(device, stored, camera(), color(cv::Rect(0, 0, 7, 7)), lens, result), std::invalid_argument);
}
