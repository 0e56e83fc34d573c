#include "platform/vulkan/vk_pipeline.h"

#include "platform/vulkan/vk_device.h"
#include "platform/vulkan/vk_format.h"
#include "platform/vulkan/vk_kernel.h"
#include "platform/vulkan/vk_result.h"

// Which way up: Glint's clip space has +Y up and row 0 of a texture is the top of the picture, as in OpenGL and
// Direct3D. The player gets there with viewports of negative height, so shaders and projections need no flip. Vulkan
// decides on facing in framebuffer coordinates, where a positive area (Vulkan 1.3, "Basic Polygon Rasterization") is a
// triangle that runs counterclockwise on the screen: so FrontMode means what one sees, which with +Y up is also the
// order in clip space.

namespace glint::vulkan {

using namespace detail;

namespace {

VkPrimitiveTopology topology(Primitive primitive) {
    switch (primitive) {
        case Primitive::Point: return VK_PRIMITIVE_TOPOLOGY_POINT_LIST;
        case Primitive::Line: return VK_PRIMITIVE_TOPOLOGY_LINE_LIST;
        case Primitive::LineStrip: return VK_PRIMITIVE_TOPOLOGY_LINE_STRIP;
        case Primitive::Triangle: return VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST;
        case Primitive::TriangleStrip: return VK_PRIMITIVE_TOPOLOGY_TRIANGLE_STRIP;
        case Primitive::Patch: return VK_PRIMITIVE_TOPOLOGY_PATCH_LIST;
    }
    return VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST;
}

VkCullModeFlags cullMode(CullMode mode) {
    switch (mode) {
        case CullMode::None: return VK_CULL_MODE_NONE;
        case CullMode::Back: return VK_CULL_MODE_BACK_BIT;
        case CullMode::Front: return VK_CULL_MODE_FRONT_BIT;
    }
    return VK_CULL_MODE_NONE;
}

VkBlendOp blendOperation(BlendOperation operation) {
    static_assert(VK_BLEND_OP_ADD == int(BlendOperation::Add) && VK_BLEND_OP_MAX == int(BlendOperation::Maximum));
    return static_cast<VkBlendOp>(operation);
}

VkBlendFactor blendFactor(BlendFactor factor) {
    switch (factor) {
        case BlendFactor::Zero: return VK_BLEND_FACTOR_ZERO;
        case BlendFactor::One: return VK_BLEND_FACTOR_ONE;
        case BlendFactor::SourceColor: return VK_BLEND_FACTOR_SRC_COLOR;
        case BlendFactor::InvSourceColor: return VK_BLEND_FACTOR_ONE_MINUS_SRC_COLOR;
        case BlendFactor::SourceAlpha: return VK_BLEND_FACTOR_SRC_ALPHA;
        case BlendFactor::InvSourceAlpha: return VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA;
        case BlendFactor::DestinationColor: return VK_BLEND_FACTOR_DST_COLOR;
        case BlendFactor::InvDestinationColor: return VK_BLEND_FACTOR_ONE_MINUS_DST_COLOR;
        case BlendFactor::DestinationAlpha: return VK_BLEND_FACTOR_DST_ALPHA;
        case BlendFactor::InvDestinationAlpha: return VK_BLEND_FACTOR_ONE_MINUS_DST_ALPHA;
        case BlendFactor::Constant: return VK_BLEND_FACTOR_CONSTANT_COLOR;
        case BlendFactor::InvConstant: return VK_BLEND_FACTOR_ONE_MINUS_CONSTANT_COLOR;
    }
    return VK_BLEND_FACTOR_ONE;
}

VkStencilOp stencilOperation(StencilOperation operation) {
    switch (operation) {
        case StencilOperation::Keep: return VK_STENCIL_OP_KEEP;
        case StencilOperation::Zero: return VK_STENCIL_OP_ZERO;
        case StencilOperation::Replace: return VK_STENCIL_OP_REPLACE;
        case StencilOperation::Invert: return VK_STENCIL_OP_INVERT;
        case StencilOperation::IncrementWrap: return VK_STENCIL_OP_INCREMENT_AND_WRAP;
        case StencilOperation::DecrementWrap: return VK_STENCIL_OP_DECREMENT_AND_WRAP;
        case StencilOperation::Increment: return VK_STENCIL_OP_INCREMENT_AND_CLAMP;
        case StencilOperation::Decrement: return VK_STENCIL_OP_DECREMENT_AND_CLAMP;
    }
    return VK_STENCIL_OP_KEEP;
}

VkStencilOpState stencilState(const StencilFace& face, const PipelineDesc& desc) {
    return {stencilOperation(face.fail),
            stencilOperation(face.pass),
            stencilOperation(face.depth_fail),
            vulkanCompare(face.compare),
            desc.stencil_read_mask,
            desc.stencil_write_mask,
            0};
}

VkPipelineColorBlendAttachmentState blendState(const BlendDesc& blend) {
    return {blend.enabled,
            blendFactor(blend.color_source),
            blendFactor(blend.color_destination),
            blendOperation(blend.color_operation),
            blendFactor(blend.alpha_source),
            blendFactor(blend.alpha_destination),
            blendOperation(blend.alpha_operation),
            blend.write_mask};
}

bool hasStage(const PipelineDesc& desc, ShaderStage stage) {
    for (const StageDesc& own : desc.stages) {
        if (own.stage == stage) return true;
    }
    return false;
}

}  // namespace

Expected<std::unique_ptr<VulkanPipeline>> VulkanPipeline::create(VulkanDevice& device, const PipelineDesc& desc) {
    Expected<PipelineLayout*> layout = device.layouts.get(*desc.layout);
    if (!layout) return unexpected(layout.error().named(desc.name));
    std::vector<std::unique_ptr<StageModule>> modules;
    std::vector<VkPipelineShaderStageCreateInfo> stages;
    for (const StageDesc& stage : desc.stages) {
        modules.push_back(std::make_unique<StageModule>(device));
        if (Status status = modules.back()->create(stage); !status) return unexpected(status.error().named(desc.name));
        stages.push_back(modules.back()->info);
    }

    std::vector<VkVertexInputBindingDescription> buffers;
    buffers.reserve(desc.vertex_buffers.size());
    for (const VertexBuffer& buffer : desc.vertex_buffers) {
        buffers.push_back({static_cast<uint32_t>(buffers.size()), buffer.stride,
                           buffer.rate ? VK_VERTEX_INPUT_RATE_INSTANCE : VK_VERTEX_INPUT_RATE_VERTEX});
    }
    std::vector<VkVertexInputAttributeDescription> attributes;
    attributes.reserve(desc.attributes.size());
    for (const VertexAttribute& attribute : desc.attributes) {
        attributes.push_back({attribute.location, attribute.buffer, vulkanFormat(attribute.format), attribute.offset});
    }
    VkPipelineVertexInputStateCreateInfo vertex_input = {VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO};
    vertex_input.vertexBindingDescriptionCount = static_cast<uint32_t>(buffers.size());
    vertex_input.pVertexBindingDescriptions = buffers.data();
    vertex_input.vertexAttributeDescriptionCount = static_cast<uint32_t>(attributes.size());
    vertex_input.pVertexAttributeDescriptions = attributes.data();

    VkPipelineInputAssemblyStateCreateInfo assembly = {VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO};
    assembly.topology = topology(desc.primitive);
    VkPipelineTessellationStateCreateInfo tessellation = {VK_STRUCTURE_TYPE_PIPELINE_TESSELLATION_STATE_CREATE_INFO};
    tessellation.patchControlPoints = 3;

    VkPipelineViewportStateCreateInfo viewport = {VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO};

    VkPipelineRasterizationStateCreateInfo raster = {VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO};
    raster.depthClampEnable = desc.depth_clamp;
    raster.polygonMode = desc.fill == FillMode::Line ? VK_POLYGON_MODE_LINE : VK_POLYGON_MODE_FILL;
    raster.cullMode = cullMode(desc.cull);
    raster.frontFace = desc.front == FrontMode::Clockwise ? VK_FRONT_FACE_CLOCKWISE : VK_FRONT_FACE_COUNTER_CLOCKWISE;
    raster.depthBiasEnable = desc.depth_bias != 0.0f || desc.depth_slope != 0.0f;
    raster.depthBiasConstantFactor = desc.depth_bias;
    raster.depthBiasSlopeFactor = desc.depth_slope;
    raster.lineWidth = 1.0f;

    VkPipelineMultisampleStateCreateInfo multisample = {VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO};
    multisample.rasterizationSamples = vulkanSamples(desc.samples);
    multisample.alphaToCoverageEnable = desc.alpha_to_coverage;

    VkPipelineDepthStencilStateCreateInfo depth = {VK_STRUCTURE_TYPE_PIPELINE_DEPTH_STENCIL_STATE_CREATE_INFO};
    // Vulkan writes depth only where it tests: writing without a test is a test that always passes.
    depth.depthTestEnable = desc.depth_test || desc.depth_write;
    depth.depthWriteEnable = desc.depth_write;
    depth.depthCompareOp = desc.depth_test ? vulkanCompare(desc.depth_compare) : VK_COMPARE_OP_ALWAYS;
    depth.stencilTestEnable = desc.hasStencilTest();
    depth.front = stencilState(desc.stencil_front, desc);
    depth.back = stencilState(desc.stencil_back, desc);

    std::vector<VkPipelineColorBlendAttachmentState> blends;
    blends.reserve(desc.blends.size());
    for (const BlendDesc& blend : desc.blends) blends.push_back(blendState(blend));
    blends.resize(desc.color_formats.size(), blendState({}));
    VkPipelineColorBlendStateCreateInfo blending = {VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO};
    blending.attachmentCount = static_cast<uint32_t>(blends.size());
    blending.pAttachments = blends.data();

    constexpr VkDynamicState dynamic_states[] = {VK_DYNAMIC_STATE_VIEWPORT_WITH_COUNT,
                                                 VK_DYNAMIC_STATE_SCISSOR_WITH_COUNT, VK_DYNAMIC_STATE_BLEND_CONSTANTS,
                                                 VK_DYNAMIC_STATE_STENCIL_REFERENCE};
    VkPipelineDynamicStateCreateInfo dynamic = {VK_STRUCTURE_TYPE_PIPELINE_DYNAMIC_STATE_CREATE_INFO};
    dynamic.dynamicStateCount = static_cast<uint32_t>(std::size(dynamic_states));
    dynamic.pDynamicStates = dynamic_states;

    std::vector<VkFormat> formats;
    formats.reserve(desc.color_formats.size());
    for (Format format : desc.color_formats) formats.push_back(vulkanFormat(format));
    VkPipelineRenderingCreateInfo rendering = {VK_STRUCTURE_TYPE_PIPELINE_RENDERING_CREATE_INFO};
    rendering.colorAttachmentCount = static_cast<uint32_t>(formats.size());
    rendering.pColorAttachmentFormats = formats.data();
    rendering.depthAttachmentFormat = vulkanFormat(desc.depth_format);
    if (formatInfo(desc.depth_format).stencil) rendering.stencilAttachmentFormat = rendering.depthAttachmentFormat;

    const bool has_mesh = hasStage(desc, ShaderStage::Mesh);
    VkGraphicsPipelineCreateInfo info = {VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO};
    info.pNext = &rendering;
    info.stageCount = static_cast<uint32_t>(stages.size());
    info.pStages = stages.data();
    info.pVertexInputState = has_mesh ? nullptr : &vertex_input;
    info.pInputAssemblyState = has_mesh ? nullptr : &assembly;
    info.pTessellationState = hasStage(desc, ShaderStage::Evaluate) ? &tessellation : nullptr;
    info.pViewportState = &viewport;
    info.pRasterizationState = &raster;
    info.pMultisampleState = &multisample;
    info.pDepthStencilState = &depth;
    info.pColorBlendState = &blending;
    info.pDynamicState = &dynamic;
    info.layout = (*layout)->handle;

    std::unique_ptr<VulkanPipeline> pipeline(new VulkanPipeline(device));
    pipeline->layout_ = *layout;
    const VkResult result =
        device.vk.CreateGraphicsPipelines(device.handle, VK_NULL_HANDLE, 1, &info, nullptr, &pipeline->handle_);
    if (result != VK_SUCCESS) return unexpected(resultError("vkCreateGraphicsPipelines", result).named(desc.name));
    device.memory.objects_created++;
    pipeline->setName(desc.name);
    return pipeline;
}

VulkanPipeline::~VulkanPipeline() { device_.vk.DestroyPipeline(device_.handle, handle_, nullptr); }

void VulkanPipeline::setName(const std::string& name) { device_.setName(VK_OBJECT_TYPE_PIPELINE, handle_, name); }

}  // namespace glint::vulkan
