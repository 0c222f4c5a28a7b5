// Doubts about depth without a device and without the program: of an image, and of a sample of it.
#include "catch.hpp"
#include "scene/scene.hpp"

#include <fathom/doubts.hpp>
#include <fathom/error.hpp>
#include <fathom/pixel_rays.hpp>
#include <fathom/ranking.hpp>

#include <locale>

using namespace fathom;

namespace {

constexpr int width = 1920, height = 1080;

// Metres under a perspective of 60 degrees.
Camera camera_of(Encoding encoding, int columns = width, int rows = height) {
    Camera camera;
    camera.projection = perspective(1.0472, static_cast<double>(columns) / rows, {0.1, 100});
    camera.width = columns;
    camera.height = rows;
    camera.encoding = encoding;
    return camera;
}

template <typename Element>
HostDepth host(const std::vector<Element>& values, Storage storage, int columns = width) {
    return {values.data(), columns, static_cast<int>(values.size()) / columns,
            static_cast<std::size_t>(columns) * sizeof(Element), storage};
}

// A plane that is slanted: metres from 2 to 10.
double plane(int i) {
    return 1 / (0.5 - 0.4 * i / (width * height - 1));
}

template <typename Element>
std::vector<Element> image(double (*stored)(double z)) {
    std::vector<Element> values;
    for (int i = 0; i < width * height; ++i)
        values.push_back(static_cast<Element>(stored(plane(i))));
    return values;
}

// Surfaces that a camera sees straight on: its distance along the axis where the ray (x, y, 1) meets the first of them, y down.
struct StraightOn {
    struct Box {
        Eigen::Vector3d low, high;
    };
    std::vector<Box> boxes;
    double wall = std::numeric_limits<double>::infinity(), floor = wall; ///< how far ahead, and how far below

    double operator()(double x, double y) const {
        double nearest = std::min(wall, y > 0 ? floor / y : wall);
        const Eigen::Vector3d ray(x, y, 1);
        for (const Box& box : boxes) {
            const Eigen::Array3d a = box.low.array() / ray.array(), b = box.high.array() / ray.array();
            const double enters = a.min(b).maxCoeff(), leaves = a.max(b).minCoeff();
            if (enters > 0 && enters < leaves)
                nearest = std::min(nearest, enters);
        }
        return nearest;
    }
};

StraightOn straight_on(const std::string& kind, double right, double bottom, std::mt19937& random) {
    const auto number = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
    const double z = number(0.5, 20), width = 2 * right * z, height = 2 * bottom * z, wide = 1e3 * z;
    StraightOn scene;
    if (kind != "street")
        scene.wall = z;
    if (kind == "room" || kind == "street")
        scene.floor = number(0.2, 0.5) * bottom * z;
    const auto add = [&](Eigen::Vector3d low, Eigen::Vector3d high) { scene.boxes.push_back({low, high}); };
    const int boxes = kind == "table" ? 2 : kind == "wall" ? 0 : 12;
    if (kind == "steps")
        for (int i = 0; i < 6; ++i)
            add({-wide, height * (0.4 - 0.12 * i), z * (0.5 + 0.06 * i)}, {wide, wide, wide});
    else if (kind == "shelves")
        for (int i = 0; i < 4; ++i) {
            const double y = height * (-0.3 + 0.25 * i);
            add({-wide, y, 0.8 * z}, {wide, y + 0.02 * z, z});
            for (double x = -0.5 * width; x < 0.5 * width;) {
                const double thickness = number(0.03, 0.1) * z;
                add({x, y - number(0.1, 0.22) * height, number(0.82, 0.9) * z}, {x + thickness, y, z});
                x += thickness;
            }
        }
    else
        for (int i = 0; i < boxes; ++i) {
            const double near = number(0.6, 0.95) * z, x = number(-0.5, 0.4) * width, y = number(-0.5, 0.4) * height;
            add({x, y, near}, {x + number(0.1, 0.3) * width, y + number(0.1, 0.3) * height, z});
        }
    return scene;
}

// Both give one sentence with these words.
void check_told(const Camera& camera, const HostDepth& stored, const std::string& words) {
    for (const auto& ask : {depth_doubts, depth_doubts_of_sample}) {
        const std::vector<std::string> said = ask(camera, stored);
        REQUIRE(said.size() == 1);
        INFO(said.front());
        CHECK(said.front().find(words) != std::string::npos);
    }
}

void check_silent(const Camera& camera, const HostDepth& stored) {
    CHECK(depth_doubts(camera, stored) == std::vector<std::string>{});
    CHECK(depth_doubts_of_sample(camera, stored) == std::vector<std::string>{});
}

bool says(const std::vector<std::string>& said, const std::string& words) {
    return std::ranges::any_of(said, [&](const std::string& each) { return each.find(words) != std::string::npos; });
}

/// Is it told that flat surfaces are bent under this encoding?
bool says_flat(Camera camera, Encoding encoding, const std::vector<float>& values) {
    camera.encoding = encoding;
    const std::vector<std::string> said = depth_doubts(camera, host(values, Storage::float32, camera.width));
    return std::ranges::any_of(said, [](const std::string& each) { return each.starts_with("flat"); });
}

} // namespace

TEST_CASE("doubts: mistakes are told of an image and of a sample of it, and what is right is not", "[doubts]") {
    const auto metres = image<float>([](double z) { return z; });
    const auto millimetres = image<std::uint16_t>([](double z) { return std::round(1000 * z); });
    Camera camera = camera_of(Encoding::view_z);
    check_silent(camera, host(metres, Storage::float32));
    check_told(camera, host(millimetres, Storage::uint16), "say \"scale\": 0.001");
    camera.scale = 0.001;
    check_silent(camera, host(millimetres, Storage::uint16));
    check_told(camera, host(metres, Storage::float32), "which is \"scale\": 1");

    check_told(camera_of(Encoding::window), host(metres, Storage::float32),
               "and \"window\" depth lies in 0 to 1; are these distances");
    const auto buffer = image<float>([](double z) { return (10 - 1 / z) / (10 - 0.01); });
    check_silent(camera_of(Encoding::window), host(buffer, Storage::float32));
    check_told(camera_of(Encoding::view_z), host(buffer, Storage::float32),
               "flat if the values are depth-buffer values");
    check_silent(camera_of(Encoding::view_z), host(image<float>([](double) { return 1.0; }), Storage::float32));

    Camera from_near = camera_of(Encoding::view_z);
    from_near.near_plane = 1;
    check_silent(from_near, host(metres, Storage::float32));
    check_told(from_near, host(image<float>([](double z) { return z - 1; }), Storage::float32),
               "distances from the near plane on");

    auto sky = metres;
    std::fill_n(sky.begin(), sky.size() / 4, 1e10f);
    check_told(camera_of(Encoding::view_z), host(sky, Storage::float32), "% of the pixels hold 1e+10");
    std::fill_n(sky.begin(), sky.size() / 4, std::numeric_limits<float>::infinity());
    check_silent(camera_of(Encoding::view_z), host(sky, Storage::float32));

    Camera scaled = camera_of(Encoding::view_z); // whose file names a sky that the nearest float only comes close to
    scaled.scale = 0.5;
    std::fill_n(sky.begin(), sky.size() / 4, 1e20f);
    check_told(scaled, host(sky, Storage::float32), "\"background_from\": 1e+20");
    scaled.background = 1e20;
    check_silent(scaled, host(sky, Storage::float32));
}

TEST_CASE("doubts: units that no source of metres or millimetres has are told", "[doubts]") {
    Camera metres = camera_of(Encoding::view_z), millimetres = metres;
    metres.usual_metres = 1000;
    millimetres.usual_metres = 10;
    millimetres.scale = 0.001;
    check_silent(metres, host(image<float>([](double z) { return 100 * z; }), Storage::float32)); // to 1 km
    check_told(metres, host(image<float>([](double z) { return 1000 * z; }), Storage::float32), "\"scale\": 0.001");
    check_silent(millimetres, host(image<std::uint16_t>([](double z) { return 100 * z; }), Storage::uint16));
    check_told(millimetres, host(image<std::uint16_t>([](double z) { return 20 * z; }), Storage::uint16),
               "nearer than such cameras see");
    check_told(millimetres, host(image<std::uint16_t>([](double z) { return 5000 * z; }), Storage::uint16),
               "if the values are those of TUM, say \"scale\": 0.0002");
    check_silent(millimetres,
                 host(image<std::uint16_t>([](double z) { return 2000 * z; }), Storage::uint16)); // to 20 m
    // No advice is the scale that the source has, and what is advised helps.
    for (const double scale : {0.01, 0.001, 0.0002, 0.0001}) {
        Camera source = millimetres;
        source.scale = scale;
        std::vector<float> floats; // from 24 to 120 m
        for (const float z : image<float>([](double z) { return 12 * z; }))
            floats.push_back(z / static_cast<float>(scale));
        const std::vector<std::string> said = depth_doubts(source, host(floats, Storage::float32));
        REQUIRE(said.size() == 1);
        INFO(scale << ": " << said.front());
        CHECK(says(said, "where this source sees little"));
        const auto advice = [](double each) {
            std::ostringstream advised;
            advised << "say \"scale\": " << each;
            return advised.str();
        };
        const auto is_advised = [&](double each) {
            const std::string words = said.front() + ";";
            return words.find(advice(each) + ";") != std::string::npos;
        };
        CHECK_FALSE(is_advised(scale));
        bool is_any = false;
        for (const double other : {0.01, 0.001, 0.0002, 0.0001}) {
            const double median = 12 * (1 / 0.3) * other / scale; // of the slanted plane
            const bool helps = other != scale && median <= 10;
            is_any |= helps;
            CHECK(is_advised(other) == helps);
        }
        CHECK(says(said, "how many metres it has") == !is_any);
    }
    // TUM has five times the millimetres of a Kinect. Here both see 0.5 to 2.5 m.
    Camera tum = millimetres;
    tum.scale = 0.0002;
    const auto kinect = [](double z) { return std::round(250 * z); };
    const auto fives = image<std::uint16_t>([](double z) { return 5 * std::round(250 * z); });
    check_silent(tum, host(fives, Storage::uint16));
    check_told(millimetres, host(fives, Storage::uint16), "--preset tum");
    check_silent(millimetres, host(image<std::uint16_t>(kinect), Storage::uint16));
    check_told(tum, host(image<std::uint16_t>(kinect), Storage::uint16), "if the codes are millimetres");
    check_silent(millimetres, host(image<std::uint16_t>([](double z) { return 10 * std::round(250 * z); }),
                                   Storage::uint16)); // centimetres
    // A wall and a box that are seen straight on have one depth each, which may be multiples of 5.
    std::vector<std::uint16_t> wall(width * height, 4375);
    for (int y = height / 3; y < height / 2; ++y)
        std::fill_n(wall.begin() + y * width + width / 3, width / 5, std::uint16_t{4175});
    check_silent(millimetres, host(wall, Storage::uint16));
    metres.usual_metres = 50;
    check_told(metres, host(image<float>([](double z) { return 100 * z; }), Storage::float32),
               "if the values are centimetres, say \"scale\": 0.01");
    Camera bytes = millimetres;
    check_told(bytes, host(image<std::uint8_t>([](double z) { return 25 * z; }), Storage::uint8), "end at 0.255");
    bytes.scale = 0.02;
    check_silent(bytes, host(image<std::uint8_t>([](double z) { return 25 * z; }), Storage::uint8));
}

TEST_CASE("doubts: a radius and a lens are held against what the image shows", "[doubts]") {
    const auto metres = image<float>([](double z) { return z; }); // 2 to 10
    const Camera camera = camera_of(Encoding::view_z);
    const HostDepth stored = host(metres, Storage::float32);
    const auto one = [](const std::vector<std::string>& said, const std::string& words) {
        REQUIRE(said.size() == 1);
        CHECK_THAT(said.front(), ContainsSubstring(words));
    };
    CHECK(radius_doubts(camera, stored, 0.5).empty());
    for (const double wrong : {-1.0, 0.0, std::nan(""), HUGE_VAL})
        CHECK_THROWS_AS(radius_doubts(camera, stored, wrong), std::invalid_argument);
    one(radius_doubts(camera, stored, 1e-5), "less than half a pixel for most pixels");
    one(radius_doubts(camera, stored, 500), "larger than all that most pixels see");
    const auto doubts_of = [&](const Lens& lens, double most = 512) {
        const LensArguments arguments{.focus = lens.focus,
                                      .f_stop = lens.f_stop,
                                      .focal_length_mm = lens.focal_length_mm,
                                      .mm_per_unit = lens.mm_per_unit};
        return lens_doubts(camera, stored, arguments, circle_of_confusion(lens, camera), Sky::blur, most);
    };
    const Lens right{.f_stop = 2, .focus = 3, .focal_length_mm = 50, .mm_per_unit = 100};
    const auto with = [&](const auto& change) {
        Lens lens = right;
        change(lens);
        return lens;
    };
    CHECK(doubts_of(right).empty());
    one(doubts_of(with([](Lens& lens) { lens.focal_length_mm = 0.05; })),
        "focal_length_mm: 0.05 mm is smaller than any");
    one(doubts_of(with([](Lens& lens) { lens.mm_per_unit = 1e5; })), "nothing is blurred");
    one(doubts_of(right, 0.01), "are cut off at max_coc_px 0.01");
    one(doubts_of(with([](Lens& lens) { lens.focus = 0.9; })), "the focus of 0.9 lies before everything");
}

TEST_CASE("doubts: numbers in a cure are those of JSON, whatever the locale of the process", "[doubts]") {
    struct Comma : std::numpunct<char> {
        char do_decimal_point() const override { return ','; }
    };
    const auto millimetres = image<std::uint16_t>([](double z) { return std::round(1000 * z); });
    const std::locale before = std::locale::global(std::locale(std::locale::classic(), new Comma));
    check_told(camera_of(Encoding::view_z), host(millimetres, Storage::uint16), "say \"scale\": 0.001");
    std::locale::global(before);
}

TEST_CASE("doubts: a sample where nothing was measured does not speak for the image", "[doubts]") {
    std::vector<float> values(static_cast<std::size_t>(width) * height, NAN);
    const Camera camera = camera_of(Encoding::view_z);
    const std::vector<std::string> said = depth_doubts(camera, host(values, Storage::float32));
    REQUIRE(said.size() == 1);
    CHECK(said.front().find("all of its values are NaN") != std::string::npos);
    CHECK(depth_doubts_of_sample(camera, host(values, Storage::float32)) == said);
    values[7] = 3;
    check_silent(camera, host(values, Storage::float32));
}

TEST_CASE("doubts: images of any size will do, and other sizes than the camera's refused", "[doubts]") {
    for (const auto& [columns, rows] : {std::pair{1, 1}, {3, 2}, {7, 100}, {200, 5}}) {
        INFO(columns << " x " << rows);
        const std::vector<float> values(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), 2.0f);
        check_silent(camera_of(Encoding::view_z, columns, rows), host(values, Storage::float32, columns));
        CHECK_THROWS_AS(
            depth_doubts(camera_of(Encoding::view_z, columns, rows + 1), host(values, Storage::float32, columns)),
            std::invalid_argument);
        CHECK_THROWS_AS(depth_doubts_of_sample(camera_of(Encoding::view_z, columns + 1, rows),
                                               host(values, Storage::float32, columns)),
                        std::invalid_argument);
    }
}

TEST_CASE("doubts: what the camera describes is not told, whatever the encoding", "[doubts]") {
    for (const Encoding encoding :
         {Encoding::window, Encoding::view_z, Encoding::ray_distance, Encoding::linear, Encoding::logarithmic,
          Encoding::exponential, Encoding::median, Encoding::inverse, Encoding::inverse_range}) {
        INFO(to_string(encoding));
        Camera camera = camera_of(encoding, 480, 270);
        camera.near_plane = 0.1;
        camera.far_plane = 100;
        camera.median = 3;
        const scene::Rendered image = scene::render(scene::room(), camera);
        check_silent(camera, host(image.stored, Storage::float32, 480));
    }
}

TEST_CASE("doubts: surfaces seen straight on tell distances along the ray from those along the axis", "[doubts]") {
    constexpr int columns = 300, rows = 220;
    std::mt19937 random(1);
    std::size_t scenes = 0;
    for (const std::string kind : {"wall", "table", "boxes", "room", "street", "steps", "shelves"}) {
        int missed = 0, missed_axis = 0;
        for (const double fov : {45, 60, 75, 90, 110, 45, 60, 75, 90, 110}) {
            INFO(kind << ", " << fov << " degrees, scene " << scenes++);
            const double right = std::tan(fov * std::numbers::pi / 360), bottom = right * rows / columns;
            const StraightOn scene = straight_on(kind, right, bottom, random);
            std::vector<float> axis, ray;
            for (int i = 0; i < columns * rows; ++i) {
                const double x = right * (2 * (i % columns + 0.5) / columns - 1),
                             y = bottom * (2 * (i / columns + 0.5) / rows - 1), z = scene(x, y);
                axis.push_back(static_cast<float>(z));
                ray.push_back(static_cast<float>(z * std::sqrt(1 + x * x + y * y)));
            }
            Camera camera = camera_of(Encoding::ray_distance, columns, rows);
            camera.projection = perspective(2 * std::atan(bottom), static_cast<double>(columns) / rows, {0.1, 100});
            const auto told = [&](Encoding encoding, const std::vector<float>& values) {
                return says_flat(camera, encoding, values);
            };
            CHECK(!told(Encoding::ray_distance, ray));
            CHECK(!told(Encoding::view_z, axis));
            missed += !told(Encoding::view_z, ray);
            missed_axis += !told(Encoding::ray_distance, axis);
        }
        INFO(kind);
        CHECK(missed <= 1);
        if (kind != "wall" && kind != "table") // most of which may be a sensor's farthest distance
            CHECK(missed_axis <= 1);
    }
}

TEST_CASE("doubts: numbers that are no depth are told with their key, unless the camera says them", "[doubts]") {
    constexpr int columns = 320, rows = 240;
    Camera camera = camera_of(Encoding::view_z, columns, rows);
    // A slanted plane that holds a number in a tenth of its pixels.
    const auto with = [&](double number, double (*stored)(double z)) {
        std::vector<double> values;
        for (int i = 0; i < columns * rows; ++i)
            values.push_back(
                i % columns < 96 && i / columns < 80 ? number : stored(plane(i * (width * height / columns / rows))));
        return values;
    };
    const auto told = [&](const std::vector<double>& values, Storage storage) {
        std::vector<float> floats(values.begin(), values.end());
        std::vector<std::uint16_t> codes;
        for (const double value : values)
            codes.push_back(static_cast<std::uint16_t>(value));
        const HostDepth stored =
            storage == Storage::uint16 ? host(codes, storage, columns) : host(floats, storage, columns);
        std::string all;
        for (const std::string& each : depth_doubts(camera, stored))
            all += each + "\n";
        return all;
    };
    const auto metres = [](double z) { return z; };
    const auto millimetres = [](double z) { return std::round(1000 * z); };
    const auto disparity = [](double z) { return std::round(400 / z); };
    struct Case {
        Encoding encoding;
        double scale;
        Storage storage;
        double (*stored)(double);
        std::vector<double> numbers, others; ///< that are told, and that are not
    };
    for (const Case& each :
         {Case{Encoding::view_z,
               1,
               Storage::float32,
               metres,
               {0, 255, 300, 10000, 65520, 32768, 9999, -9999, -1},
               {11, 12345}},
          {Encoding::view_z, 0.001, Storage::uint16, millimetres, {0, 65535, 65520, 32767}, {9999, 10000, 12000}},
          {Encoding::ray_distance, 1, Storage::float32, metres, {100, 1000, 1e6}, {11}},
          {Encoding::inverse, 400, Storage::uint16, disparity, {0, 65520, 65535, 4095}, {260}},
          {Encoding::inverse, 400, Storage::float32, disparity, {65535}, {0}}})
        for (const bool is_number : {true, false})
            for (const double number : is_number ? each.numbers : each.others) {
                camera.encoding = each.encoding;
                camera.scale = each.scale;
                camera.missing.reset();
                camera.background.reset();
                const std::vector<double> values = with(number, each.stored);
                const std::string said = told(values, each.storage);
                INFO(to_string(each.encoding) << ", " << number << ": " << said);
                CHECK((said.find("stands apart") != std::string::npos) == is_number);
                CHECK((said.find("\"missing\": ") != std::string::npos) == is_number);
                camera.missing = number;
                CHECK(told(values, each.storage).find("stands apart") == std::string::npos);
                camera.missing.reset();
                camera.background = number;
                CHECK(told(values, each.storage).find("stands apart") == std::string::npos);
            }
    camera = camera_of(Encoding::view_z, columns, rows);
    camera.scale = 0.001;
    auto filtered = with(0, millimetres);
    camera.missing = 0;
    CHECK(told(filtered, Storage::uint16) == "");
    for (std::size_t i = filtered.size() - 1; i > 0; --i)
        filtered[i] = std::round((filtered[i] + filtered[i - 1]) / 2);
    const std::string resized = "it was filtered or resized";
    CHECK(told(filtered, Storage::uint16).find(resized) != std::string::npos);
    const auto mixed = [&](double number, double (*stored)(double)) {
        std::vector<double> values = with(number, stored);
        for (std::size_t i = values.size() - 1; i > 0; --i)
            values[i] = (values[i] + values[i - 1]) / 2;
        return values;
    };
    for (const double number : {0.0, -1.0}) { // which nobody names
        CHECK(told(mixed(number, metres), Storage::float32).find(resized) != std::string::npos);
        CHECK(told(with(number, metres), Storage::float32).find(resized) == std::string::npos);
    }
    camera.encoding = Encoding::window;
    const auto buffer = [](double z) { return (10 - 1 / z) / (10 - 0.01); };
    CHECK(told(mixed(1, buffer), Storage::float32).find(resized) != std::string::npos);
    CHECK(told(with(1, buffer), Storage::float32) == "");

    camera.scale = 1;
    camera.near_plane = 1;
    camera.far_plane = 60;
    camera.missing.reset();
    const auto white_near = [](double z) { return std::round((60 - z) / 59 * 65535); };
    camera.encoding = Encoding::linear;
    CHECK(told(with(0, white_near), Storage::uint16).find("near is white, say \"near\": ") != std::string::npos);
    camera.encoding = Encoding::inverse_range; // which has no far plane before the near one
    camera.depth_range = {1, 0};
    const auto inverse_range = [](double z) { return std::round((1 / z - 1 / 60.0) / (1 - 1 / 60.0) * 65535); };
    CHECK(told(with(65535, [](double z) { return std::round(60000 * (1 - 1 / z)); }), Storage::uint16)
              .find("say \"depth_range\": [") != std::string::npos);
    CHECK(told(with(0, inverse_range), Storage::uint16) == "");
    camera.depth_range = {0, 1};
    camera.encoding = Encoding::linear;
    camera.near_plane = 60;
    camera.far_plane = 1;
    CHECK(told(with(0, white_near), Storage::uint16) == "");
}

TEST_CASE("doubts: a block of a number is told of a sample, too", "[doubts]") {
    std::mt19937 random(5);
    for (const auto& [columns, rows] : {std::pair(200, 150), {320, 240}, {1920, 1080}})
        for (const double part : {0.01, 0.027, 0.2})
            for (int i = 0; i < 10; ++i) {
                const double across = std::sqrt(part);
                const int wide = static_cast<int>(across * columns), high = static_cast<int>(across * rows),
                          left = static_cast<int>(random() % static_cast<unsigned>(columns - wide)),
                          top = static_cast<int>(random() % static_cast<unsigned>(rows - high));
                std::vector<float> metres;
                std::vector<std::uint16_t> codes;
                for (int k = 0; k < columns * rows; ++k) {
                    const int x = k % columns, y = k / columns;
                    const bool is_block = x >= left && x < left + wide && y >= top && y < top + high;
                    const double z = plane(static_cast<int>(static_cast<double>(k) * width * height / columns / rows));
                    metres.push_back(is_block ? 10000 : static_cast<float>(z));
                    codes.push_back(is_block ? 65535 : static_cast<std::uint16_t>(std::round(1000 * z)));
                }
                INFO(columns << " columns, " << part << ", block " << i << " at " << left << ", " << top);
                Camera camera = camera_of(Encoding::view_z, columns, rows);
                const auto said = depth_doubts_of_sample(camera, host(metres, Storage::float32, columns));
                CHECK((said.size() == 1 && said.front().find("\"missing\": 10000") != std::string::npos));
                camera.scale = 0.001;
                const auto of_codes = depth_doubts_of_sample(camera, host(codes, Storage::uint16, columns));
                CHECK((of_codes.size() == 1 && of_codes.front().find("\"missing\": 65535") != std::string::npos));
            }
}

namespace {

// A floor before a slanted wall, and half of a sphere: metres from 2 to 20.
double room(int x, int y) {
    const double floor = y > 120 ? 240.0 / (y - 120) : 1e9, wall = x < 60 ? 3 + 0.1 * x : 14 + 0.018 * x;
    const double r = std::hypot(x - 220.0, y - 90.0);
    return std::min({floor, wall, r < 60 ? 7 - std::sqrt(3600 - r * r) / 15 : 1e9, 20.0});
}

constexpr int room_width = 320, room_height = 240;

template <typename Element = std::uint16_t, typename Stored>
std::vector<Element> room_image(const Stored& stored) {
    std::vector<Element> values;
    for (int y = 0; y < room_height; ++y)
        for (int x = 0; x < room_width; ++x)
            values.push_back(static_cast<Element>(stored(room(x, y), x, y)));
    return values;
}

} // namespace

TEST_CASE("doubts: values on the other side of 0 are told with the cure, whatever their sky is", "[doubts]") {
    constexpr int columns = 96, rows = 64;
    for (const auto& [encoding, scale, sign] : {std::tuple{Encoding::inverse, 37.5, -1.0},
                                                {Encoding::inverse, -37.5, 1.0},
                                                {Encoding::view_z, 1.0, -1.0},
                                                {Encoding::view_z, -1.0, 1.0}})
        for (const double sky : {0.0, static_cast<double>(NAN), 1.0}) {
            std::vector<float> values;
            for (int i = 0; i < columns * rows; ++i) {
                const double z = plane(i * (width * height / columns / rows));
                values.push_back(static_cast<float>(
                    i % columns < 24 && sky != 1 ? sky : sign * (encoding == Encoding::inverse ? 37.5 / z : z)));
            }
            Camera camera = camera_of(encoding, columns, rows);
            camera.scale = scale;
            const std::vector<std::string> said = depth_doubts(camera, host(values, Storage::float32, columns));
            INFO(to_string(encoding) << ", " << scale << ", " << sky << ": " << (said.empty() ? "" : said.front()));
            CHECK(says(said, scale > 0                       ? "\"scale\": -"
                             : encoding == Encoding::inverse ? "\"scale\": 37.5"
                                                             : "\"scale\": 1"));
        }
    // A renderer's sky is infinite though its distances count backwards.
    std::vector<float> values;
    for (int i = 0; i < columns * rows; ++i)
        values.push_back(i % columns < 32 ? INFINITY
                                          : static_cast<float>(-plane(i * (width * height / columns / rows))));
    Camera camera = camera_of(Encoding::view_z, columns, rows);
    camera.scale = -1;
    CHECK(says(depth_doubts(camera, host(values, Storage::float32, columns)), "\"background\": \"infinity\""));
    camera.background = INFINITY;
    CHECK(depth_doubts(camera, host(values, Storage::float32, columns)) == std::vector<std::string>{});
}

TEST_CASE("doubts: depth that still has the distortion of its lens is told, and depth without it is not", "[doubts]") {
    std::mt19937 random(4);
    std::normal_distribution<double> noise;
    // A floor and a wall at an angle: distance along the axis where the ray (x, y, 1) meets the first of them.
    const auto corner = [](double x, double y) {
        return std::min(y > 0.02 ? 1.2 / y : 1e9, 1 / (0.22 + 0.15 * x + 0.04 * y));
    };
    // A room seen along its walls, most of which is a wall that is seen straight on.
    const auto box = [](double x, double y) {
        return std::min({3.0, (x > 0 ? 1.6 : 1.4) / std::abs(x), (y > 0 ? 1.2 : 1.1) / std::abs(y)});
    };
    using enum LensLaw;
    for (const auto& [law, k] : {std::pair{brown, std::vector{-0.3, 0.1, 0.0, 0.0}},
                                 {brown, {0.2, -0.4, 1e-3, -1e-3, 0.2}},
                                 {brown, {5.6, 3.6, 7e-5, -9e-5, 0.19, 5.9, 5.4, 1.0}},
                                 {opencv_fisheye, {0.05, -0.01, 0.002, -3e-4}}})
        for (const Encoding encoding : {Encoding::view_z, Encoding::ray_distance})
            for (const double rough : {0.0, 0.002}) {
                Camera camera = camera_of(encoding, room_width, room_height);
                const Intrinsics pinhole{
                    .fx = 280, .fy = 282, .cx = 158, .cy = 121, .width = room_width, .height = room_height};
                camera.projection = perspective(pinhole, {0.1, 100}, {.view_axes = ViewAxes::opencv});
                camera.scale = 0.001;
                camera.missing = 0;
                Camera raw = camera;
                raw.lens = LensModel{law, 280, 282, 158, 121, k};
                const auto seen_by = [&](const Camera& one, const auto& scene) {
                    const PixelRays rays(one);
                    return room_image([&](double, int x, int y) {
                        const Eigen::Vector3d ray = rays.ray_of(x + 0.5, y + 0.5).value();
                        const double z = scene(ray.x() / ray.z(), ray.y() / ray.z()) * (1 + rough * noise(random));
                        return std::round(1000 * (encoding == Encoding::view_z ? z : z / ray.z()));
                    });
                };
                const auto distorted = seen_by(raw, corner), straight = seen_by(camera, corner);
                const auto said = [&](const std::vector<std::uint16_t>& values) {
                    return depth_doubts(camera, host(values, Storage::uint16, room_width));
                };
                camera.raw_lens = raw.lens;
                INFO(to_string(law) << ", " << k.front() << ", " << to_string(encoding) << ", noise " << rough);
                // A weak distortion is not seen, nor one under noise.
                if (rough == 0 && k.front() != 0.2)
                    for (const auto& values : {distorted, seen_by(raw, box)})
                        CHECK(says(said(values), "distortion of the lens has not been undone"));
                CHECK(said(seen_by(camera, box)) == std::vector<std::string>{});
                CHECK(said(straight) == std::vector<std::string>{});
                CHECK_FALSE(says(depth_doubts_of_sample(camera, host(straight, Storage::uint16, room_width)), "flat"));
                CHECK(said(std::vector<std::uint16_t>(straight.size(), 2000)) == std::vector<std::string>{});
                const Camera part = cropped(camera, 40, 30, 240, 180);
                std::vector<std::uint16_t> middle;
                for (int y = 30; y < 210; ++y)
                    for (int x = 40; x < 280; ++x)
                        middle.push_back(straight[static_cast<std::size_t>(y * room_width + x)]);
                CHECK(depth_doubts(part, host(middle, Storage::uint16, 240)) == std::vector<std::string>{});
            }
}

TEST_CASE("doubts: the bits of half floats are told under any scale, and codes like them are not", "[doubts]") {
    Camera camera = camera_of(Encoding::view_z, room_width, room_height);
    camera.near_plane = 0.1;
    camera.far_plane = 100;
    const auto half = [](double value) {
        return Eigen::numext::bit_cast<std::uint16_t>(static_cast<Eigen::half>(static_cast<float>(value)));
    };
    std::mt19937 random(5);
    std::normal_distribution<double> noise;
    for (const double unit : {1.0, 100.0, 1000.0, 0.045})
        for (const double sky : {20 * unit, 0.0, HUGE_VAL}) {
            const auto bits = room_image([&](double z, int, int y) { return half(y < 40 ? sky : unit * z); });
            for (const double scale : {1.0, 0.001, 0.0002, 1.0 / 256}) {
                INFO(unit << ", sky of " << sky << ", scale " << scale);
                camera.scale = scale;
                const auto said = depth_doubts(camera, host(bits, Storage::uint16, room_width));
                REQUIRE(said.size() == 1);
                CHECK(says(said, "the bits of half floats"));
            }
        }
    for (const auto& [low, high] :
         {std::pair{12288.0, 31743.0}, {10300.0, 31000.0}, {12288.0, 16500.0}, {20000.0, 31744.0}})
        for (const double part : {0.0, 0.001, 0.01})
            for (const bool has_holes : {false, true}) {
                const auto codes = room_image([&](double z, int, int y) {
                    return has_holes && y < 40 ? 0.0
                                               : std::clamp(std::round((low + (z - 2) / 18 * (high - low)) *
                                                                       (1 + part * noise(random))),
                                                            low, high);
                });
                INFO(low << " to " << high << ", noise of " << part);
                for (const double scale : {0.001, 0.0002}) {
                    camera.scale = scale;
                    CHECK(!says(depth_doubts(camera, host(codes, Storage::uint16, room_width)), "half"));
                }
            }
}

TEST_CASE("doubts: what no distance can be is told where nobody says what the values are", "[doubts]") {
    std::vector<std::uint16_t> halves;
    std::vector<float> holes, plain;
    for (int i = 0; i < room_width * room_height; ++i) {
        const auto z = static_cast<float>(room(i % room_width, i / room_width));
        halves.push_back(Eigen::numext::bit_cast<std::uint16_t>(static_cast<Eigen::half>(z)));
        plain.push_back(z);
        holes.push_back(std::hypot(i % room_width - 100, i / room_width - 150) < 40 ? 10000 : z);
    }
    const Ranking bits = rank_encodings(host(halves, Storage::uint16, room_width));
    CHECK(says(bits.evidence, "the bits of half floats"));
    CHECK(bits.guesses.empty());
    CHECK(!bits.family);
    CHECK(says(rank_encodings(host(holes, Storage::float32, room_width)).evidence, "say \"missing\": 10000"));
    const Ranking right = rank_encodings(host(plain, Storage::float32, room_width));
    CHECK(!says(right.evidence, "say \"missing\""));
    CHECK(!right.guesses.empty());
}

TEST_CASE("doubts: bits that are rotated are told wherever depth goes on beyond them, and no others") {
    Camera camera = camera_of(Encoding::view_z, room_width, room_height);
    camera.scale = 0.001;
    camera.usual_metres = 10;
    std::mt19937 random(6);
    std::normal_distribution<double> noise;
    const auto said = [&](const std::vector<std::uint16_t>& codes) {
        return depth_doubts(camera, host(codes, Storage::uint16, room_width));
    };
    const auto millimetres = [&](double farthest, double part) {
        return room_image(
            [&](double z, int, int) { return std::round(std::min(1000 * z * (1 + part * noise(random)), farthest)); });
    };
    for (const double farthest : {7900.0, 10000.0, 16000.0})
        for (const double part : {0.0, 0.002}) {
            INFO(farthest << ", noise of " << part);
            const auto right = millimetres(farthest, part);
            auto rotated = right, turned = right, of_player = right;
            for (auto& code : rotated)
                code = std::rotl(code, 3);
            for (auto& code : turned)
                code = std::rotr(code, 3);
            for (std::size_t i = 0; i < of_player.size(); ++i)
                of_player[i] = static_cast<std::uint16_t>(std::min<int>(right[i], 8191) * 8 + (i % 320 / 40 == 3));
            CHECK(!says(said(right), "rotated"));
            CHECK(says(said(rotated), "\"packing\": \"uint16-rotated\""));
            CHECK(says(said(turned), "leave out \"packing\""));
            CHECK(says(said(of_player), "\"scale\": 0.000125"));
            camera.scale = 0.000125;
            CHECK(!says(said(of_player), "rotated"));
            camera.scale = 0.001;
        }
    auto halves = room_image([](double z, int, int) { return 8200 + 2000 * z; });
    for (auto& code : halves)
        code = static_cast<std::uint16_t>(static_cast<float>(Eigen::half(static_cast<float>(code))));
    CHECK(!says(said(halves), "multiples of 8"));
}

TEST_CASE("doubts: a scene on its near plane is told though a sky lies behind it") {
    constexpr int columns = 320, rows = 240;
    const Camera camera = camera_of(Encoding::window, columns, rows);
    std::vector<float> values;
    for (int i = 0; i < columns * rows; ++i)
        values.push_back(i % 97 == 0 ? 0.999f : 1e-3f * static_cast<float>(i % 11));
    CHECK(says(depth_doubts(camera, host(values, Storage::float32, columns)), "2 % of the near plane"));
}

TEST_CASE("doubts: three bytes in the other order are told, and in the right one not", "[doubts]") {
    Camera camera = camera_of(Encoding::view_z, room_width, room_height);
    const auto bytes_of = [](double unit, bool red_is_high) { // in R, G, B order
        std::vector<std::uint8_t> bytes;
        for (const auto code : room_image<std::uint32_t>([&](double z, int, int) { return z * unit; }))
            for (int i = 0; i < 3; ++i)
                bytes.push_back(static_cast<std::uint8_t>(code >> (8 * (red_is_high ? 2 - i : i))));
        return bytes;
    };
    for (const double unit : {256000.0, 800000.0}) // 16 bits in two channels, and 24
        for (const bool is_high : {false, true})
            for (const bool as_high : {false, true}) {
                auto bytes = bytes_of(unit, is_high);
                if (unit == 256000)
                    for (std::size_t i = is_high ? 2 : 0; i < bytes.size(); i += 3)
                        bytes[i] = 0;
                INFO(unit << ", " << is_high << " as " << as_high);
                const HostDepth stored{bytes.data(), room_width, room_height, room_width * 3,
                                       as_high ? Storage::rgb8_red_high : Storage::rgb8_red_low};
                camera.scale = 1 / unit;
                CHECK(says(depth_doubts(camera, stored), is_high ? "\"rgb-high-first\"" : "\"rgb-low-first\"") ==
                      (is_high != as_high));
            }
}

TEST_CASE("doubts: a cure that is told makes the right depth", "[doubts]") {
    const auto described = [](Encoding encoding, double near, double far) {
        Camera camera = camera_of(encoding, room_width, room_height);
        camera.projection = perspective(1.0472, 4.0 / 3, {near, far});
        camera.near_plane = near;
        camera.far_plane = far;
        return camera;
    };
    // A floor, a ceiling and walls, none of them seen straight on: how far a camera of 280 pixels sees along its axis.
    const auto corner = [](int x, int y) {
        const double right = (x + 0.5 - 160) / 208, down = (y + 0.5 - 120) / 208; // 60 degrees down
        return std::min({1.2 / std::max(down, 1e-9), 2.4 / std::max(-down, 1e-9),
                         1 / std::max(0.15 + 0.2 * right + 0.05 * down, 1e-9), 1 / std::max(0.2 - 0.25 * right, 1e-9)});
    };
    const auto told = [](const Camera& camera, const std::vector<float>& values, const std::string& words) {
        const std::vector<std::string> said = depth_doubts(camera, host(values, Storage::float32, room_width));
        INFO(words << ": " << (said.empty() ? "" : said.front()));
        CHECK((said.size() == 1 && said.front().find(words) != std::string::npos));
    };
    const auto stored = [&](const auto& formula) {
        return room_image<float>([&](double, int x, int y) { return formula(corner(x, y)); });
    };
    const auto linear = [](double z) { return (z - 1) / 39; };
    const auto display = [](double v) { return v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055; };
    told(described(Encoding::linear, 1, 40), stored([&](double z) { return display(linear(z)); }),
         "say \"gamma\": \"srgb\"");
    told(described(Encoding::linear, 1, 40), stored([&](double z) { return std::pow(linear(z), 2); }),
         "say \"gamma\": 0.5");
    told(described(Encoding::linear, 1, 40), stored([&](double z) { return std::log(z) / std::log(40); }),
         "say \"encoding\": \"exponential\"");
    told(described(Encoding::window, 0.5, 40), stored([](double z) { return (z - 0.5) / 39.5; }),
         "say \"encoding\": \"linear\"");
    Camera cesium = described(Encoding::logarithmic, 1, 5000);
    cesium.near_plane.reset();
    told(cesium, stored([](double z) { return std::log(z - 1 + 1) / std::log(5001); }),
         "logarithms of distances from a near plane on, at 1.0"); // which a few windows know to some percent
    // Distances along the rays of another view.
    Camera shifted = described(Encoding::ray_distance, 1, 40);
    shifted.projection =
        perspective({.fx = 280, .fy = 280, .cx = 160, .cy = 175, .width = room_width, .height = room_height}, {1, 40},
                    {.view_axes = ViewAxes::opencv});
    const PixelRays rays(shifted);
    std::vector<float> along;
    for (int y = 0; y < room_height; ++y)
        for (int x = 0; x < room_width; ++x) {
            const Eigen::Vector3d ray = *rays.ray_of(x + 0.5, y + 0.5);
            along.push_back(static_cast<float>(std::min({1.2 / std::max(ray.y(), 1e-9), 5.0 / ray.z(),
                                                         2.0 / std::abs(ray.x()), 1.5 / std::max(-ray.y(), 1e-9)})));
        }
    check_silent(shifted, host(along, Storage::float32, room_width));
    Camera plain = shifted;
    plain.projection =
        perspective({.fx = 280, .fy = 280, .cx = 160, .cy = 120, .width = room_width, .height = room_height}, {1, 40},
                    {.view_axes = ViewAxes::opencv});
    told(plain, along, "whose axis meets pixel 160, 175");
}

TEST_CASE("doubts: codes in another order, and with flags, are told with their packing", "[doubts]") {
    Camera camera = camera_of(Encoding::view_z, room_width, room_height);
    camera.scale = 0.001;
    std::mt19937 random(8);
    std::normal_distribution<double> noise;
    for (const double part : {0.0, 0.002, 0.01}) {
        auto right = room_image([&](double z, int, int) { return std::round(400 * z * (1 + part * noise(random))); });
        auto swapped = right, flagged = right;
        for (std::size_t i = 0; i < right.size(); ++i) {
            swapped[i] = std::rotl(right[i], 8);
            flagged[i] = static_cast<std::uint16_t>(right[i] | (i / 40 % 8) << 13);
        }
        INFO("noise of " << part);
        const auto said = [&](const std::vector<std::uint16_t>& codes) {
            return depth_doubts(camera, host(codes, Storage::uint16, room_width));
        };
        CHECK(said(right) == std::vector<std::string>{});
        CHECK(says(said(swapped), "say \"packing\": \"uint16-swapped\""));
        if (part < 0.01)
            CHECK(says(said(flagged), "say \"packing\": \"uint13\""));
    }
    // Bytes that count to 254, of which 256 would be the next.
    std::vector<std::uint8_t> bytes;
    for (const double v : room_image<double>([](double z, int, int) { return z / 25; })) {
        const auto code = static_cast<std::uint32_t>(v * 255 * 255 * 255);
        for (const std::uint32_t digit : {code / 65025, code / 255 % 255, code % 255})
            bytes.push_back(static_cast<std::uint8_t>(digit));
    }
    Camera linear = camera_of(Encoding::linear, room_width, room_height);
    linear.near_plane = 0;
    linear.far_plane = 25;
    CHECK(says(depth_doubts(linear, {bytes.data(), room_width, room_height, room_width * 3, Storage::rgb8_red_high}),
               "\"packing\": \"base-255\""));
}

TEST_CASE("doubts: a range that was cut off is told, and walls are not", "[doubts]") {
    const auto cut = [](double end) {
        return room_image<float>([&](double z, int, int y) { return y < 100 ? end : std::min(z, 7.0); });
    };
    const Camera camera = camera_of(Encoding::view_z, room_width, room_height);
    const auto said = [&](double end) { return depth_doubts(camera, host(cut(end), Storage::float32, room_width)); };
    CHECK(says(said(20), "\"background_from\": 20"));
    CHECK(said(20.4) == std::vector<std::string>{});
    CHECK(said(8) == std::vector<std::string>{});
}

TEST_CASE("doubts: one image is like another of its size, type and range", "[doubts]") {
    const auto metres = image<float>([](double z) { return z; }), twice = image<float>([](double z) { return 2 * z; }),
               millimetres = image<float>([](double z) { return 1000 * z; }),
               none = image<float>([](double) { return 0.0; });
    const auto sketch = [](const std::vector<float>& values) { return sketch_of(host(values, Storage::float32)); };
    CHECK(are_alike(sketch(metres), sketch(twice)));
    CHECK_FALSE(are_alike(sketch(metres), sketch(millimetres)));
    CHECK_FALSE(are_alike(sketch(metres), sketch(none)));
    CHECK(are_alike(sketch(none), sketch(none)));
    const auto codes = image<std::uint16_t>([](double z) { return z; });
    CHECK_FALSE(are_alike(sketch(metres), sketch_of(host(codes, Storage::uint16))));
}
