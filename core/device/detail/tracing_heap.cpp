#include <glint/device/detail/tracing_heap.h>

#include <glint/base/format_error.h>
#include <glint/device/detail/device_object.h>
#include <glint/device/detail/recorder_core.h>
#include <glint/device/shader.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <string_view>
#include <utility>

namespace glint::detail {

namespace {

constexpr uint64_t texel_size = 16;
constexpr uint64_t smallest = (1ull << 20) / texel_size;

HeapForm chooseForm(const DeviceObject& device) {
    if (const char* asked = std::getenv("GLINT_TRACING_MEMORY"))
        for (HeapForm form : {HeapForm::Texels, HeapForm::Storage, HeapForm::Address})
            if (std::string_view(asked) == toString(form) &&
                (form != HeapForm::Address || device.features().bufferAddress))
                return form;
    // Measured in docs/tracing.md: texel buffers are the cheapest on lavapipe, addresses a little ahead on GPUs.
    constexpr uint64_t enough = (1ull << 30) / texel_size;
    const bool has_texels = device.features().maxTexels >= enough;
    if (device.features().bufferAddress && !(device.info().cpu && has_texels)) return HeapForm::Address;
    return has_texels ? HeapForm::Texels : HeapForm::Storage;
}

NodeForm chooseNodes(const DeviceObject& device) {
    const char* const asked = std::getenv("GLINT_TRACING_NODES");
    if (asked && std::string_view(asked) == "packed") return NodeForm::Packed;
    if (asked && std::string_view(asked) == "full") return NodeForm::Full;
    return nodeFormOf(device.info().cpu);
}

}  // namespace

const char* toString(HeapForm form) {
    static constexpr const char* names[] = {"texels", "storage", "address"};
    return names[static_cast<size_t>(form)];
}

TracingHeap::Range& TracingHeap::Range::operator=(Range&& other) noexcept {
    if (this == &other) return *this;
    release();
    first = std::exchange(other.first, 0);
    texels = std::exchange(other.texels, 0);
    heap_ = std::move(other.heap_);
    return *this;
}

void TracingHeap::Range::release() {
    if (heap_) heap_->giveBack(first, texels);
    heap_.reset();
    first = 0;
    texels = 0;
}

TracingHeap::TracingHeap(DeviceObject& device)
    : device_(device), form_(chooseForm(device)), nodes_(chooseNodes(device)) {
    const Features& features = device.features();
    uint64_t bytes = features.maxBufferSize;
    if (form_ == HeapForm::Texels) bytes = std::min(bytes, features.maxTexels * texel_size);
    if (form_ == HeapForm::Storage) {
        // Which of them it is, is a branch at every read: with eight, lavapipe takes minutes to compile a shader.
        constexpr uint64_t most = 2;
        buffers_ = static_cast<uint32_t>(std::clamp<uint64_t>(bytes / heap_buffer_size, 1, most));
        bytes = std::min({bytes, buffers_ * heap_buffer_size, buffers_ * features.maxStorageSize});
    }
    limit_ = std::min<uint64_t>(bytes / texel_size, UINT32_MAX) / alignment * alignment;

    rewrite_.library = "glint/tracing/query.h";
    rewrite_.macros = fmt::format("GLINT_TRACING_MEMORY={}; GLINT_TRACING_BUFFERS={}; GLINT_TRACING_NODES={}",
                                  static_cast<int>(form_), buffers_, static_cast<int>(nodes_));
    rewrite_.set = std::min(features.maxSets, 8u) - 1;

    texels_ = Ref<BufferObject>::adopt(new BufferObject(&device));
    texels_->setName("hierarchies");
}

Expected<TracingHeap::Range> TracingHeap::allocate(uint64_t texels, Where where) {
    texels = (texels + alignment - 1) / alignment * alignment;
    Range range;
    while (!take(texels, range))
        if (Status status = grow(texels, where); !status) return unexpected(status.error());
    range.heap_ = shared_from_this();
    return range;
}

Expected<KernelObject*> TracingHeap::kernel(BuildKernel which) {
    std::lock_guard lock(kernel_mutex_);
    Ref<KernelObject>& known = kernels_[static_cast<size_t>(which)];
    if (known) return known.get();
    const std::string name = fmt::format("hierarchy builder {}", static_cast<int>(which));
    const Shader shader = Shader::createGLSL(Shader::TypeCompute, kernelSource(which), rewrite_.macros, name);
    if (!shader) return unexpected(shader.error());
    auto made = Ref<KernelObject>::adopt(new KernelObject(&device_));
    made->setName(name);
    made->shaders.emplace_back(static_cast<ShaderObject*>(shader.object()));
    if (Status status = made->create(Where::current()); !status) return unexpected(status.error());
    known = std::move(made);
    return known.get();
}

bool TracingHeap::writeDirectly(const Range& range, const void* texels, uint64_t size) {
    std::lock_guard growing(growth_);
    void* const mapped = texels_->nativeBuffer()->mapped;
    if (mapped) std::memcpy(static_cast<std::byte*>(mapped) + range.first * texel_size, texels, size);
    return mapped != nullptr;
}

bool TracingHeap::take(uint64_t texels, Range& range) {
    std::lock_guard lock(mutex_);
    const auto found = std::ranges::find_if(free_, [&](const auto& entry) { return entry.second >= texels; });
    if (found == free_.end()) return false;
    const auto [first, length] = *found;
    free_.erase(found);
    if (length > texels) free_.emplace(first + texels, length - texels);
    range.first = static_cast<uint32_t>(first);
    range.texels = texels;
    return true;
}

void TracingHeap::giveBack(uint32_t first, uint64_t texels) {
    std::lock_guard lock(mutex_);
    auto next = free_.lower_bound(first);
    uint64_t begin = first;
    if (next != free_.begin()) {
        const auto before = std::prev(next);
        if (before->first + before->second == begin) {
            begin = before->first;
            texels += before->second;
            free_.erase(before);
        }
    }
    if (next != free_.end() && begin + texels == next->first) {
        texels += next->second;
        free_.erase(next);
    }
    free_.emplace(begin, texels);
}

Status TracingHeap::grow(uint64_t texels, Where where) {
    std::lock_guard growing(growth_);
    uint64_t old = 0;
    uint64_t least = 0;
    {
        std::lock_guard lock(mutex_);
        old = capacity_;
        if (std::ranges::any_of(free_, [&](const auto& entry) { return entry.second >= texels; })) return {};
        // The last free range becomes part of the new one.
        const bool at_end = !free_.empty() && free_.rbegin()->first + free_.rbegin()->second == old;
        least = (at_end ? free_.rbegin()->first : old) + texels;
    }
    if (least > limit_)
        return makeError(where, ErrorCode::OutOfMemory, "tracing.heap",
                         "the structures of {} would take {} bytes together, the limit is {}", device_.info().name,
                         least * texel_size, limit_ * texel_size);

    NativeBufferDesc desc;
    desc.flags = Buffer::FlagStorage | Buffer::FlagTexel;
    if (form_ == HeapForm::Address) desc.flags |= Buffer::FlagAddress;
    desc.name = "hierarchies";
    uint64_t size = std::min(std::max({least, old + old / 2, smallest}) / alignment * alignment, limit_);
    size = std::max(size, least);
    desc.size = size * texel_size;
    Expected<std::unique_ptr<NativeBuffer>> made = device_.backend->createBuffer(desc);
    if (!made && size > least) {
        size = least;
        desc.size = size * texel_size;
        made = device_.backend->createBuffer(desc);
    }
    if (!made) return made.error().at(where);

    if (old > 0) {
        auto next = Ref<BufferObject>::adopt(new BufferObject(&device_));
        next->native = std::move(*made);
        next->size = desc.size;
        next->setReady();
        std::array<uint64_t, queue_count> known = {};
        do {
            known = device_.lastUse(*texels_);
            Status copied = device_.playNow("growth of the heap", where, [&](RecorderCore& core) {
                core.copyBuffer(*next, 0, *texels_, 0, old * texel_size);
            });
            if (!copied) return copied;
            constexpr auto main = static_cast<size_t>(Queue::Main);
            known[main] = device_.lastUse(*next)[main];
            // Another thread may have built something meanwhile, which the copy lacks.
        } while (!device_.replaceUnused(*texels_, next->native, known));
    } else {
        texels_->native = std::move(*made);
        texels_->flags = desc.flags;
        texels_->setReady();
    }
    texels_->size = desc.size;
    {
        std::lock_guard lock(mutex_);
        capacity_ = size;
    }
    giveBack(static_cast<uint32_t>(old), size - old);
    return {};
}

}  // namespace glint::detail
