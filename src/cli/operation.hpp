#pragma once

#include "cli/program.hpp"
#include "description/operations.hpp"
#include "shot/shot.hpp"

#include <fathom/lens_arguments.hpp>

namespace fathom::cli {

using namespace shot;

/// Adds --color and what says how it is read. `what` names the picture: "the sharp picture".
void add_picture_options(CLI::App& app, PictureOptions& options, const std::string& what, bool required);

/// The command of an operation as it is described: its options, its images and its results. What is peculiar to an operation
/// overrides a step.
class OperationTask : public Task {
public:
    explicit OperationTask(const description::Operation& operation);

    virtual void add_options(CLI::App& app);

    /// Called when the options are read: refuses what contradicts itself, and lists the files.
    /// Throws: UsageError, and Error for the camera file.
    virtual void prepare();

    Images read(const Job& job) const override;
    std::vector<Made> make(const StoredDepth& stored, Job& job) override;
    std::vector<std::string> doubts(const Job& job) const override;

protected:
    /// The file of the first result.
    virtual Product product() const;

    /// The channel of depth beside the depth.
    virtual std::string channel_of_other_depth(const std::filesystem::path&, const Job&) const { return channel; }

    /// Changes an input's images before the operation reads them. The pixels are those of `Job::images`.
    virtual void change(Images&) const {}

    /// Sets what the input decides. The images are set already.
    virtual void set_for_input(void*, const StoredDepth&, const Images&, const Job&) {}

    /// The type of the first result's file.
    std::string extension() const { return format.empty() ? extension_of(output) : format; }

    /// Is an image or a result of this name asked for?
    bool has_file(std::string_view option) const { return files_.contains(std::string(option)); }

    /// What is probably wrong with the blur of an image. Circles end at `max_coc_px`, which may be infinity.
    std::vector<std::string> blur_doubts(const StoredDepth& stored, const Job& job, const Subject& subject, Sky sky,
                                         double max_coc_px) const;

    const description::Operation& operation_;
    std::shared_ptr<void> call_; // with the options
    LensArguments lens_;         // that makes its circle
    DepthRepair repair_;
    std::map<std::string, std::string> files_; // of images and more results, by the program's options

private:
    void set(const description::Option& option, description::Value value);
    /// Turns a call's lengths in pixels into the large frame's. Gives the reason where that cannot be, or nothing.
    std::string supersample(void* call) const;
    bool has_picture() const { return sharp_ || !picture.source.empty(); }
    std::vector<Made> results(void* call, const StoredDepth& stored, const Job& job) const;

    const description::Option *sharp_ = nullptr, *circle_ = nullptr; // the picture and the circle, if it takes them
    std::vector<const description::Option*> images_;                 // of the companions behind the picture
    double max_error_ = 0;
    bool explain_ = false;
};

/// The same for hooks, which know the call.
template <typename Call>
class OwnTask : public OperationTask {
public:
    OwnTask() : OperationTask(description::operation<Call>()) {}

    std::vector<std::string> length_doubts(const StoredDepth& stored, const Subject& subject,
                                           const Job& job) const override {
        if constexpr (requires(const Call& call) { call.options.max_coc_px; })
            return blur_doubts(stored, job, subject, call().options.sky, call().options.max_coc_px);
        return {};
    }

protected:
    Call& call() const { return *static_cast<Call*>(call_.get()); }
};

/// The command of an operation, as it is described but for what is peculiar to it.
Command command_of(const description::Operation& operation);

} // namespace fathom::cli
