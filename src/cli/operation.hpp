#pragma once

#include "cli/command.hpp"
#include "description/operations.hpp"
#include "shot/each_depth.hpp"

#include <fathom/lens_arguments.hpp>

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace CLI {
class App;
} // namespace CLI

namespace fathom::cli {

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

    /// Reads depth beside the depth.
    virtual DepthFile read_other_depth(const std::filesystem::path& file, const Job& job) const;

    /// Changes an input's images before the operation reads them. The pixels are those of `Job::images`.
    virtual void change(Images&) const {}

    /// Sets what the input decides. The images are set already.
    virtual void set_for_input(void*, const StoredDepth&, const Images&, Job&) {}

    /// Is an image or a result of this name asked for?
    bool has_file(std::string_view option) const { return files_.contains(std::string(option)); }

    const description::Operation& operation_;
    std::shared_ptr<void> call_; // with the options
    LensArguments lens_;         // that makes its circle
    DepthRepair repair_;
    std::map<std::string, std::string> files_; // of images and more results, by the program's options

private:
    void set(const description::Option& option, description::Value value);
    void add_images(CLI::App& app);
    std::function<void(const std::string&)> file_for(const description::Option& option);
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

protected:
    Call& call() const { return *static_cast<Call*>(call_.get()); }
};

/// Makes the command of a task.
std::function<int()> configure_operation(CLI::App& app, const std::shared_ptr<OperationTask>& task);

template <typename Own>
std::function<int()> configure_own(CLI::App& app) {
    return configure_operation(app, std::make_shared<Own>());
}

} // namespace fathom::cli
