#include <glint/device/command.h>

#include <glint/device/detail/recorder_core.h>

namespace glint {

void Command::setPipeline(const Pipeline& pipeline, Where where) {
    if (core_) core_->setPipeline(pipeline, where);
}

void Command::setVertexBuffer(uint32_t index, const Buffer& buffer, uint64_t offset, Where where) {
    if (core_) core_->setVertexBuffer(index, buffer, offset, where);
}

void Command::setVertexData(uint32_t index, const void* data, uint64_t size, Where where) {
    if (core_) core_->setVertexData(index, data, size, where);
}

void Command::setIndexBuffer(Format format, const Buffer& buffer, uint64_t offset, Where where) {
    if (core_) core_->setIndexBuffer(format, buffer, offset, where);
}

void Command::setIndexData(Format format, const void* data, uint64_t size, Where where) {
    if (core_) core_->setIndexData(format, data, size, where);
}

void Command::setViewport(float x, float y, float width, float height, float minimum_depth, float maximum_depth) {
    if (core_) core_->setViewport({x, y, width, height, minimum_depth, maximum_depth});
}

void Command::setViewports(std::span<const Viewport> viewports, Where where) {
    if (core_) core_->setViewports(viewports, where);
}

void Command::setScissor(int32_t x, int32_t y, uint32_t width, uint32_t height) {
    if (core_) core_->setScissor({x, y, width, height});
}

void Command::setScissors(std::span<const Scissor> scissors, Where where) {
    if (core_) core_->setScissors(scissors, where);
}

void Command::setBlendFactor(const Color& color) {
    if (core_) core_->setBlendFactor(color);
}

void Command::setStencilRef(uint32_t reference) {
    if (core_) core_->setStencilRef(reference);
}

void Command::drawArrays(uint32_t vertices, uint32_t first, Where where) {
    if (core_) core_->draw(false, vertices, 1, first, 0, 0, where);
}

void Command::drawArraysInstanced(uint32_t vertices, uint32_t first, uint32_t instances, uint32_t first_instance,
                                  Where where) {
    if (core_) core_->draw(false, vertices, instances, first, 0, first_instance, where);
}

void Command::drawElements(uint32_t indices, uint32_t first, int32_t base_vertex, Where where) {
    if (core_) core_->draw(true, indices, 1, first, base_vertex, 0, where);
}

void Command::drawElementsInstanced(uint32_t indices, uint32_t first, int32_t base_vertex, uint32_t instances,
                                    uint32_t first_instance, Where where) {
    if (core_) core_->draw(true, indices, instances, first, base_vertex, first_instance, where);
}

void Command::drawArraysIndirect(const Buffer& buffer, uint64_t offset, uint32_t draws, uint32_t stride, Where where) {
    if (core_) core_->drawIndirect(detail::CommandType::DrawIndirect, {buffer, offset, draws, stride}, where);
}

void Command::drawElementsIndirect(const Buffer& buffer, uint64_t offset, uint32_t draws, uint32_t stride,
                                   Where where) {
    if (core_) core_->drawIndirect(detail::CommandType::DrawIndexedIndirect, {buffer, offset, draws, stride}, where);
}

void Command::drawArraysIndirect(const Buffer& buffer, uint64_t offset, const Buffer& count, uint64_t count_offset,
                                 uint32_t draws, uint32_t stride, Where where) {
    if (core_)
        core_->drawIndirect(detail::CommandType::DrawIndirect, {buffer, offset, draws, stride, &count, count_offset},
                            where);
}

void Command::drawElementsIndirect(const Buffer& buffer, uint64_t offset, const Buffer& count, uint64_t count_offset,
                                   uint32_t draws, uint32_t stride, Where where) {
    if (core_)
        core_->drawIndirect(detail::CommandType::DrawIndexedIndirect,
                            {buffer, offset, draws, stride, &count, count_offset}, where);
}

void Command::drawMesh(uint32_t x, uint32_t y, uint32_t z, Where where) {
    if (core_) core_->drawMesh(x, y, z, where);
}

void Command::drawMeshIndirect(const Buffer& buffer, uint64_t offset, uint32_t draws, uint32_t stride, Where where) {
    if (core_) core_->drawIndirect(detail::CommandType::DrawMeshIndirect, {buffer, offset, draws, stride}, where);
}

void Command::drawMeshIndirect(const Buffer& buffer, uint64_t offset, const Buffer& count, uint64_t count_offset,
                               uint32_t draws, uint32_t stride, Where where) {
    if (core_)
        core_->drawIndirect(detail::CommandType::DrawMeshIndirect,
                            {buffer, offset, draws, stride, &count, count_offset}, where);
}

}  // namespace glint
