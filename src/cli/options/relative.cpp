// Relative depth for `fathom dof` and `fathom dof-masks`.
#include "relative.hpp"

#include "depth_options.hpp"

#include "described.hpp"

#include "cli/command.hpp"

#include <stdexcept>

namespace fathom::cli {

void add_relative_options(CLI::App& app) {
    for (const description::Option& option : description::operation<description::DofCall>().lens)
        if (description::is_of_relative(option))
            app.get_option(spelled(option))->group("Relative depth");
    for (const char* other : {"--camera", "--preset", "--image", "--node", "--undistorted", "--valid"})
        app.get_option("--relative")->excludes(other);
}

void complete(LensArguments& lens, RelativeSource& relative, const CameraOption& camera) {
    relative.order = lens.relative;
    if (!lens.relative)
        return complete(lens, camera);
    relative.options = relative_options(lens);
    try {
        lens = completed(lens, {}, relative_camera(1, 1, *lens.relative).projection, lens_words());
    } catch (const std::invalid_argument& error) {
        throw UsageError(error.what());
    }
}

namespace {

// The lens for an input whose own camera may complete it.
LensArguments lens_of(LensArguments lens, const Job& job) {
    if (job.own_camera)
        complete(lens, *job.own_camera, (job.camera_file.empty() ? job.input : job.camera_file).native());
    return lens;
}

} // namespace

CircleOfConfusion circle_of(const LensArguments& lens, const StoredDepth& stored, const Job& job) {
    return circle_for(lens_of(lens, job), stored, job.windows);
}

std::vector<std::string> blur_doubts(const LensArguments& lens, const StoredDepth& stored, const Job& job,
                                     const Subject& subject, Sky sky, double max_coc_px) {
    return lens_doubts(subject, lens_of(lens, job), circle_of(lens, stored, job), sky, max_coc_px, lens_words());
}

} // namespace fathom::cli
