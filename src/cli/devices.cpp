// fathom devices
#include "command.hpp"
#include "messages.hpp"

#include <fathom/device.hpp>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <memory>

namespace fathom::cli {
namespace {

nlohmann::ordered_json as_json(const DeviceInfo& device, int default_index) {
    return {{"index", device.index},
            {"name", device.name},
            {"platform", device.platform},
            {"version", device.version},
            {"type", device.cpu ? "cpu" : "gpu"},
            {"fp64", device.fp64},
            {"compute_units", device.compute_units},
            {"memory_bytes", device.memory_bytes},
            {"default", device.index == default_index}};
}

void print_table(const std::vector<DeviceInfo>& devices, int default_index) {
    std::size_t width = 0;
    for (const DeviceInfo& device : devices)
        width = std::max(width, device.name.size());
    for (const DeviceInfo& device : devices)
        fmt::print("{} {}  {}  {:<{}}  {} units, {:.1f} GiB, {}  ({})\n", device.index == default_index ? '*' : ' ',
                   device.index, device.cpu ? "cpu" : "gpu", device.name, width, device.compute_units,
                   static_cast<double>(device.memory_bytes) / (1 << 30), device.fp64 ? "fp64" : "no fp64",
                   device.version);
    fmt::print("* is taken when --device is not given\n");
}

int list(bool json) {
    const int standard = Device::open().info().index;
    const std::vector<DeviceInfo> devices = list_devices();
    if (json) {
        nlohmann::ordered_json all = nlohmann::ordered_json::array();
        for (const DeviceInfo& device : devices)
            all.push_back(as_json(device, standard));
        print_json(all);
    } else {
        print_table(devices, standard);
    }
    return done;
}

std::function<int()> configure_devices(CLI::App& app) {
    const auto json = std::make_shared<bool>(false);
    app.add_flag("--json", *json, "print a JSON array")->group("Report");
    return [json] { return list(*json); };
}

} // namespace

extern const Command devices_command{
    .name = "devices",
    .summary = "Lists the OpenCL devices and marks the default one.",
    .notes = R"(Example:
  fathom devices)",
    .configure = configure_devices,
};

} // namespace fathom::cli
