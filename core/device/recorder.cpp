#include <glint/device/recorder.h>

#include <glint/device/detail/recorder_core.h>

namespace glint {

using detail::CommandType;

Recorder::Recorder(detail::RecorderPtr core) : core_(std::move(core)) {}
Recorder::Recorder(Recorder&& other) noexcept = default;
Recorder& Recorder::operator=(Recorder&& other) noexcept = default;
Recorder::~Recorder() = default;

Error Recorder::error() const {
    if (core_) return core_->error();
    return Error::inFile(ErrorCode::InvalidArgument, "recorder.null", "the recorder was moved from or has no device",
                         {}, 0);
}

void Recorder::fail(const Error& error) {
    if (core_ && error) core_->fail(error);
}

Status Recorder::end() { return core_ ? core_->end(Where::current()) : Status(error()); }

void Recorder::setUniformData(Slot slot, const void* data, uint64_t size) {
    if (core_) core_->setUniformData(slot, data, size);
}

void Recorder::setUniformBuffer(Slot slot, const Buffer& buffer, uint64_t offset, uint64_t size) {
    if (core_) core_->setBuffer(SlotKind::Uniform, slot, 0, buffer, offset, size);
}

void Recorder::setStorageBuffer(Slot slot, const Buffer& buffer, uint64_t offset, uint64_t size) {
    if (core_) core_->setBuffer(SlotKind::Storage, slot, 0, buffer, offset, size);
}

void Recorder::setStorageBuffers(Slot slot, std::initializer_list<Buffer> buffers) {
    uint32_t step = 0;
    for (const Buffer& buffer : buffers)
        if (core_) core_->setBuffer(SlotKind::Storage, slot, step++, buffer, 0, 0);
}

void Recorder::setTexture(Slot slot, const Texture& texture, const Slice& slice) {
    if (core_) core_->setTexture(SlotKind::Texture, slot, 0, texture, slice);
}

void Recorder::setTextures(Slot slot, std::initializer_list<Texture> textures) {
    uint32_t step = 0;
    for (const Texture& texture : textures)
        if (core_) core_->setTexture(SlotKind::Texture, slot, step++, texture, {});
}

void Recorder::setSurfaceTexture(Slot slot, const Texture& texture, const Slice& slice) {
    if (core_) core_->setTexture(SlotKind::Surface, slot, 0, texture, slice);
}

void Recorder::setSurfaceTextures(Slot slot, std::initializer_list<Texture> textures) {
    uint32_t step = 0;
    for (const Texture& texture : textures)
        if (core_) core_->setTexture(SlotKind::Surface, slot, step++, texture, {});
}

void Recorder::setSampler(Slot slot, const Sampler& sampler) {
    if (core_) core_->setSampler(slot, 0, sampler);
}

void Recorder::setSamplers(Slot slot, std::initializer_list<Sampler> samplers) {
    uint32_t step = 0;
    for (const Sampler& sampler : samplers)
        if (core_) core_->setSampler(slot, step++, sampler);
}

void Recorder::setTracing(Slot slot, const Tracing& tracing) {
    if (core_) core_->setTracing(slot, tracing);
}

void Recorder::setTextureTable(Slot slot, const TextureTable& table) {
    if (core_) core_->setTable(slot, table);
}

void Recorder::setBufferTable(Slot slot, const BufferTable& table) {
    if (core_) core_->setTable(slot, table);
}

void Recorder::setTexelBuffer(Slot slot, const Buffer& buffer, Format format, uint64_t offset, uint64_t size) {
    if (core_) core_->setBuffer(SlotKind::Texel, slot, 0, buffer, offset, size, format);
}

void Recorder::setPushData(const void* data, uint64_t size, Where where) {
    if (core_) core_->setPushData(data, size, where);
}

void Recorder::useBuffer(const Buffer& buffer, bool write, Where where) {
    if (core_) core_->useBuffer(buffer, write, where);
}

void Recorder::clearUses() {
    if (core_) core_->clearUses();
}

void Recorder::setTracking(bool enabled) {
    if (core_) core_->setTracking(enabled);
}

void Recorder::barrier(Where where) {
    if (core_) core_->barrier(where);
}

void Recorder::barrier(const Buffer& buffer, Where where) { barrier({buffer}, where); }
void Recorder::barrier(const Texture& texture, Where where) { barrier({texture}, where); }

void Recorder::barrier(std::initializer_list<Buffer> buffers, Where where) {
    if (!core_) return;
    for (const Buffer& buffer : buffers) core_->check(buffer, "barrier", where);
    core_->barrier(where);
}

void Recorder::barrier(std::initializer_list<Texture> textures, Where where) {
    if (!core_) return;
    for (const Texture& texture : textures) core_->check(texture, "barrier", where);
    core_->barrier(where);
}

void Recorder::beginQuery(const Query& query, Where where) {
    if (core_) core_->query(CommandType::BeginQuery, query, where);
}

void Recorder::endQuery(const Query& query, Where where) {
    if (core_) core_->query(CommandType::EndQuery, query, where);
}

void Recorder::pushRegion(std::string_view name, Where where) {
    if (core_) core_->pushRegion(name, where);
}

void Recorder::popRegion(Where where) {
    if (core_) core_->popRegion(where);
}

}  // namespace glint
