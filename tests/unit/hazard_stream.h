#pragma once

// Command lists and barriers made by hand, for the tests of the hazard checker: no device, no tracker.

#include <platform/null/hazard_checker.h>

#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace glint::test {

using detail::AccessDiscard;
using detail::AccessRead;
using detail::AccessWrite;
using detail::CommandType;
using detail::Layout;
using detail::Stage;
using detail::StageMask;

/// Stands for an object. Textures have mip levels, everything else has none.
struct Thing {
    uint64_t id = 0;
    uint32_t mips = 0;
    uint32_t layers = 0;
    std::string name;

    detail::Object* object() { return reinterpret_cast<detail::Object*>(this); }
};

inline null::HazardChecker makeChecker() {
    const auto thing = [](const detail::Object* object) { return reinterpret_cast<const Thing*>(object); };
    return null::HazardChecker(
        [thing](const detail::Object* object) {
            return null::HazardResource{thing(object)->id, thing(object)->mips, thing(object)->layers};
        },
        [thing](const detail::Object* object) { return "'" + thing(object)->name + "'"; });
}

/// An access of a command.
struct Touch {
    Thing* thing;
    Stage stage;
    uint8_t flags;
    Layout layout = Layout::None;
    Slice slice = {0, 1, 0, 1};
};

inline Touch reads(Thing& thing, Stage stage) { return {&thing, stage, AccessRead}; }
inline Touch writes(Thing& thing, Stage stage) { return {&thing, stage, AccessWrite}; }
inline Touch changes(Thing& thing, Stage stage) { return {&thing, stage, AccessRead | AccessWrite}; }

/// One of several dispatches that run side by side, and the parts of buffers that are bound to it.
struct Side {
    struct Part {
        Thing* thing;
        uint64_t offset;
        uint64_t size;
    };
    std::vector<Touch> touches;
    std::vector<Part> parts = {};
};

/// A transition.
struct Turn {
    Thing* thing;
    Layout from;
    Layout to;
    StageMask source;
    StageMask destination;
    Slice slice = {0, 1, 0, 1};
};

template <class... Stages>
StageMask stages(Stages... all) {
    return static_cast<StageMask>((0 | ... | detail::bit(all)));
}

/// One list under construction with the barriers before its commands.
class List {
public:
    explicit List(std::string label = {}) { list_->label = std::move(label); }

    List& command(CommandType type, const std::vector<Touch>& touches, bool untracked = false) {
        detail::HostReadCommand command;  // nothing but a header
        return append(command, type, touches, untracked);
    }
    List& dispatch(const std::vector<Touch>& touches) { return command(CommandType::Dispatch, touches); }
    List& dispatches(const std::vector<Side>& sides) {
        std::vector<Touch> touches;
        std::vector<detail::SideDispatch> all;
        for (const Side& side : sides) {
            std::vector<detail::BoundResource> bound;
            for (const Side::Part& part : side.parts) {
                detail::BoundResource& one = bound.emplace_back();
                one.resource = index(part.thing);
                one.offset = part.offset;
                one.size = part.size;
            }
            detail::SideDispatch& dispatch = all.emplace_back();
            dispatch.bindings.bound = store(std::span<const detail::BoundResource>(bound));
            dispatch.bindings.bound_count = static_cast<uint32_t>(bound.size());
            dispatch.first_access = static_cast<uint32_t>(list_->accesses.size() + touches.size());
            dispatch.access_count = static_cast<uint32_t>(side.touches.size());
            touches.insert(touches.end(), side.touches.begin(), side.touches.end());
        }
        detail::SideDispatchesCommand command;
        command.dispatches = store(std::span<const detail::SideDispatch>(all));
        command.count = static_cast<uint32_t>(all.size());
        return append(command, CommandType::SideDispatches, touches);
    }
    List& draw(const std::vector<Touch>& touches) { return command(CommandType::Draw, touches); }

    List& begin(const std::vector<Touch>& touches, detail::StoreOperation store = detail::StoreOperation::Store) {
        detail::BeginTargetCommand command;
        for (const Touch& touch : touches) {
            detail::Attachment& attachment =
                touch.stage == Stage::DepthTarget ? command.depth : command.colors[command.color_count++];
            attachment.texture = index(touch.thing);
            attachment.slice = touch.slice;
            attachment.store = store;
        }
        return append(command, CommandType::BeginTarget, touches);
    }
    List& end() { return command(CommandType::EndTarget, {}); }

    List& push(const char* name) {
        detail::RegionCommand command;
        command.name = static_cast<uint32_t>(list_->bytes.size());
        const auto* text = reinterpret_cast<const std::byte*>(name);
        list_->bytes.insert(list_->bytes.end(), text, text + std::strlen(name) + 1);
        return append(command, CommandType::PushRegion, {});
    }
    List& pop() { return command(CommandType::PopRegion, {}); }

    /// Before the next command.
    List& barrier(StageMask source, StageMask destination, const std::vector<Turn>& turns = {}, bool split = false) {
        detail::Barrier barrier{.command = list_->command_count,
                                .source = source,
                                .destination = destination,
                                .first_image = static_cast<uint32_t>(images_.size()),
                                .image_count = static_cast<uint32_t>(turns.size()),
                                .split = split};
        for (const Turn& turn : turns)
            images_.push_back({index(turn.thing), turn.slice, turn.from, turn.to, turn.source, turn.destination});
        barriers_.push_back(barrier);
        return *this;
    }
    List& split(StageMask source, StageMask destination, const std::vector<Turn>& turns = {}) {
        return barrier(source, destination, turns, true);
    }
    List& turn(Thing& thing, Layout from, Layout to, StageMask source, StageMask destination,
               Slice slice = {0, 1, 0, 1}) {
        return barrier(0, 0, {{&thing, from, to, source, destination, slice}});
    }

    detail::ResolvedList resolved() const { return {list_.get(), barriers_, images_}; }

private:
    template <class Command>
    List& append(Command& command, CommandType type, const std::vector<Touch>& touches, bool untracked = false) {
        command.header.type = type;
        command.header.untracked = untracked;
        constexpr size_t size = (sizeof(Command) + 7) / 8 * 8;
        command.header.size = static_cast<uint32_t>(size);
        command.header.first_access = static_cast<uint32_t>(list_->accesses.size());
        command.header.access_count = static_cast<uint32_t>(touches.size());
        for (const Touch& touch : touches)
            list_->accesses.push_back({index(touch.thing), touch.stage, touch.flags, touch.layout, touch.slice});
        list_->commands.resize(list_->commands.size() + size);
        std::memcpy(list_->commands.data() + list_->commands.size() - size, &command, sizeof(Command));
        list_->command_count++;
        return *this;
    }
    template <class T>
    uint32_t store(std::span<const T> values) {
        const size_t place = (list_->bytes.size() + alignof(T) - 1) / alignof(T) * alignof(T);
        list_->bytes.resize(place + values.size_bytes());
        if (!values.empty()) std::memcpy(list_->bytes.data() + place, values.data(), values.size_bytes());
        return static_cast<uint32_t>(place);
    }
    uint32_t index(Thing* thing) {
        for (size_t i = 0; i < list_->resources.size(); i++)
            if (list_->resources[i] == thing->object()) return static_cast<uint32_t>(i);
        list_->resources.push_back(thing->object());
        return static_cast<uint32_t>(list_->resources.size() - 1);
    }

    std::shared_ptr<detail::CommandList> list_ = std::make_shared<detail::CommandList>();
    std::vector<detail::Barrier> barriers_;
    std::vector<detail::ImageBarrier> images_;
};

struct Wait {
    Queue queue;
    uint64_t value;
};

/// Judges one submission.
inline std::vector<Error> judge(null::HazardChecker& checker, Queue queue, uint64_t value,
                                const std::vector<List>& lists, const std::vector<Wait>& waits = {}) {
    std::vector<detail::ResolvedList> resolved;
    for (const List& list : lists) resolved.push_back(list.resolved());
    std::vector<detail::TimelinePoint> points;
    for (const Wait& wait : waits) points.push_back({wait.queue, wait.value});
    return checker.judge({.queue = queue, .lists = resolved, .waits = points, .value = value});
}

}  // namespace glint::test
