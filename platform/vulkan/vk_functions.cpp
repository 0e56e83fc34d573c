#include "platform/vulkan/vk_functions.h"

#include <dlfcn.h>

namespace glint::vulkan {

const LoaderFunctions* loaderFunctions() {
    static const LoaderFunctions loaded = [] {
        LoaderFunctions vk;
        // Never closed: drivers and layers leave threads and exit handlers behind.
        void* library = dlopen("libvulkan.so.1", RTLD_NOW | RTLD_LOCAL);
        if (!library) library = dlopen("libvulkan.so", RTLD_NOW | RTLD_LOCAL);
        if (!library) return vk;
        vk.GetInstanceProcAddr = reinterpret_cast<PFN_vkGetInstanceProcAddr>(dlsym(library, "vkGetInstanceProcAddr"));
        if (!vk.GetInstanceProcAddr) return vk;
#define GLINT_VULKAN_LOAD(name) vk.name = reinterpret_cast<PFN_vk##name>(vk.GetInstanceProcAddr(nullptr, "vk" #name));
        GLINT_VULKAN_GLOBAL_FUNCTIONS(GLINT_VULKAN_LOAD)
#undef GLINT_VULKAN_LOAD
        return vk;
    }();
    return loaded.CreateInstance ? &loaded : nullptr;
}

void InstanceFunctions::load(PFN_vkGetInstanceProcAddr get, VkInstance instance) {
    GetInstanceProcAddr = get;
#define GLINT_VULKAN_LOAD(name) name = reinterpret_cast<PFN_vk##name>(get(instance, "vk" #name));
    GLINT_VULKAN_INSTANCE_FUNCTIONS(GLINT_VULKAN_LOAD)
    GLINT_VULKAN_SURFACE_FUNCTIONS(GLINT_VULKAN_LOAD)
    GLINT_VULKAN_DEBUG_FUNCTIONS(GLINT_VULKAN_LOAD)
#undef GLINT_VULKAN_LOAD
}

void DeviceFunctions::load(PFN_vkGetDeviceProcAddr get, VkDevice device) {
#define GLINT_VULKAN_LOAD(name) name = reinterpret_cast<PFN_vk##name>(get(device, "vk" #name));
    GLINT_VULKAN_DEVICE_FUNCTIONS(GLINT_VULKAN_LOAD)
    GLINT_VULKAN_SWAPCHAIN_FUNCTIONS(GLINT_VULKAN_LOAD)
    GLINT_VULKAN_TRACING_FUNCTIONS(GLINT_VULKAN_LOAD)
    GLINT_VULKAN_TRAVERSAL_FUNCTIONS(GLINT_VULKAN_LOAD)
    GLINT_VULKAN_MESH_FUNCTIONS(GLINT_VULKAN_LOAD)
#undef GLINT_VULKAN_LOAD
}

}  // namespace glint::vulkan
