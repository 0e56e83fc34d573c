#include <glint/base/format_error.h>
#include <glint/device/detail/device_object.h>
#include <glint/device/detail/table_object.h>
#include <glint/device/detail/texture_layout.h>
#include <glint/device/detail/window_object.h>
#include <glint/device/device.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace glint {

namespace {

using detail::DeviceObject;

/// What creating any object shares: the device must be open, the first check that fails becomes the object's error.
template <class ObjectType>
class Creation {
public:
    template <class... Args>
    Creation(const Device& device, std::string_view name, Device::Where where, Args&&... args)
        : device_(device ? static_cast<DeviceObject*>(device.object()) : nullptr),
          object_(new ObjectType(device_, std::forward<Args>(args)...)),
          where_(where) {
        object_->setName(name);
        if (!device_) object_->fail(device.error().at(where));
    }

    DeviceObject* device() const { return device_; }
    ObjectType* object() const { return object_; }
    bool failed() const { return object_->state() == ObjectState::Failed; }

    template <class... Args>
    void check(bool condition, ErrorCode code, const char* id, fmt::format_string<Args...> format, Args&&... args) {
        if (failed() || condition) return;
        object_->fail(
            makeError(where_, code, id, "{}: {}", object_->label(), fmt::format(format, std::forward<Args>(args)...)));
    }

    template <class NativeType>
    void finish(Expected<std::unique_ptr<NativeType>> made) {
        if (!made) {
            object_->fail(made.error().at(where_));
            return;
        }
        object_->native = std::move(*made);
        if (const std::string name = object_->name(); !name.empty()) object_->native->setName(name);
        object_->setReady();
    }

private:
    DeviceObject* device_;
    ObjectType* object_;
    Device::Where where_;
};

}  // namespace

Buffer Device::createBuffer(Buffer::Flags flags, uint64_t size, std::string_view name, Where where) {
    Creation<detail::BufferObject> creation(*this, name, where);
    detail::BufferObject& buffer = *creation.object();
    buffer.size = size;
    buffer.flags = flags;
    const uint64_t limit = getFeatures().maxBufferSize;
    creation.check(size > 0, ErrorCode::InvalidArgument, "buffer.size_zero", "the size is 0 bytes");
    creation.check(size <= limit, ErrorCode::OutOfRange, "buffer.too_large", "{} bytes exceed the limit of {}", size,
                   limit);
    creation.check(flags < (Buffer::FlagMapped << 1), ErrorCode::InvalidArgument, "buffer.flags", "unknown flags {:#x}",
                   flags);
    creation.check(!(flags & Buffer::FlagAddress) || getFeatures().bufferAddress, ErrorCode::Unsupported,
                   "buffer.feature", "Buffer::FlagAddress needs the feature {}, which {} lacks",
                   toString(FeatureBufferAddress), getInfo().name);
    const bool tracing = getFeatures().computeTracing || getFeatures().fragmentTracing || getFeatures().rayTracing;
    creation.check(!(flags & (Buffer::FlagTracing | Buffer::FlagScratch)) || tracing, ErrorCode::Unsupported,
                   "buffer.feature", "Buffer::FlagTracing and FlagScratch need ray tracing, which {} lacks",
                   getInfo().name);
    if (!creation.failed()) {
        detail::NativeBufferDesc desc;
        desc.size = size;
        desc.flags = flags;
        desc.name = name;
        creation.finish(creation.device()->backend->createBuffer(desc));
    }
    return Buffer(&buffer);
}

Buffer Device::createBuffer(Buffer::Flags flags, const void* data, uint64_t size, std::string_view name, Where where) {
    Buffer buffer = createBuffer(flags, size, name, where);
    if (buffer) setBuffer(buffer, 0, data, size, where);
    return buffer;
}

Texture Device::createTexture(const TextureDesc& given, std::string_view name, Where where) {
    Creation<detail::TextureObject> creation(*this, name, where);
    detail::TextureObject& texture = *creation.object();
    TextureDesc desc = given;
    const Features& features = getFeatures();
    const uint32_t limit = desc.type == Texture::Type2D   ? features.maxTexture2DSize
                           : desc.type == Texture::Type3D ? features.maxTexture3DSize
                                                          : features.maxTextureCubeSize;
    const uint32_t largest = std::max({desc.width, desc.height, desc.depth});
    creation.check(desc.width && desc.height && desc.depth && largest <= limit, ErrorCode::OutOfRange, "texture.size",
                   "{}x{}x{} texels; each is 1 to {}", desc.width, desc.height, desc.depth, limit);
    creation.check(desc.type == Texture::Type3D || desc.depth == 1, ErrorCode::InvalidArgument, "texture.size",
                   "a depth of {} texels belongs to a 3D texture", desc.depth);
    creation.check(desc.type != Texture::TypeCube || desc.width == desc.height, ErrorCode::InvalidArgument,
                   "texture.size", "{}x{} texels; the faces of a cube are square", desc.width, desc.height);
    creation.check(desc.layers && desc.layers <= features.maxTextureLayers / (desc.type == Texture::TypeCube ? 6 : 1),
                   ErrorCode::OutOfRange, "texture.layers", "{} layers; the limit is {}", desc.layers,
                   features.maxTextureLayers);
    creation.check(desc.type != Texture::Type3D || desc.layers == 1, ErrorCode::InvalidArgument, "texture.layers",
                   "{} layers; a 3D texture has one", desc.layers);
    creation.check(desc.type != Texture::TypeCube || desc.layers == 1 || features.has(FeatureCubeArray),
                   ErrorCode::Unsupported, "texture.feature", "{} cubes need the feature {}", desc.layers,
                   toString(FeatureCubeArray));
    if (desc.type == Texture::TypeCube) desc.layers *= 6;
    const uint32_t chain = static_cast<uint32_t>(std::bit_width(std::max(largest, 1u)));
    if (desc.flags & Texture::FlagMipmaps) desc.mipmaps = chain;
    creation.check(desc.mipmaps >= 1 && desc.mipmaps <= chain, ErrorCode::OutOfRange, "texture.mipmaps",
                   "{} mip levels; {}x{}x{} texels have 1 to {}", desc.mipmaps, desc.width, desc.height, desc.depth,
                   chain);

    const Texture::Flags multisample =
        desc.flags & (Texture::FlagMultisample2 | Texture::FlagMultisample4 | Texture::FlagMultisample8);
    const uint32_t samples = multisample == Texture::FlagMultisample2   ? 2u
                             : multisample == Texture::FlagMultisample4 ? 4u
                             : multisample == Texture::FlagMultisample8 ? 8u
                                                                        : 1u;
    creation.check(std::popcount(multisample) <= 1 && samples <= features.maxTextureSamples, ErrorCode::OutOfRange,
                   "texture.samples", "{} samples a pixel; the limit is {}, one flag at most", samples,
                   features.maxTextureSamples);
    creation.check(samples == 1 ||
                       (desc.type == Texture::Type2D && desc.mipmaps == 1 && !(desc.flags & Texture::FlagSurface)),
                   ErrorCode::InvalidArgument, "texture.samples",
                   "a multisampled texture is 2D with one mip level and is no surface");
    creation.check(hasTexture(desc.format, desc.flags, desc.type), ErrorCode::Unsupported, "texture.format",
                   "{} cannot use format {} this way (flags {:#x})", getInfo().name,
                   desc.format < FormatCount ? toString(desc.format) : "?", desc.flags);
    texture.desc = desc;
    texture.samples = samples;
    if (!creation.failed()) {
        texture.uses.resize(static_cast<size_t>(desc.mipmaps) * desc.layers);
        detail::NativeTextureDesc native;
        native.desc = desc;
        native.samples = samples;
        native.name = name;
        creation.finish(creation.device()->backend->createTexture(native));
    }
    return Texture(&texture);
}

Texture Device::createTexture2D(Format format, uint32_t width, uint32_t height, Texture::Flags flags,
                                std::string_view name, Where where) {
    return createTexture({.type = Texture::Type2D, .format = format, .width = width, .height = height, .flags = flags},
                         name, where);
}

Texture Device::createTexture3D(Format format, uint32_t width, uint32_t height, uint32_t depth, Texture::Flags flags,
                                std::string_view name, Where where) {
    return createTexture(
        {.type = Texture::Type3D, .format = format, .width = width, .height = height, .depth = depth, .flags = flags},
        name, where);
}

Texture Device::createTextureCube(Format format, uint32_t size, Texture::Flags flags, std::string_view name,
                                  Where where) {
    return createTexture({.type = Texture::TypeCube, .format = format, .width = size, .height = size, .flags = flags},
                         name, where);
}

Sampler Device::createSampler(const SamplerDesc& desc, std::string_view name, Where where) {
    Creation<detail::SamplerObject> creation(*this, name, where);
    const Features& features = getFeatures();
    creation.check(desc.anisotropy >= 1 && desc.anisotropy <= features.maxAnisotropy, ErrorCode::OutOfRange,
                   "sampler.anisotropy", "anisotropy {}; it is 1 to {}", desc.anisotropy, features.maxAnisotropy);
    creation.check(desc.anisotropy == 1 || features.has(FeatureAnisotropy), ErrorCode::Unsupported,
                   "sampler.anisotropy", "anisotropy {} needs the feature {}", desc.anisotropy,
                   toString(FeatureAnisotropy));
    creation.check(desc.lod_minimum >= 0 && desc.lod_minimum <= desc.lod_maximum && std::isfinite(desc.lod_bias) &&
                       std::abs(desc.lod_bias) <= 16,
                   ErrorCode::OutOfRange, "sampler.lod",
                   "levels {} to {} with bias {}; 0 <= minimum <= maximum, |bias| <= 16", desc.lod_minimum,
                   desc.lod_maximum, desc.lod_bias);
    creation.check(desc.reduction == Sampler::ReductionAverage || features.has(FeatureSamplerReduction),
                   ErrorCode::Unsupported, "sampler.reduction", "minimum and maximum filters need the feature {}",
                   toString(FeatureSamplerReduction));
    const Color& border = desc.border;
    const bool black = border.r == 0 && border.g == 0 && border.b == 0 && (border.a == 0 || border.a == 1);
    const bool white = border.r == 1 && border.g == 1 && border.b == 1 && border.a == 1;
    creation.check(black || white, ErrorCode::InvalidArgument, "sampler.border",
                   "border ({}, {}, {}, {}); it is transparent black, opaque black or opaque white", border.r, border.g,
                   border.b, border.a);
    if (!creation.failed()) creation.finish(creation.device()->backend->createSampler(desc));
    return Sampler(creation.object());
}

Sampler Device::createSampler(Sampler::Filter filter, Sampler::WrapMode wrap, Where where) {
    return createSampler(SamplerDesc{.filter = filter, .wrap = wrap}, {}, where);
}

namespace {

detail::Object* createTable(const Device& device, SlotKind element, uint32_t count, std::string_view name,
                            Device::Where where) {
    Creation<detail::TableObject> creation(device, name, where, element);
    detail::TableObject& table = *creation.object();
    const Features& features = device.getFeatures();
    const bool is_texture = element == SlotKind::Texture;
    const Feature feature = is_texture ? FeatureTextureTable : FeatureBufferTable;
    const uint32_t limit = is_texture ? features.maxTableTextures : features.maxTableBuffers;
    creation.check(features.has(feature), ErrorCode::Unsupported, "table.feature",
                   "it needs the feature {}, which {} lacks", toString(feature), device.getInfo().name);
    creation.check(count >= 1 && count <= limit, ErrorCode::OutOfRange, "table.count", "{} entries of 1 to {}", count,
                   limit);
    if (creation.failed()) return &table;
    auto contents = detail::TableObject::makeContents(*creation.device(), element, count, std::string(name));
    if (!contents) {
        table.fail(contents.error().at(where));
    } else {
        table.contents = std::move(*contents);
        table.setReady();
    }
    return &table;
}

}  // namespace

TextureTable Device::createTextureTable(uint32_t count, std::string_view name, Where where) {
    return TextureTable(createTable(*this, SlotKind::Texture, count, name, where));
}

BufferTable Device::createBufferTable(uint32_t count, std::string_view name, Where where) {
    return BufferTable(createTable(*this, SlotKind::Storage, count, name, where));
}

Query Device::createQuery(Query::Type type, std::string_view name, Where where) {
    Creation<detail::QueryObject> creation(*this, name, where, type);
    const Feature feature = type == Query::TypeTime ? FeatureTimestamps : FeatureStatistics;
    creation.check(type == Query::TypeSamples || getFeatures().has(feature), ErrorCode::Unsupported, "query.feature",
                   "it needs the feature {}, which {} lacks", toString(feature), getInfo().name);
    if (!creation.failed()) creation.finish(creation.device()->backend->createQuery(type));
    return Query(creation.object());
}

Window Device::createWindow(const WindowDesc& desc, Where where) {
    Creation<detail::WindowObject> creation(*this, desc.title, where, desc);
    const uint32_t limit = getFeatures().maxTexture2DSize;
    creation.check(getFeatures().has(FeaturePresent), ErrorCode::Unsupported, "window.unsupported",
                   "it needs the feature {}, which {} was opened without", toString(FeaturePresent), getInfo().name);
    creation.check(desc.width && desc.height && std::max(desc.width, desc.height) <= limit, ErrorCode::OutOfRange,
                   "window.size", "{}x{} pixels; each is 1 to {}", desc.width, desc.height, limit);
    creation.check(desc.depth == FormatUnknown || (desc.depth < FormatCount && formatInfo(desc.depth).depth),
                   ErrorCode::InvalidArgument, "window.format", "format {} is no depth format",
                   desc.depth < FormatCount ? toString(desc.depth) : "?");
    creation.check(desc.depth == FormatUnknown || hasTexture(desc.depth, Texture::FlagTarget), ErrorCode::Unsupported,
                   "window.format", "{} cannot draw to depth format {}", getInfo().name,
                   desc.depth < FormatCount ? toString(desc.depth) : "?");
    if (!creation.failed()) {
        creation.finish(creation.device()->backend->createWindow(desc));
        if (!creation.failed()) creation.object()->open(where);
    }
    return Window(creation.object());
}

}  // namespace glint
