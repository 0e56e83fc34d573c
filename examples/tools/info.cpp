// glint info: what adapters there are, and what they can do.

#include "tool.h"

#include <glint/device/device.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <memory>
#include <vector>

using namespace glint;

namespace tool {

namespace {

struct Options {
    std::string api;
    std::string adapter;
    TracingEngine tracing = TracingEngine::Auto;
    bool json = false;
};

struct Limit {
    const char* name;
    uint64_t value;
    const char* unit;
};

std::vector<Limit> limitsOf(const Features& features) {
    return {
        {"maxTexture2DSize", features.maxTexture2DSize, "texels"},
        {"maxTexture3DSize", features.maxTexture3DSize, "texels"},
        {"maxTextureCubeSize", features.maxTextureCubeSize, "texels"},
        {"maxTextureLayers", features.maxTextureLayers, ""},
        {"maxTextureSamples", features.maxTextureSamples, ""},
        {"maxTargets", features.maxTargets, ""},
        {"maxTargetLayers", features.maxTargetLayers, ""},
        {"maxViewports", features.maxViewports, ""},
        {"maxIndirectDraws", features.maxIndirectDraws, "draws"},
        {"maxMeshGroupCount", features.maxMeshGroupCount, "groups"},
        {"maxTaskThreads", features.maxTaskThreads, "threads"},
        {"maxTaskPayload", features.maxTaskPayload, "bytes"},
        {"maxMeshThreads", features.maxMeshThreads, "threads"},
        {"maxMeshVertices", features.maxMeshVertices, "vertices"},
        {"maxMeshPrimitives", features.maxMeshPrimitives, "primitives"},
        {"maxGroupSizeX", features.maxGroupSizeX, "threads"},
        {"maxGroupSizeY", features.maxGroupSizeY, "threads"},
        {"maxGroupSizeZ", features.maxGroupSizeZ, "threads"},
        {"maxGroupThreads", features.maxGroupThreads, "threads"},
        {"maxGroupCountX", features.maxGroupCountX, "groups"},
        {"maxGroupCountY", features.maxGroupCountY, "groups"},
        {"maxGroupCountZ", features.maxGroupCountZ, "groups"},
        {"groupMemory", features.groupMemory, "bytes"},
        {"subgroupSize", features.subgroupSize, "threads"},
        {"minSubgroupSize", features.minSubgroupSize, "threads"},
        {"maxSubgroupSize", features.maxSubgroupSize, "threads"},
        {"recursionDepth", features.recursionDepth, "rays"},
        {"maxRays", features.maxRays, "rays"},
        {"maxRecordSize", features.maxRecordSize, "bytes"},
        {"maxAttributeSize", features.maxAttributeSize, "bytes"},
        {"maxPushSize", features.maxPushSize, "bytes"},
        {"maxAnisotropy", features.maxAnisotropy, ""},
        {"maxTableTextures", features.maxTableTextures, "entries"},
        {"maxTableBuffers", features.maxTableBuffers, "entries"},
        {"maxUniformSize", features.maxUniformSize, "bytes"},
        {"maxStorageSize", features.maxStorageSize, "bytes"},
        {"maxBufferSize", features.maxBufferSize, "bytes"},
        {"maxTracingInstances", features.maxTracingInstances, ""},
        {"maxTracingPrimitives", features.maxTracingPrimitives, ""},
        {"uniformAlignment", features.uniformAlignment, "bytes"},
        {"storageAlignment", features.storageAlignment, "bytes"},
        {"texelAlignment", features.texelAlignment, "bytes"},
        {"scratchAlignment", features.scratchAlignment, "bytes"},
    };
}

std::vector<std::string> featureList(FeatureMask mask) {
    std::vector<std::string> names;
    for (uint32_t i = 0; i < FeatureCount; i++)
        if (mask & (1ull << i)) names.push_back(featureNames(1ull << i));
    return names;
}

/// An adapter and, if it can be opened, its limits.
struct Adapter {
    DeviceInfo info;
    Features features;
    Error error;
};

Adapter open(const DeviceInfo& info, const Options& options) {
    const Device device = Device::create({.api = options.api,
                                          .adapter = std::to_string(info.index),
                                          .tracing = options.tracing,
                                          .validation = DeviceDesc::Validation::Off,
                                          .message = [](const Message&) {}});
    if (!device) return {info, {}, device.error()};
    return {device.getInfo(), device.getFeatures(), {}};
}

nlohmann::ordered_json toJson(const Adapter& adapter) {
    const DeviceInfo& info = adapter.info;
    nlohmann::ordered_json json = {
        {"index", info.index},         {"name", info.name},     {"api", info.api},
        {"version", info.version},     {"driver", info.driver}, {"vendor_id", info.vendor_id},
        {"device_id", info.device_id}, {"cpu", info.cpu},       {"features", featureList(info.features)}};
    if (adapter.error) {
        json["error"] = adapter.error.text();
        return json;
    }
    json["tracing"] = info.tracing;
    json["traversal"] = info.traversal;
    json["memory_bytes"] = adapter.features.videoMemory;
    json["timestamp_period_ns"] = adapter.features.timestampPeriod;
    for (const Limit& limit : limitsOf(adapter.features)) json["limits"][limit.name] = limit.value;
    return json;
}

void print(const Adapter& adapter) {
    const DeviceInfo& info = adapter.info;
    fmt::print("{}: {}\n", info.index, info.name);
    fmt::print("  API        {} {}\n", info.api, info.version);
    fmt::print("  driver     {}{}\n", info.driver, info.cpu ? " (runs on the CPU)" : "");
    fmt::print("  ids        vendor {:#06x}, device {:#06x}\n", info.vendor_id, info.device_id);
    std::string line;
    const char* label = "features";
    for (const std::string& name : featureList(info.features)) {
        if (line.size() + name.size() > 100) {
            fmt::print("  {:<10} {}\n", label, line);
            label = "";
            line.clear();
        }
        line += (line.empty() ? "" : " ") + name;
    }
    fmt::print("  {:<10} {}\n", label, line);
    if (adapter.error) {
        fmt::print("  cannot be opened: {}\n\n", adapter.error.text());
        return;
    }
    fmt::print("  tracing    {}\n", info.tracing);
    fmt::print("  traversal  {}\n", info.traversal);
    fmt::print("  memory     {:.1f} GiB\n", static_cast<double>(adapter.features.videoMemory) / (1ull << 30));
    fmt::print("  limits\n");
    for (const Limit& limit : limitsOf(adapter.features))
        fmt::print("    {:<22} {:>20} {}\n", limit.name, limit.value, limit.unit);
    fmt::print("    {:<22} {:>20} ns a tick\n\n", "timestampPeriod", adapter.features.timestampPeriod);
}

int run(const Options& options) {
    const Expected<std::vector<DeviceInfo>> found = Device::adapters(options.api);
    std::vector<Adapter> adapters;
    if (found) {
        for (const DeviceInfo& info : *found) {
            const bool wanted = options.adapter.empty() || options.adapter == std::to_string(info.index) ||
                                info.name.find(options.adapter) != std::string::npos;
            if (wanted) adapters.push_back(open(info, options));
        }
    }
    if (options.json) {
        auto list = nlohmann::ordered_json::array();
        for (const Adapter& adapter : adapters) list.push_back(toJson(adapter));
        // Names come from drivers: bytes that are no UTF-8 must not stop the writing.
        fmt::print("{}\n", list.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
    } else {
        for (const Adapter& adapter : adapters) print(adapter);
    }
    if (!found) return fail("info", found.error());
    if (!adapters.empty()) return 0;
    const std::string which =
        options.adapter.empty() ? "there is no adapter" : "no adapter is '" + options.adapter + "'";
    return fail("info", Error::inFile(ErrorCode::Unsupported, "device.no_adapter", which, {}, 0));
}

}  // namespace

Command infoCommand(CLI::App& app) {
    auto options = std::make_shared<Options>();
    CLI::App* sub = app.add_subcommand("info", "Adapters, their features, limits and memory");
    sub->add_flag("--json", options->json, "Print a JSON list");
    sub->add_option("--adapter", options->adapter, "Only this adapter: its index or a part of its name")
        ->type_name("N|NAME");
    sub->add_option("--api", options->api, "Graphics API")->type_name("NAME");
    addTracing(*sub, options->tracing);
    return {sub, [options] { return run(*options); }};
}

}  // namespace tool
