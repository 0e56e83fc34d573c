// overhead.draw_1000: the recording thread's time for 1,000 draws in one target, from createCommand to the return of
// submit, over that of hand-written Vulkan.

#include "bench/bench.h"
#include "bench/raw_vulkan.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace glint::bench {

namespace {

constexpr uint32_t draw_count = 1000;
constexpr uint32_t picture_count = 4;
constexpr uint32_t vertex_buffer_count = 2;
constexpr uint32_t size = 64;
constexpr uint32_t warm_up = 10;
constexpr uint32_t rounds = 101;

constexpr const char* vertex_source = R"(
layout(binding = 0) uniform Parameters { mat4 transform; };
layout(location = 0) in vec4 position;
void main() { gl_Position = transform * position; }
)";

constexpr const char* fragment_source = R"(
layout(binding = 1) uniform texture2D picture;
layout(binding = 2) uniform sampler picture_sampler;
layout(location = 0) out vec4 color;
void main() { color = texture(sampler2D(picture, picture_sampler), vec2(0.5)); }
)";

struct Parameters {
    float transform[16];
};

struct Vertex {
    float position[4];
};

// Small triangles in a spiral, so that the picture shows whether every draw had its own values.
Parameters parameters(uint32_t draw) {
    const float angle = static_cast<float>(draw) * 0.1f;
    const float radius = static_cast<float>(draw) / draw_count;
    return {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, radius * std::cos(angle), radius * std::sin(angle), 0, 1}};
}

std::vector<Parameters> allParameters() {
    std::vector<Parameters> all;
    for (uint32_t i = 0; i < draw_count; i++) all.push_back(parameters(i));
    return all;
}

constexpr std::array<Vertex, 3> triangle(uint32_t buffer) {
    const float s = 0.05f + 0.05f * static_cast<float>(buffer);
    return {{{{-s, -s, 0.5f, 1.0f}}, {{s, -s, 0.5f, 1.0f}}, {{0.0f, s, 0.5f, 1.0f}}}};
}

constexpr Color pictureColor(uint32_t picture) {
    const float value = static_cast<float>(picture) / picture_count;
    return {value, 1.0f - value, 0.25f, 1.0f};
}

class GlintDraws {
public:
    GlintDraws(const Device& device, const Shader& vertex, const Shader& fragment, std::span<const Parameters> values)
        : device_(device),
          values_(values),
          pipeline_(device_.createPipeline()),
          target_texture_(device_.createTexture2D(FormatRGBAu8n, size, size, Texture::FlagTarget)),
          target_(device_.createTarget(target_texture_)),
          sampler_(device_.createSampler()) {
        pipeline_.setShader(vertex);
        pipeline_.setShader(fragment);
        pipeline_.addAttribute(Pipeline::AttributePosition, FormatRGBAf32, 0, 0, sizeof(Vertex));
        pipeline_.setColorFormat(FormatRGBAu8n);
        check(pipeline_.create());
        target_.setClearColor(Color::black());
        for (uint32_t i = 0; i < vertex_buffer_count; i++) {
            const auto vertices = triangle(i);
            vertices_[i] = device_.createBuffer(Buffer::FlagVertex, vertices.data(), sizeof(vertices));
        }
        for (uint32_t i = 0; i < picture_count; i++) {
            pictures_[i] = device_.createTexture2D(FormatRGBAu8n, 4, 4);
            device_.clearTexture(pictures_[i], pictureColor(i));
        }
        check(device_.finish());
    }

    void frame() {
        Command command = device_.createCommand(target_);
        command.setPipeline(pipeline_);
        command.setSampler(0, sampler_);
        for (uint32_t i = 0; i < draw_count; i++) {
            command.setUniform(0, values_[i]);
            command.setTexture(0, pictures_[i % picture_count]);
            command.setVertexBuffer(0, vertices_[i % vertex_buffer_count]);
            command.drawArrays(3);
        }
        check(command.end());
        check(device_.submit(command));
    }

    void wait() { check(device_.finish()); }

    std::vector<uint8_t> read() {
        std::vector<uint8_t> pixels(size * size * 4);
        check(device_.getTexture(target_texture_, pixels.data(), pixels.size()));
        return pixels;
    }

private:
    Device device_;
    std::span<const Parameters> values_;
    Pipeline pipeline_;
    Texture target_texture_;
    Target target_;
    Sampler sampler_;
    std::array<Buffer, vertex_buffer_count> vertices_;
    std::array<Texture, picture_count> pictures_;
};

// A descriptor set for each draw, its picture written when the draw is recorded, or all of them written once
// beforehand, which only a program that knows its frame can do; uniforms by a dynamic offset into one mapped buffer.
class RawDraws {
public:
    enum class Descriptors { Written, Prepared };

    RawDraws(RawDevice& device, std::span<const uint32_t> vertex, std::span<const uint32_t> fragment,
             std::span<const Parameters> values, Descriptors descriptors)
        : device_(device), descriptors_(descriptors), values_(values) {
        constexpr std::array bindings = {
            VkDescriptorSetLayoutBinding{0, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER_DYNAMIC, 1, VK_SHADER_STAGE_VERTEX_BIT},
            VkDescriptorSetLayoutBinding{1, VK_DESCRIPTOR_TYPE_SAMPLED_IMAGE, 1, VK_SHADER_STAGE_FRAGMENT_BIT},
            VkDescriptorSetLayoutBinding{2, VK_DESCRIPTOR_TYPE_SAMPLER, 1, VK_SHADER_STAGE_FRAGMENT_BIT},
        };
        constexpr VkVertexInputAttributeDescription position = {0, 0, VK_FORMAT_R32G32B32A32_SFLOAT, 0};
        pipeline_ = device_.createPipeline({.vertex = vertex,
                                            .fragment = fragment,
                                            .bindings = bindings,
                                            .attributes = std::span(&position, 1),
                                            .stride = sizeof(Vertex),
                                            .color_format = VK_FORMAT_R8G8B8A8_UNORM});
        sets_ = device_.createSets(pipeline_, bindings, draw_count);
        target_ = device_.createImage(VK_FORMAT_R8G8B8A8_UNORM, size, size,
                                      VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT);
        sampler_ = device_.createSampler();
        const auto alignment = static_cast<uint32_t>(device_.limits().minUniformBufferOffsetAlignment);
        stride_ = (static_cast<uint32_t>(sizeof(Parameters)) + alignment - 1) / alignment * alignment;
        uniforms_ = device_.createBuffer(stride_ * draw_count, VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT, true);
        readback_ = device_.createBuffer(size * size * 4, VK_BUFFER_USAGE_TRANSFER_DST_BIT, true);
        for (uint32_t i = 0; i < vertex_buffer_count; i++) {
            const auto vertices = triangle(i);
            vertices_[i] = device_.createBuffer(sizeof(vertices), VK_BUFFER_USAGE_VERTEX_BUFFER_BIT, true);
            std::memcpy(vertices_[i].mapped, vertices.data(), sizeof(vertices));
        }
        fillPictures();
        for (uint32_t i = 0; i < draw_count; i++) {
            const VkDescriptorBufferInfo buffer = {uniforms_.buffer, 0, sizeof(Parameters)};
            const VkDescriptorImageInfo sampler = {sampler_, VK_NULL_HANDLE, VK_IMAGE_LAYOUT_UNDEFINED};
            std::array<VkWriteDescriptorSet, 2> writes = {};
            writes[0].sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
            writes[0].dstSet = sets_[i];
            writes[0].descriptorCount = 1;
            writes[0].descriptorType = VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER_DYNAMIC;
            writes[0].pBufferInfo = &buffer;
            writes[1] = writes[0];
            writes[1].dstBinding = 2;
            writes[1].descriptorType = VK_DESCRIPTOR_TYPE_SAMPLER;
            writes[1].pBufferInfo = nullptr;
            writes[1].pImageInfo = &sampler;
            device_.vk.UpdateDescriptorSets(device_.handle(), static_cast<uint32_t>(writes.size()), writes.data(), 0,
                                            nullptr);
            writePicture(i);
        }
    }

    void frame() {
        const RawFunctions& vk = device_.vk;
        VkCommandBuffer commands = device_.begin();
        // The frame before may still write the target.
        const ImageState before = {VK_IMAGE_LAYOUT_UNDEFINED, VK_PIPELINE_STAGE_2_COLOR_ATTACHMENT_OUTPUT_BIT,
                                   VK_ACCESS_2_COLOR_ATTACHMENT_WRITE_BIT};
        imageBarrier(vk, commands, target_.image, before, drawn);

        VkRenderingAttachmentInfo color = {VK_STRUCTURE_TYPE_RENDERING_ATTACHMENT_INFO};
        color.imageView = target_.view;
        color.imageLayout = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL;
        color.loadOp = VK_ATTACHMENT_LOAD_OP_CLEAR;
        color.storeOp = VK_ATTACHMENT_STORE_OP_STORE;
        color.clearValue = {{{0.0f, 0.0f, 0.0f, 1.0f}}};
        VkRenderingInfo rendering = {VK_STRUCTURE_TYPE_RENDERING_INFO};
        rendering.renderArea = {{0, 0}, {size, size}};
        rendering.layerCount = 1;
        rendering.colorAttachmentCount = 1;
        rendering.pColorAttachments = &color;
        vk.CmdBeginRendering(commands, &rendering);
        // Upside down: Glint's clip space points up.
        const VkViewport viewport = {
            0.0f, static_cast<float>(size), static_cast<float>(size), -static_cast<float>(size), 0.0f, 1.0f};
        const VkRect2D scissor = {{0, 0}, {size, size}};
        vk.CmdSetViewport(commands, 0, 1, &viewport);
        vk.CmdSetScissor(commands, 0, 1, &scissor);
        vk.CmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline_.pipeline);
        for (uint32_t i = 0; i < draw_count; i++) {
            const uint32_t offset = i * stride_;
            std::memcpy(uniforms_.mapped + offset, &values_[i], sizeof(Parameters));
            if (descriptors_ == Descriptors::Written) writePicture(i);
            vk.CmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline_.layout, 0, 1, &sets_[i], 1,
                                     &offset);
            const VkDeviceSize vertex_offset = 0;
            vk.CmdBindVertexBuffers(commands, 0, 1, &vertices_[i % vertex_buffer_count].buffer, &vertex_offset);
            vk.CmdDraw(commands, 3, 1, 0, 0);
        }
        vk.CmdEndRendering(commands);
        device_.submit();
    }

    void wait() { device_.wait(); }

    std::vector<uint8_t> read() {
        VkCommandBuffer commands = device_.begin();
        const ImageState copied = {VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, VK_PIPELINE_STAGE_2_COPY_BIT,
                                   VK_ACCESS_2_TRANSFER_READ_BIT};
        imageBarrier(device_.vk, commands, target_.image, drawn, copied);
        VkBufferImageCopy region = {};
        region.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
        region.imageExtent = {size, size, 1};
        device_.vk.CmdCopyImageToBuffer(commands, target_.image, copied.layout, readback_.buffer, 1, &region);
        memoryBarrier(device_.vk, commands, VK_PIPELINE_STAGE_2_COPY_BIT, VK_ACCESS_2_TRANSFER_WRITE_BIT,
                      VK_PIPELINE_STAGE_2_HOST_BIT, VK_ACCESS_2_HOST_READ_BIT);
        device_.submit();
        device_.wait();
        std::vector<uint8_t> pixels(readback_.size);
        std::memcpy(pixels.data(), readback_.mapped, pixels.size());
        return pixels;
    }

private:
    static constexpr ImageState drawn = {VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL,
                                         VK_PIPELINE_STAGE_2_COLOR_ATTACHMENT_OUTPUT_BIT,
                                         VK_ACCESS_2_COLOR_ATTACHMENT_WRITE_BIT};

    void fillPictures() {
        VkCommandBuffer commands = device_.begin();
        const ImageState cleared = {VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, VK_PIPELINE_STAGE_2_CLEAR_BIT,
                                    VK_ACCESS_2_TRANSFER_WRITE_BIT};
        const ImageState sampled = {VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL, VK_PIPELINE_STAGE_2_FRAGMENT_SHADER_BIT,
                                    VK_ACCESS_2_SHADER_SAMPLED_READ_BIT};
        const VkImageSubresourceRange range = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
        for (uint32_t i = 0; i < picture_count; i++) {
            pictures_[i] = device_.createImage(VK_FORMAT_R8G8B8A8_UNORM, 4, 4,
                                               VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT);
            const Color color = pictureColor(i);
            const VkClearColorValue value = {{color.r, color.g, color.b, color.a}};
            imageBarrier(device_.vk, commands, pictures_[i].image, {}, cleared);
            device_.vk.CmdClearColorImage(commands, pictures_[i].image, cleared.layout, &value, 1, &range);
            imageBarrier(device_.vk, commands, pictures_[i].image, cleared, sampled);
        }
        device_.submit();
        device_.wait();
    }

    void writePicture(uint32_t draw) {
        const VkDescriptorImageInfo info = {VK_NULL_HANDLE, pictures_[draw % picture_count].view,
                                            VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL};
        VkWriteDescriptorSet write = {VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET};
        write.dstSet = sets_[draw];
        write.dstBinding = 1;
        write.descriptorCount = 1;
        write.descriptorType = VK_DESCRIPTOR_TYPE_SAMPLED_IMAGE;
        write.pImageInfo = &info;
        device_.vk.UpdateDescriptorSets(device_.handle(), 1, &write, 0, nullptr);
    }

    RawDevice& device_;
    const Descriptors descriptors_;
    std::span<const Parameters> values_;
    RawProgram pipeline_;
    std::vector<VkDescriptorSet> sets_;
    RawImage target_;
    VkSampler sampler_ = VK_NULL_HANDLE;
    uint32_t stride_ = 0;
    RawBuffer uniforms_;
    RawBuffer readback_;
    std::array<RawBuffer, vertex_buffer_count> vertices_;
    std::array<RawImage, picture_count> pictures_;
};

void run(Report& report) {
    Device device = createDevice();
    const Shader vertex = check(Shader::createGLSL(Shader::TypeVertex, vertex_source));
    const Shader fragment = check(Shader::createGLSL(Shader::TypeFragment, fragment_source));
    RawDevice raw_device(device.getInfo().name);

    const std::vector<Parameters> values = allParameters();
    GlintDraws glint(device, vertex, fragment, values);
    RawDraws raw(raw_device, vertex.getWords(), fragment.getWords(), values, RawDraws::Descriptors::Written);
    RawDraws prepared(raw_device, vertex.getWords(), fragment.getWords(), values, RawDraws::Descriptors::Prepared);
    const std::array sides = {
        Side{[&] { glint.frame(); }, [&] { glint.wait(); }},
        Side{[&] { raw.frame(); }, [&] { raw.wait(); }},
        Side{[&] { prepared.frame(); }, [&] { prepared.wait(); }},
    };
    const std::vector<Times> times = interleave(sides, warm_up, rounds);
    const std::vector<uint8_t> picture = raw.read();
    if (std::all_of(picture.begin(), picture.end(), [&](uint8_t value) { return value == picture.front(); }))
        throw std::runtime_error("the hand-written side drew nothing");
    if (glint.read() != picture || prepared.read() != picture)
        throw std::runtime_error("the sides drew different pictures");

    printTimes("Glint", times[0]);
    printTimes("Vulkan", times[1]);
    printTimes("Vulkan, descriptors prepared", times[2]);
    fmt::print("  ratio of medians {:.2f}, of minima {:.2f}; to prepared descriptors {:.2f}\n",
               times[0].median() / times[1].median(), times[0].minimum() / times[1].minimum(),
               times[0].median() / times[2].median());
    report.add("overhead.draw_1000", times[0].median() / times[1].median(), "ratio", "hand-written Vulkan",
               deviceName(device));
}

}  // namespace

Benchmark drawBenchmark() { return {{"overhead.draw_1000"}, run}; }

}  // namespace glint::bench
