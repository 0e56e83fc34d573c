#include "platform/vulkan/native.h"

#include "platform/vulkan/vk_buffer.h"
#include "platform/vulkan/vk_device.h"
#include "platform/vulkan/vk_format.h"
#include "platform/vulkan/vk_kernel.h"
#include "platform/vulkan/vk_pipeline.h"
#include "platform/vulkan/vk_texture.h"
#include "platform/vulkan/vk_tracing.h"

#include <glint/base/format_error.h>
#include <glint/device/detail/device_object.h>

#include <algorithm>
#include <bit>
#include <optional>

namespace glint::vulkan {

using namespace detail;

namespace {

VulkanDevice* vulkanDevice(const DeviceObject* device) {
    if (!device || !device->backend || device->info().api != "vulkan") return nullptr;
    return static_cast<VulkanDevice*>(device->backend.get());
}

/// The back end's part of a handle that is ready and of this API.
template <class T>
T* nativeOf(const Handle& handle) {
    if (!handle || !vulkanDevice(handle.object()->device())) return nullptr;
    return static_cast<T*>(handle.object()->native.get());
}

std::optional<Layout> glintLayout(VkImageLayout layout) {
    for (Layout known : {Layout::Undefined, Layout::General, Layout::Sampled, Layout::ColorTarget, Layout::DepthTarget,
                         Layout::CopySource, Layout::CopyDestination, Layout::Present}) {
        if (vulkanLayout(known) == layout) return known;
    }
    return std::nullopt;
}

/// Work of the caller's may have written it in any stage.
ResourceState foreignState(Layout layout) {
    ResourceState state;
    state.write_stages = static_cast<StageMask>((1u << stage_count) - 1);
    state.layout = layout;
    return state;
}

/// The device of an import; on failure the object carries the error.
VulkanDevice* importer(const Device& device, Object& object, std::string_view name, bool is_null,
                       std::source_location where) {
    object.setName(name);
    VulkanDevice* native = nullptr;
    if (!device) {
        object.fail(device.error().at(where));
    } else if (native = vulkanDevice(object.device()); !native) {
        object.fail(makeError(where, ErrorCode::InvalidArgument, "native.api", "import into '{}', a device of {}",
                              device.getInfo().name, device.getInfo().api));
    } else if (is_null) {
        object.fail(makeError(where, ErrorCode::InvalidArgument, "native.null", "import of a null handle"));
        native = nullptr;
    }
    return native;
}

DeviceObject* deviceObject(const Device& device) {
    return device ? static_cast<DeviceObject*>(device.object()) : nullptr;
}

}  // namespace

NativeDevice nativeDevice(const Device& device, Queue queue) {
    const VulkanDevice* native = vulkanDevice(deviceObject(device));
    if (!native) return {};
    NativeDevice result;
    result.instance = native->instance->handle;
    result.adapter = native->adapter.handle;
    result.device = native->handle;
    if (native->hasQueue(queue)) {
        result.queue = native->queue(queue).handle();
        result.family = native->queue(queue).family();
        result.timeline = native->queue(queue).timeline();
    }
    return result;
}

VkBuffer nativeBuffer(const Buffer& buffer) {
    const auto* native = nativeOf<VulkanBuffer>(buffer);
    return native ? native->handle() : VK_NULL_HANDLE;
}

VkImage nativeImage(const Texture& texture) {
    const auto* native = nativeOf<VulkanTexture>(texture);
    return native ? native->handle() : VK_NULL_HANDLE;
}

VkPipeline nativePipeline(const Kernel& kernel) {
    const auto* native = nativeOf<VulkanKernel>(kernel);
    return native ? native->handle() : VK_NULL_HANDLE;
}

VkPipeline nativePipeline(const Pipeline& pipeline) {
    const auto* native = nativeOf<VulkanPipeline>(pipeline);
    return native ? native->handle() : VK_NULL_HANDLE;
}

VkAccelerationStructureKHR nativeTracing(const Tracing& tracing) {
    if (tracing && tracing.object()->device()->heap()) return VK_NULL_HANDLE;  // the software engine's
    const auto* native = nativeOf<VulkanTracing>(tracing);
    return native ? native->handle() : VK_NULL_HANDLE;
}

Device importDevice(const DeviceImport& source, std::source_location where) {
    auto* object = new DeviceObject;
    if (!source.instance || !source.adapter || !source.device || !source.queue) {
        object->fail(makeError(where, ErrorCode::InvalidArgument, "native.null",
                               "importDevice: instance, adapter, device and queue are all needed"));
        return Device(object);
    }
    PFN_vkGetInstanceProcAddr get = source.get_proc;
    if (!get && loaderFunctions()) get = loaderFunctions()->GetInstanceProcAddr;
    if (!get) {
        object->fail(makeError(where, ErrorCode::Unsupported, "device.no_driver",
                               "importDevice: libvulkan.so.1 cannot be loaded, and get_proc is null"));
        return Device(object);
    }
    Expected<std::unique_ptr<Backend>> made = VulkanDevice::adopt(
        {source.instance, get, source.adapter, source.device, source.queue, source.family, source.features});
    if (!made) {
        object->fail(made.error().at(where));
    } else {
        object->adopt(std::move(*made), source.message);
    }
    return Device(object);
}

Buffer importBuffer(const Device& device, VkBuffer handle, uint64_t size, Buffer::Flags flags, std::string_view name,
                    std::source_location where) {
    auto* object = new BufferObject(deviceObject(device));
    if (VulkanDevice* native = importer(device, *object, name, !handle || !size, where)) {
        object->size = size;
        object->flags = flags & ~static_cast<Buffer::Flags>(Buffer::FlagMapped);
        object->use = foreignState(Layout::Undefined);
        object->native = VulkanBuffer::adopt(*native, handle, object->flags);
        object->setReady();
    }
    return Buffer(object);
}

Texture importTexture(const Device& device, VkImage image, const TextureDesc& desc, VkImageLayout layout,
                      std::string_view name, std::source_location where) {
    auto* object = new TextureObject(deviceObject(device));
    VulkanDevice* native = importer(device, *object, name, !image, where);
    const std::optional<Layout> known = glintLayout(layout);
    if (native && !known) {
        object->fail(makeError(where, ErrorCode::InvalidArgument, "native.layout",
                               "importTexture: Glint has no use for VkImageLayout {}", static_cast<int>(layout)));
    } else if (native) {
        object->desc = desc;
        if (desc.type == Texture::TypeCube) object->desc.layers *= 6;
        if (desc.flags & Texture::FlagMipmaps) {
            object->desc.mipmaps =
                static_cast<uint32_t>(std::bit_width(std::max({desc.width, desc.height, desc.depth, 1u})));
        }
        if (desc.flags & Texture::FlagMultisample2) object->samples = 2;
        if (desc.flags & Texture::FlagMultisample4) object->samples = 4;
        if (desc.flags & Texture::FlagMultisample8) object->samples = 8;
        object->uses.assign(object->desc.mipmaps * object->desc.layers, foreignState(*known));
        object->native = VulkanTexture::adopt(*native, image, object->desc, object->samples);
        object->setReady();
    }
    return Texture(object);
}

}  // namespace glint::vulkan
