// fathom devices
#include "cli/command.hpp"
#include "shot/options.hpp"
#include "terminal/messages.hpp"

#include <fathom/device.hpp>
#include <fathom/probe.hpp>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <memory>

namespace fathom::cli {
namespace {

// What a kernel found, or why none ran.
struct Probed {
    std::optional<DeviceArithmetic> arithmetic;
    std::string words;
};

std::string said_by_driver(const DeviceInfo& device) {
    std::string said;
    for (const auto& [has, what] : {std::pair(device.correct_rounding, "correctly rounded quotients"),
                                    std::pair(device.fma, "fma"), std::pair(device.denormals, "denormals")})
        said += has ? std::string(said.empty() ? "" : ", ") + what : "";
    return said.empty() ? "nothing" : said;
}

Probed probed(const DeviceInfo& device) {
    try {
        const DeviceArithmetic found = probe_arithmetic(Device::open(std::to_string(device.index)));
        return {found, to_string(found)};
    } catch (const std::exception& error) {
        const std::string said = error.what();
        return {{}, said.substr(0, said.find('\n'))};
    }
}

nlohmann::ordered_json as_json(const Probed& probed) {
    if (!probed.arithmetic)
        return {{"error", probed.words}};
    const DeviceArithmetic& found = *probed.arithmetic;
    nlohmann::ordered_json line{{"exact", found.exact()},
                                {"division_ulp", found.division_ulp},
                                {"sqrt_ulp", found.sqrt_ulp},
                                {"fma_ulp", found.fma_ulp},
                                {"separate_products", found.separate_products},
                                {"denormals", found.denormals},
                                {"signed_zeros", found.signed_zeros}};
    if (found.fp64)
        line["fp64"] = *found.fp64;
    return line;
}

nlohmann::ordered_json as_json(const DeviceInfo& device, int default_index) {
    return {{"index", device.index},
            {"name", device.name},
            {"platform", device.platform},
            {"version", device.version},
            {"type", device.cpu ? "cpu" : "gpu"},
            {"fp64", device.fp64},
            {"compute_units", device.compute_units},
            {"memory_bytes", device.memory_bytes},
            {"denormals", device.denormals},
            {"correct_rounding", device.correct_rounding},
            {"fma", device.fma},
            {"native_vector_width", device.native_vector_width},
            {"arithmetic", as_json(probed(device))},
            {"default", device.index == default_index}};
}

void print_table(const std::vector<DeviceInfo>& devices, int default_index) {
    std::size_t width = 0;
    for (const DeviceInfo& device : devices)
        width = std::max(width, device.name.size());
    for (const DeviceInfo& device : devices)
        fmt::print("{} {}  {}  {:<{}}  {} units, {:.1f} GiB, {}  ({})\n        arithmetic: {}; the driver claims: {}\n",
                   device.index == default_index ? '*' : ' ', device.index, device.cpu ? "cpu" : "gpu", device.name,
                   width, device.compute_units, static_cast<double>(device.memory_bytes) / (1 << 30),
                   device.fp64 ? "fp64" : "no fp64", device.version, probed(device).words, said_by_driver(device));
    fmt::print("* is taken when --device is not given\n");
}

int list(bool json) {
    DeviceOption().prepare();
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
    .notes =
        R"(A kernel tries how each device rounds quotients, square roots, fused products and very small numbers. Devices whose
arithmetic is "exact" give the same bits. "exact, without double" is the same for devices that have no double.

Example:
  fathom devices)",
    .configure = configure_devices,
};

} // namespace fathom::cli
