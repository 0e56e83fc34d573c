#pragma once

#include <platform/null/null_objects.h>

#include <glint/device/detail/command_list.h>
#include <glint/device/detail/object.h>

#include <string>
#include <vector>

namespace glint::null {

/// Does what the commands of a list do to memory and to queries, and counts them. Used under the device's submit lock.
/// A command that reaches beyond its memory is left out: "null.range".
class NullPlayer {
public:
    explicit NullPlayer(NullControl& control) : control_(control) {}

    void play(const detail::CommandList& list);
    /// What was played since the last call.
    NullCounters takeCounters();

private:
    void play(const detail::CommandHeader& header);
    void play(const detail::CopyInlineCommand& command);
    void play(const detail::CopyBufferCommand& command);
    void play(const detail::FillBufferCommand& command);
    void play(const detail::CopyBufferTextureCommand& command);
    void play(const detail::CopyTextureCommand& command);
    void play(const detail::ClearTextureCommand& command);
    void play(const detail::BuildTracingsCommand& command);
    void play(const detail::CopyTracingCommand& command);
    void play(const detail::WriteTracingSizeCommand& command);
    void beginTarget(const detail::BeginTargetCommand& command);
    void endTarget();
    void query(const detail::QueryCommand& command);
    void countDispatch(uint64_t groups);
    void drawIndirect(const detail::DrawIndirectCommand& command);
    void countDraw(uint64_t vertices, uint64_t instances);

    /// `size` bytes at `offset`, or nullptr after a complaint.
    std::byte* bytes(uint32_t resource, uint64_t offset, uint64_t size);
    /// True if the region lies in the slice's mip level and the slice in the texture; else complains.
    bool inRange(uint32_t resource, const Slice& slice, const Region& region);
    void complain(uint32_t resource, const std::string& what);
    template <class T>
    T& native(uint32_t resource) {
        return static_cast<T&>(*list_->resources[resource]->native);
    }

    NullControl& control_;
    NullCounters counters_;
    std::array<uint64_t, 7> statistics_ = {};  // of the device's life, in the order of Query::Statistics
    uint64_t nanoseconds_ = 0;                 // a microsecond a command
    const detail::CommandList* list_ = nullptr;
    const detail::BeginTargetCommand* target_ = nullptr;
    uint32_t command_ = 0;
};

}  // namespace glint::null
