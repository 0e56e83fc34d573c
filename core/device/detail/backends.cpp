#include <glint/device/detail/backends.h>

#include <glint/base/format_error.h>

#include "platform/null/null.h"
#include "platform/vulkan/vulkan.h"

#include <cstdlib>

namespace glint::detail {

namespace {

struct BackendEntry {
    std::string_view api;
    Expected<std::unique_ptr<Backend>> (*create)(const BackendDesc&);
    Expected<std::vector<DeviceInfo>> (*adapters)();
};

constexpr BackendEntry entries[] = {
    {"vulkan", vulkan::createVulkanBackend, vulkan::vulkanAdapters},
    {"null", null::createNullBackend, null::nullAdapters},
};

Expected<const BackendEntry*> find(std::string_view api) {
    const char* chosen = std::getenv("GLINT_API");
    if (api.empty()) api = chosen && *chosen ? chosen : "vulkan";
    for (const BackendEntry& entry : entries)
        if (entry.api == api) return &entry;
    return unexpected(
        makeError(ErrorCode::InvalidArgument, "device.api", "there is no API '{}'; vulkan and null are there", api));
}

}  // namespace

Expected<std::unique_ptr<Backend>> createBackend(std::string_view api, const BackendDesc& desc) {
    const Expected<const BackendEntry*> entry = find(api);
    if (!entry) return unexpected(entry.error());
    return (*entry)->create(desc);
}

Expected<std::vector<DeviceInfo>> listAdapters(std::string_view api) {
    const Expected<const BackendEntry*> entry = find(api);
    if (!entry) return unexpected(entry.error());
    return (*entry)->adapters();
}

}  // namespace glint::detail
