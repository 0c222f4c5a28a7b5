// fathom unproject
#include "cli/command.hpp"
#include "cli/operation.hpp"
#include "cli/options/depth_options.hpp"
#include "cli/options/images.hpp"

#include <fathom/normals.hpp>
#include <fathom/opencv.hpp>

#include <fmt/format.h>

#include <opencv2/imgproc.hpp>

namespace fathom::cli {
namespace {

// A .ply has points with colours and normals.
class UnprojectTask : public OwnTask<description::UnprojectCall> {
public:
    void add_options(CLI::App& app) override {
        OwnTask::add_options(app);
        add_picture_options(app, picture, "colours of the points of a .ply");
        app.get_option("--color")->required(false);
        app.add_flag("--normals", normals_, "a .ply also holds the points' normals")->group(operation_.group);
    }

    void prepare() override {
        OwnTask::prepare();
        made_of.reset();
        const std::string extension = format.empty() ? extension_of(output) : format;
        const bool colored = !picture.source.empty();
        if (extension != ".ply" && (colored || normals_))
            throw UsageError(fmt::format("{}: only a .ply holds {}; write one (for several inputs: --format ply)",
                                         output, colored ? "colours of points" : "normals of points"));
    }

    std::vector<Made> make(const StoredDepth& stored, Job& job) override {
        std::vector<Made> made = OwnTask::make(stored, job);
        Made& points = made.front();
        if (const cv::Mat& color = job.images.get().picture.color; !color.empty())
            cv::resize(color, points.colors, points.size, 0, 0, cv::INTER_AREA);
        if (normals_)
            points.normals = to_mat(normals(stored, {.space = call().options.space}));
        return made;
    }

protected:
    Product product() const override {
        Product product = OwnTask::product();
        product.extensions.insert(product.extensions.begin() + 1, ".ply");
        return product;
    }

private:
    bool normals_ = false;
};

} // namespace

extern const Command unproject_command{
    .name = "unproject",
    .summary = description::UnprojectCall::said.summary,
    .notes = description::UnprojectCall::said.notes,
    .configure = configure_own<UnprojectTask>,
};

} // namespace fathom::cli
