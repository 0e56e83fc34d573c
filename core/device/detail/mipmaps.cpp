#include <glint/device/detail/mipmaps.h>

#include <glint/base/format_error.h>
#include <glint/device/detail/device_object.h>
#include <glint/device/detail/texture_layout.h>
#include <glint/device/shader.h>

#include <algorithm>
#include <string>

namespace glint::detail {

namespace {

/// GLINT_KIND of shaders/textures/mipmap.h.
enum class Kind { Unorm, Snorm, Srgb, Bgra, SBgra, Half, Float, Rgb10A2, Rg11B10, Rgb9E5 };

Kind kindOf(Format format) {
    switch (format) {
        case FormatRi8n:
        case FormatRi16n:
        case FormatRGi8n:
        case FormatRGi16n:
        case FormatRGBAi8n:
        case FormatRGBAi16n: return Kind::Snorm;
        case FormatRGBAu8ns: return Kind::Srgb;
        case FormatBGRAu8n: return Kind::Bgra;
        case FormatBGRAu8ns: return Kind::SBgra;
        case FormatRf16:
        case FormatRGf16:
        case FormatRGBAf16: return Kind::Half;
        case FormatRf32:
        case FormatRGf32:
        case FormatRGBf32:
        case FormatRGBAf32: return Kind::Float;
        case FormatRGBu10Au2n: return Kind::Rgb10A2;
        case FormatRGBf11f11f10: return Kind::Rg11B10;
        case FormatRGBEu9e5: return Kind::Rgb9E5;
        default: return Kind::Unorm;
    }
}

/// Of a channel; formats whose channels differ fill a word.
uint32_t bitsOf(Format format) {
    const FormatInfo& info = formatInfo(format);
    return kindOf(format) >= Kind::Rgb10A2 ? 32u : info.block_size * 8u / info.components;
}

bool isPacked(Format format) { return formatInfo(format).block_size < 4; }

Region slicesOf(const TextureDesc& desc, uint32_t level) {
    Region all = mipRegion(desc, level);
    if (desc.type != Texture::Type3D) all.depth = desc.layers;
    return all;
}

/// No size below is odd, but for 1.
bool isEven(const TextureDesc& desc, uint32_t level) {
    const Region below = mipRegion(desc, level - 1);
    const auto even = [](uint32_t size) { return size == 1 || size % 2 == 0; };
    return even(below.width) && even(below.height) && even(below.depth);
}

class Planner {
public:
    Planner(const TextureDesc& desc, uint64_t alignment, uint64_t budget)
        : desc_(desc), alignment_(alignment), budget_(budget) {}

    MipmapPlan plan() {
        const bool is_volume = desc_.type == Texture::Type3D;
        const uint32_t first = firstKept(desc_.layers);
        const uint32_t each = is_volume || first <= 1 ? first : firstKept(1);
        for (uint32_t level = 1; level < each; level++) band(level);
        const uint32_t layers = is_volume || each == first ? desc_.layers : 1;
        for (uint32_t layer = 0; layer < desc_.layers && each < desc_.mipmaps; layer += layers) {
            uint64_t place = 0;
            for (uint32_t level = each; level < desc_.mipmaps; level++) {
                MipmapPass pass = whole(level);
                if (!is_volume) pass.first_slice = layer, pass.slices = layers;
                pass.from_kept = level > each;
                pass.keeps = level + 1 < desc_.mipmaps;
                put(pass, place);
            }
        }
        return std::move(plan_);
    }

private:
    MipmapPass whole(uint32_t level) const {
        const Region all = slicesOf(desc_, level);
        MipmapPass pass;
        pass.level = level;
        pass.slices = all.depth;
        pass.rows = all.height;
        return pass;
    }

    uint64_t align(uint64_t size) const { return (size + alignment_ - 1) / alignment_ * alignment_; }

    uint64_t keptBytes(const MipmapPass& pass) const {
        return uint64_t(mipSize(desc_.width, pass.level)) * pass.rows * pass.slices * keptSize(desc_.format);
    }

    void put(MipmapPass& pass, uint64_t& place) {
        pass.stored = place;
        place += align(storedSize(desc_, pass));
        pass.kept = place;
        if (pass.keeps) place += align(keptBytes(pass));
        plan_.scratch = std::max(plan_.scratch, place);
        plan_.passes.push_back(pass);
    }

    /// The first level that fits into the budget with all that follow it, of this many layers.
    uint32_t firstKept(uint32_t layers) const {
        uint64_t bytes = 0;
        uint32_t level = desc_.mipmaps;
        for (; level > 1; level--) {
            MipmapPass pass = whole(level - 1);
            if (desc_.type != Texture::Type3D) pass.slices = layers;
            bytes += align(storedSize(desc_, pass)) + (level < desc_.mipmaps ? align(keptBytes(pass)) : 0);
            if (bytes > budget_) break;
        }
        return level;
    }

    /// A level from what is stored, in bands that fit.
    void band(uint32_t level) {
        const MipmapPass all = whole(level);
        const uint64_t row = uint64_t(mipSize(desc_.width, level)) * formatInfo(desc_.format).block_size;
        const auto most = static_cast<uint32_t>(std::clamp<uint64_t>(budget_ / row, 1, all.rows));
        for (uint32_t slice = 0; slice < all.slices; slice++) {
            for (uint32_t first = 0; first < all.rows; first += most) {
                MipmapPass pass = all;
                pass.first_slice = slice;
                pass.slices = 1;
                pass.first_row = first;
                pass.rows = std::min(most, all.rows - first);
                uint64_t place = 0;
                put(pass, place);
            }
        }
    }

    const TextureDesc& desc_;
    const uint64_t alignment_;
    const uint64_t budget_;
    MipmapPlan plan_;
};

}  // namespace

uint32_t keptSize(Format format) {
    const uint32_t channels = formatInfo(format).components;
    return channels > 2 ? 16 : channels * 4;
}

uint64_t storedSize(const TextureDesc& desc, const MipmapPass& pass) {
    const uint64_t texels = uint64_t(mipSize(desc.width, pass.level)) * pass.rows * pass.slices;
    return (texels * formatInfo(desc.format).block_size + 3) / 4 * 4;
}

MipmapPlan planMipmaps(const TextureDesc& desc, uint64_t alignment, uint64_t budget) {
    // Texels of 12 bytes are copied from multiples of their size.
    if (formatInfo(desc.format).block_size == 12) alignment *= 3;
    return Planner(desc, alignment, budget).plan();
}

MipmapConstants mipmapConstants(const TextureDesc& desc, const MipmapPass& pass) {
    const Region below = mipRegion(desc, pass.level - 1), size = mipRegion(desc, pass.level);
    return {{below.width, below.height, below.depth},
            pass.first_row,
            {size.width, size.height, size.depth},
            pass.first_slice,
            pass.rows,
            pass.slices,
            pass.keeps ? 1u : 0u};
}

bool MipmapKernels::canFilter(Format format) {
    const FormatInfo& info = formatInfo(format);
    return info.type == FormatType::Float && !info.compressed;
}

Expected<KernelObject*> MipmapKernels::kernel(const TextureDesc& desc, const MipmapPass& pass,
                                              std::source_location where) {
    const bool is_volume = desc.type == Texture::Type3D;
    const bool is_even = isEven(desc, pass.level);
    const uint32_t key = desc.format << 3 | is_volume << 2 | is_even << 1 | uint32_t(pass.from_kept);
    std::lock_guard lock(mutex_);
    Ref<KernelObject>& known = kernels_[key];
    if (known) return known.get();
    const FormatInfo& info = formatInfo(desc.format);
    const std::string macros = fmt::format(
        "GLINT_KIND={}; GLINT_CHANNELS={}; GLINT_BITS={}; GLINT_VOLUME={:d}; GLINT_EVEN={:d}; GLINT_FLOATS={:d}",
        static_cast<int>(kindOf(desc.format)), info.components, bitsOf(desc.format), is_volume, is_even,
        pass.from_kept);
    const std::string name = fmt::format("mip levels of {}", info.name);
    const Shader shader = Shader::createGLSL(Shader::TypeCompute, "#include <glint/textures/mipmap.h>\n", macros, name);
    if (!shader) return unexpected(shader.error());
    auto made = Ref<KernelObject>::adopt(new KernelObject(&device_));
    made->setName(name);
    made->shaders.emplace_back(static_cast<ShaderObject*>(shader.object()));
    if (Status status = made->create(where); !status) return unexpected(status.error());
    known = std::move(made);
    return known.get();
}

void MipmapKernels::countGroups(const TextureDesc& desc, const MipmapPass& pass, uint32_t (&groups)[3]) {
    const auto divide = [](uint64_t count, uint32_t size) { return static_cast<uint32_t>((count + size - 1) / size); };
    const uint32_t width = mipSize(desc.width, pass.level);
    if (!isPacked(desc.format)) {
        groups[0] = divide(width, 16);
        groups[1] = divide(pass.rows, 4);
        groups[2] = pass.slices;
        return;
    }
    // A thread a word, in a square of groups: no side is as large as the limit of any device, 65,535.
    constexpr uint32_t most = 4096;
    const uint32_t count = divide(storedSize(desc, pass) / 4, 64);
    groups[0] = std::min(count, most);
    groups[1] = divide(count, most);
    groups[2] = 1;
}

}  // namespace glint::detail
