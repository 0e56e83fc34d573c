// The hand-written twin of examples/00_hello_triangle: startup_twin VERTEX.spv FRAGMENT.spv PICTURE.png WIDTH HEIGHT

#include "bench/raw_vulkan.h"

#include <png.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <memory>
#include <stdexcept>

namespace {

using namespace glint::bench;

struct Vertex {
    float position[2];
    float color[4];
};

struct Parameters {
    float scale[2];
    float rotation[2];  // cosine and sine
};

constexpr std::array<Vertex, 3> vertices = {{
    {{1.0f, -1.0f}, {1.0f, 0.0f, 0.0f, 1.0f}},
    {{-1.0f, -1.0f}, {0.0f, 1.0f, 0.0f, 1.0f}},
    {{0.0f, 1.0f}, {0.0f, 0.0f, 1.0f, 1.0f}},
}};

std::vector<uint32_t> loadWords(const char* path) {
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path, "rb"), std::fclose);
    if (!file) throw std::runtime_error(std::string("cannot open ") + path);
    std::fseek(file.get(), 0, SEEK_END);
    std::vector<uint32_t> words(static_cast<size_t>(std::ftell(file.get())) / sizeof(uint32_t));
    std::rewind(file.get());
    if (std::fread(words.data(), sizeof(uint32_t), words.size(), file.get()) != words.size())
        throw std::runtime_error(std::string("cannot read ") + path);
    return words;
}

void savePicture(const char* path, const std::byte* pixels, uint32_t width, uint32_t height) {
    png_image image = {};
    image.version = PNG_IMAGE_VERSION;
    image.width = width;
    image.height = height;
    image.format = PNG_FORMAT_RGBA;
    if (!png_image_write_to_file(&image, path, 0, pixels, 0, nullptr))
        throw std::runtime_error(std::string("cannot write ") + path);
}

void draw(std::span<char* const> arguments) {
    const std::vector<uint32_t> vertex = loadWords(arguments[1]);
    const std::vector<uint32_t> fragment = loadWords(arguments[2]);
    const auto width = static_cast<uint32_t>(std::atoi(arguments[4]));
    const auto height = static_cast<uint32_t>(std::atoi(arguments[5]));

    RawDevice device("");
    const RawFunctions& vk = device.vk;
    constexpr std::array attributes = {
        VkVertexInputAttributeDescription{0, 0, VK_FORMAT_R32G32_SFLOAT, offsetof(Vertex, position)},
        VkVertexInputAttributeDescription{1, 0, VK_FORMAT_R32G32B32A32_SFLOAT, offsetof(Vertex, color)},
    };
    constexpr VkDescriptorSetLayoutBinding binding = {0, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, 1,
                                                      VK_SHADER_STAGE_VERTEX_BIT};
    const RawProgram pipeline = device.createPipeline({.vertex = vertex,
                                                       .fragment = fragment,
                                                       .bindings = std::span(&binding, 1),
                                                       .attributes = attributes,
                                                       .stride = sizeof(Vertex),
                                                       .color_format = VK_FORMAT_R8G8B8A8_UNORM});
    const RawImage target = device.createImage(VK_FORMAT_R8G8B8A8_UNORM, width, height,
                                               VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT);
    const RawBuffer triangle = device.createBuffer(sizeof(vertices), VK_BUFFER_USAGE_VERTEX_BUFFER_BIT, true);
    std::memcpy(triangle.mapped, vertices.data(), sizeof(vertices));
    const RawBuffer uniforms = device.createBuffer(sizeof(Parameters), VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT, true);
    const float aspect = static_cast<float>(width) / static_cast<float>(height);
    const Parameters parameters = {{0.75f / aspect, 0.75f}, {1.0f, 0.0f}};
    std::memcpy(uniforms.mapped, &parameters, sizeof(parameters));
    const VkDescriptorSet set = device.createSets(pipeline, std::span(&binding, 1), 1)[0];
    const VkDescriptorBufferInfo uniform_info = {uniforms.buffer, 0, sizeof(Parameters)};
    VkWriteDescriptorSet write = {VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET};
    write.dstSet = set;
    write.descriptorCount = 1;
    write.descriptorType = VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER;
    write.pBufferInfo = &uniform_info;
    vk.UpdateDescriptorSets(device.handle(), 1, &write, 0, nullptr);
    const RawBuffer pixels =
        device.createBuffer(VkDeviceSize{4} * width * height, VK_BUFFER_USAGE_TRANSFER_DST_BIT, true);

    VkCommandBuffer commands = device.begin();
    const ImageState drawn = {VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL, VK_PIPELINE_STAGE_2_COLOR_ATTACHMENT_OUTPUT_BIT,
                              VK_ACCESS_2_COLOR_ATTACHMENT_WRITE_BIT};
    const ImageState copied = {VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, VK_PIPELINE_STAGE_2_COPY_BIT,
                               VK_ACCESS_2_TRANSFER_READ_BIT};
    imageBarrier(vk, commands, target.image, {}, drawn);
    VkRenderingAttachmentInfo color = {VK_STRUCTURE_TYPE_RENDERING_ATTACHMENT_INFO};
    color.imageView = target.view;
    color.imageLayout = drawn.layout;
    color.loadOp = VK_ATTACHMENT_LOAD_OP_CLEAR;
    color.storeOp = VK_ATTACHMENT_STORE_OP_STORE;
    color.clearValue = {{{0.25f, 0.25f, 0.25f, 1.0f}}};
    VkRenderingInfo rendering = {VK_STRUCTURE_TYPE_RENDERING_INFO};
    rendering.renderArea = {{0, 0}, {width, height}};
    rendering.layerCount = 1;
    rendering.colorAttachmentCount = 1;
    rendering.pColorAttachments = &color;
    vk.CmdBeginRendering(commands, &rendering);
    const auto w = static_cast<float>(width);
    const auto h = static_cast<float>(height);
    const VkViewport viewport = {0.0f, h, w, -h, 0.0f, 1.0f};
    const VkRect2D scissor = {{0, 0}, {width, height}};
    const VkDeviceSize offset = 0;
    vk.CmdSetViewport(commands, 0, 1, &viewport);
    vk.CmdSetScissor(commands, 0, 1, &scissor);
    vk.CmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline.pipeline);
    vk.CmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline.layout, 0, 1, &set, 0, nullptr);
    vk.CmdBindVertexBuffers(commands, 0, 1, &triangle.buffer, &offset);
    vk.CmdDraw(commands, 3, 1, 0, 0);
    vk.CmdEndRendering(commands);
    imageBarrier(vk, commands, target.image, drawn, copied);
    VkBufferImageCopy region = {};
    region.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
    region.imageExtent = {width, height, 1};
    vk.CmdCopyImageToBuffer(commands, target.image, copied.layout, pixels.buffer, 1, &region);
    memoryBarrier(vk, commands, VK_PIPELINE_STAGE_2_COPY_BIT, VK_ACCESS_2_TRANSFER_WRITE_BIT,
                  VK_PIPELINE_STAGE_2_HOST_BIT, VK_ACCESS_2_HOST_READ_BIT);
    device.submit();
    device.wait();
    savePicture(arguments[3], pixels.mapped, width, height);
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 6) {
        std::fprintf(stderr, "startup_twin VERTEX.spv FRAGMENT.spv PICTURE.png WIDTH HEIGHT\n");
        return 2;
    }
    try {
        draw(std::span(argv, static_cast<size_t>(argc)));
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
    return 0;
}
