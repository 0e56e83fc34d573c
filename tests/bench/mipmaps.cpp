// draw.mipmaps.over_blit: the time that createMipmaps takes for a texture, over that of blits with a linear filter,
// level by level, in hand-written Vulkan; from the recording to the end on the device.

#include "bench/bench.h"
#include "bench/raw_vulkan.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace glint::bench {

namespace {

constexpr uint32_t size = 1024;
constexpr uint32_t levels = 11;
constexpr uint32_t warm_up = 3;
constexpr uint32_t rounds = 21;

struct Kind {
    Format format;
    VkFormat native;
};
// The first one gives the figure.
constexpr Kind kinds[] = {{FormatRGBAu8n, VK_FORMAT_R8G8B8A8_UNORM},
                          {FormatRGBAu8ns, VK_FORMAT_R8G8B8A8_SRGB},
                          {FormatRGBAf16, VK_FORMAT_R16G16B16A16_SFLOAT}};

/// Smooth, so that both sides are close.
std::vector<std::byte> picture(uint32_t texel_bytes) {
    std::vector<std::byte> bytes(size_t(size) * size * texel_bytes);
    for (size_t i = 0; i < bytes.size(); i++) {
        // A half with this in both bytes is a number.
        bytes[i] = static_cast<std::byte>(0x20 + i / texel_bytes / size / 64 + i / texel_bytes % size / 64);
    }
    return bytes;
}

class RawBlits {
public:
    RawBlits(RawDevice& device, VkFormat format, const std::vector<std::byte>& bytes)
        : device_(device),
          image_(device.createImage(
              format, size, size,
              VK_IMAGE_USAGE_TRANSFER_SRC_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT | VK_IMAGE_USAGE_SAMPLED_BIT, levels)),
          staging_(device.createBuffer(bytes.size(), VK_BUFFER_USAGE_TRANSFER_SRC_BIT, true)) {
        std::copy(bytes.begin(), bytes.end(), staging_.mapped);
        VkCommandBuffer commands = device_.begin();
        barrier(commands, 0, VK_IMAGE_LAYOUT_UNDEFINED, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL);
        VkBufferImageCopy copy = {};
        copy.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
        copy.imageExtent = {size, size, 1};
        device_.vk.CmdCopyBufferToImage(commands, staging_.buffer, image_.image, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL,
                                        1, &copy);
        barrier(commands, 0, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL);
        device_.submit();
        device_.wait();
    }

    void fill() {
        VkCommandBuffer commands = device_.begin();
        for (uint32_t level = 1; level < levels; level++) {
            barrier(commands, level, VK_IMAGE_LAYOUT_UNDEFINED, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL);
            VkImageBlit blit = {};
            blit.srcSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, level - 1, 0, 1};
            blit.dstSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, level, 0, 1};
            const auto side = static_cast<int32_t>(size >> level);
            blit.srcOffsets[1] = {2 * side, 2 * side, 1};
            blit.dstOffsets[1] = {side, side, 1};
            device_.vk.CmdBlitImage(commands, image_.image, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, image_.image,
                                    VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &blit, VK_FILTER_LINEAR);
            barrier(commands, level, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL);
        }
        device_.submit();
        device_.wait();
    }

private:
    void barrier(VkCommandBuffer commands, uint32_t level, VkImageLayout from, VkImageLayout to) {
        VkImageMemoryBarrier2 image = {VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER_2};
        image.srcStageMask = image.dstStageMask = VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT;
        image.srcAccessMask = VK_ACCESS_2_TRANSFER_WRITE_BIT;
        image.dstAccessMask = VK_ACCESS_2_TRANSFER_READ_BIT | VK_ACCESS_2_TRANSFER_WRITE_BIT;
        image.oldLayout = from;
        image.newLayout = to;
        image.srcQueueFamilyIndex = image.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
        image.image = image_.image;
        image.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, level, 1, 0, 1};
        VkDependencyInfo info = {VK_STRUCTURE_TYPE_DEPENDENCY_INFO};
        info.imageMemoryBarrierCount = 1;
        info.pImageMemoryBarriers = &image;
        device_.vk.CmdPipelineBarrier2(commands, &info);
    }

    RawDevice& device_;
    RawImage image_;
    RawBuffer staging_;
};

void run(Report& report) {
    Device device = createDevice();
    RawDevice raw_device(device.getInfo().name);
    for (const Kind& kind : kinds) {
        const std::vector<std::byte> bytes = picture(formatInfo(kind.format).block_size);
        const Texture texture = device.createTexture2D(kind.format, size, size, Texture::FlagMipmaps);
        device.setTexture(texture, bytes.data(), bytes.size());
        check(device.finish());
        RawBlits blits(raw_device, kind.native, bytes);
        const auto compute = [&] {
            device.createMipmaps(texture);
            check(device.finish());
        };
        const std::array sides = {Side{compute, [] {}}, Side{[&] { blits.fill(); }, [] {}}};
        const std::vector<Times> times = interleave(sides, warm_up, rounds, wallSeconds);
        fmt::print("  {}, {} x {}\n", toString(kind.format), size, size);
        printTimes("createMipmaps", times[0]);
        printTimes("blits", times[1]);
        const double ratio = times[0].median() / times[1].median();
        fmt::print("  ratio of medians {:.2f}\n", ratio);
        if (&kind == kinds)
            report.add("draw.mipmaps.over_blit", ratio, "ratio", "blits with a linear filter", deviceName(device));
    }
}

}  // namespace

Benchmark mipmapBenchmark() { return {{"draw.mipmaps.over_blit"}, run}; }

}  // namespace glint::bench
