#include <platform/null/null_access.h>

#include <glint/base/format_error.h>
#include <glint/device/detail/table_object.h>

#include <algorithm>

namespace glint::null {

using namespace detail;

namespace {

constexpr ShaderMask ray_stages = stageBit(ShaderStage::RayGen) | stageBit(ShaderStage::RayMiss) |
                                  stageBit(ShaderStage::Closest) | stageBit(ShaderStage::FirstHit) |
                                  stageBit(ShaderStage::Intersection) | stageBit(ShaderStage::Callable);
constexpr ShaderMask early_stages = stageBit(ShaderStage::Vertex) | stageBit(ShaderStage::Control) |
                                    stageBit(ShaderStage::Evaluate) | stageBit(ShaderStage::Geometry) |
                                    stageBit(ShaderStage::Task) | stageBit(ShaderStage::Mesh);

class AccessCheck {
public:
    AccessCheck(const CommandList& list, NullControl& control) : list_(list), control_(control) {}

    void check(uint32_t index, const CommandHeader& header) {
        index_ = index;
        header_ = &header;
        shared_ = std::span(list_.accesses).subspan(header.first_shared, header.shared_count);
        switch (header.type) {
            case CommandType::Dispatch: {
                const auto& command = as<DispatchCommand>();
                bindings(command.bindings, native<NullKernel>(command.kernel).layout);
                break;
            }
            case CommandType::DispatchIndirect: {
                const auto& command = as<DispatchIndirectCommand>();
                bindings(command.bindings, native<NullKernel>(command.kernel).layout);
                need(command.buffer, Stage::Indirect, AccessRead);
                break;
            }
            case CommandType::SideDispatches: {
                const auto& command = as<SideDispatchesCommand>();
                for (uint32_t i = 0; i < command.count; i++) side(list_.at<SideDispatch>(command.dispatches)[i]);
                break;
            }
            case CommandType::TraceRays: {
                const auto& command = as<TraceRaysCommand>();
                bindings(command.bindings, native<NullTraversal>(command.traversal).layout);
                break;
            }
            case CommandType::TraceRaysIndirect: {
                const auto& command = as<TraceRaysIndirectCommand>();
                bindings(command.bindings, native<NullTraversal>(command.traversal).layout);
                need(command.buffer, Stage::Indirect, AccessRead);
                break;
            }
            case CommandType::BeginTarget: {
                const auto& command = as<BeginTargetCommand>();
                for (uint32_t i = 0; i < command.color_count; i++) attachment(command.colors[i], Stage::ColorTarget);
                attachment(command.depth, Stage::DepthTarget);
                break;
            }
            case CommandType::Draw:
            case CommandType::DrawIndexed: draw(as<DrawCommand>().state); break;
            case CommandType::DrawIndirect:
            case CommandType::DrawIndexedIndirect:
            case CommandType::DrawMeshIndirect: {
                const auto& command = as<DrawIndirectCommand>();
                draw(command.state);
                need(command.buffer, Stage::Indirect, AccessRead);
                need(command.count_buffer, Stage::Indirect, AccessRead);
                break;
            }
            case CommandType::DrawMesh: draw(as<DrawMeshCommand>().state); break;
            case CommandType::CopyInline: need(as<CopyInlineCommand>().buffer, Stage::Copy, AccessWrite); break;
            case CommandType::FillBuffer: need(as<FillBufferCommand>().buffer, Stage::Copy, AccessWrite); break;
            case CommandType::CopyBuffer: {
                const auto& command = as<CopyBufferCommand>();
                need(command.source, Stage::Copy, AccessRead);
                need(command.destination, Stage::Copy, AccessWrite);
                break;
            }
            case CommandType::CopyBufferToTexture:
            case CommandType::CopyTextureToBuffer: {
                const auto& command = as<CopyBufferTextureCommand>();
                const bool upload = header.type == CommandType::CopyBufferToTexture;
                need(command.buffer, Stage::Copy, upload ? AccessRead : AccessWrite);
                need(command.texture, Stage::Copy, upload ? AccessWrite : AccessRead, command.slice);
                break;
            }
            case CommandType::CopyTexture: {
                const auto& command = as<CopyTextureCommand>();
                need(command.source, Stage::Copy, AccessRead, command.source_slice);
                need(command.destination, Stage::Copy, AccessWrite, command.destination_slice);
                break;
            }
            case CommandType::ClearTexture: {
                const auto& command = as<ClearTextureCommand>();
                need(command.texture, Stage::Copy, AccessWrite, command.slice);
                break;
            }
            case CommandType::BuildTracings: {
                const auto& command = as<BuildTracingsCommand>();
                for (uint32_t i = 0; i < command.count; i++) build(list_.at<TracingBuild>(command.builds)[i]);
                break;
            }
            case CommandType::CopyTracing: {
                const auto& command = as<CopyTracingCommand>();
                need(command.source, Stage::Build, AccessRead);
                need(command.destination, Stage::Build, AccessWrite);
                break;
            }
            case CommandType::WriteTracingSize:
                need(as<WriteTracingSizeCommand>().tracing, Stage::Build, AccessRead);
                break;
            default: break;
        }
    }

private:
    template <class T>
    const T& as() const {
        return reinterpret_cast<const T&>(*header_);
    }
    template <class T>
    const T& native(uint32_t resource) const {
        return static_cast<const T&>(*list_.resources[resource]->native);
    }

    /// Its own accesses have to say all, and the command's have to hold them.
    void side(const SideDispatch& dispatch) {
        const uint32_t begin = std::max(dispatch.first_access, header_->first_shared);
        const uint32_t end =
            std::min(dispatch.first_access + dispatch.access_count, header_->first_shared + header_->shared_count);
        shared_ = std::span(list_.accesses).subspan(begin, end > begin ? end - begin : 0);
        bindings(dispatch.bindings, native<NullKernel>(dispatch.kernel).layout);
    }

    void draw(const DrawState& state) {
        bindings(state.bindings, native<NullPipeline>(state.pipeline).layout);
        for (uint32_t i = 0; i < state.vertex_count; i++)
            need(list_.at<VertexBinding>(state.vertices)[i].buffer, Stage::VertexInput, AccessRead);
        need(state.index_buffer, Stage::VertexInput, AccessRead);
    }

    void attachment(const Attachment& attachment, Stage stage) {
        need(attachment.texture, stage, AccessWrite, attachment.slice);
        if (attachment.load == LoadOperation::Load) need(attachment.texture, stage, AccessRead, attachment.slice);
        need(attachment.resolve, stage, AccessWrite, attachment.resolve_slice);
    }

    void build(const TracingBuild& build) {
        const auto& tracing = native<NullTracing>(build.tracing);
        need(build.tracing, Stage::Build, AccessWrite);
        if (build.update) need(build.tracing, Stage::Build, AccessRead);
        need(build.scratch, Stage::Build, AccessWrite);
        need(build.instances, Stage::Build, AccessRead);
        for (const Object* input : tracing.inputs) need(find(input), Stage::Build, AccessRead, input->label());
        references(tracing, Stage::Build);
    }

    void references(const NullTracing& tracing, Stage stage) {
        for (const uint64_t address : tracing.references) {
            const auto refers = [&](const Object* object) {
                return object->type() == ObjectType::Tracing &&
                       static_cast<const NullTracing&>(*object->native).address == address;
            };
            const auto found = std::ranges::find_if(list_.resources, refers);
            need(static_cast<uint32_t>(found - list_.resources.begin()), stage, AccessRead,
                 "a structure that instances refer to");
        }
    }

    void bindings(const Bindings& bindings, const BindingLayout& layout) {
        uint32_t element = 0;
        for (const auto* resources : {&layout.resources, &layout.hidden})
            for (const ShaderResource& resource : *resources)
                for (uint32_t i = 0; i < resource.descriptorCount(); i++, element++) {
                    if (element >= bindings.bound_count) return;
                    const BoundResource& bound = list_.at<BoundResource>(bindings.bound)[element];
                    if (bound.resource != none && resource.kind != SlotKind::Sampler) access(bound, resource);
                }
    }

    void access(const BoundResource& bound, const ShaderResource& resource) {
        if (resource.kind == SlotKind::Table) {
            const auto& table = static_cast<const TableContents&>(*list_.resources[bound.resource]);
            for (const TableContents::Entry& entry : table.entries)
                if (entry.object) accessOne({.resource = find(entry.object.get()), .slice = entry.slice}, resource);
        } else {
            accessOne(bound, resource);
        }
    }

    void accessOne(const BoundResource& bound, const ShaderResource& resource) {
        shaderAccess(bound, resource, ray_stages, Stage::RayTracing);
        shaderAccess(bound, resource, early_stages, Stage::VertexShader);
        shaderAccess(bound, resource, stageBit(ShaderStage::Fragment), Stage::Fragment);
        shaderAccess(bound, resource, stageBit(ShaderStage::Compute), Stage::Compute);
    }

    void shaderAccess(const BoundResource& bound, const ShaderResource& resource, ShaderMask mask, Stage stage) {
        if (!(resource.stages & mask)) return;
        const bool image = resource.element == SlotKind::Texture || resource.element == SlotKind::Surface;
        if (resource.read) need(bound.resource, stage, AccessRead, image ? bound.slice : Slice{}, resource.name);
        if (resource.write) need(bound.resource, stage, AccessWrite, image ? bound.slice : Slice{}, resource.name);
        if (resource.kind == SlotKind::Tracing) references(native<NullTracing>(bound.resource), stage);
    }

    uint32_t find(const Object* object) const {
        return static_cast<uint32_t>(std::ranges::find(list_.resources, object) - list_.resources.begin());
    }

    void need(uint32_t resource, Stage stage, uint8_t flags, const std::string& what) {
        need(resource, stage, flags, {}, what);
    }

    /// `resource` may be none, or the size of the list if it has no such resource.
    void need(uint32_t resource, Stage stage, uint8_t flags, const Slice& slice = {}, const std::string& what = {}) {
        if (resource == none) return;
        const auto declares = [&](const Access& access) {
            return access.resource == resource && access.stage == stage && (access.flags & flags) == flags &&
                   access.slice.mip <= slice.mip && access.slice.mip + access.slice.mips >= slice.mip + slice.mips &&
                   access.slice.layer <= slice.layer &&
                   access.slice.layer + access.slice.layers >= slice.layer + slice.layers;
        };
        const auto own = std::span(list_.accesses).subspan(header_->first_access, header_->access_count);
        if (std::ranges::any_of(own, declares) || std::ranges::any_of(shared_, declares)) return;
        std::string name = resource < list_.resources.size() ? list_.resources[resource]->label() : what;
        if (!what.empty() && name != what) name += " (" + what + ")";
        control_.report(makeError(ErrorCode::Internal, "null.undeclared",
                                  "{} {} of '{}' {} {} at {} without an access that says so", toString(header_->type),
                                  index_, list_.label, flags & AccessWrite ? "writes" : "reads", name,
                                  toString(stage)));
    }

    const CommandList& list_;
    NullControl& control_;
    const CommandHeader* header_ = nullptr;
    std::span<const Access> shared_;
    uint32_t index_ = 0;
};

}  // namespace

void checkAccesses(const CommandList& list, NullControl& control) {
    AccessCheck check(list, control);
    forEachCommand(list, [&](uint32_t index, const CommandHeader& header) { check.check(index, header); });
}

}  // namespace glint::null
