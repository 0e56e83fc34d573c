#include "traversal_skeleton.h"

#include <glint/base/format_error.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <set>

namespace glint::shader {

namespace {

using Group = TraversalSource::Group;

bool isNested(ShaderStage stage) { return stage == ShaderStage::RayMiss || stage == ShaderStage::Closest; }

class Writer {
public:
    Writer(const TraversalSource& source, const SkeletonNeeds& needs) : source_(source), needs_(needs) {}

    std::string run() {
        add("#include <glint/tracing/pipeline.h>\n");
        const auto& [width, height, depth] = source_.group_size;
        add("layout(local_size_x = {}, local_size_y = {}, local_size_z = {}) in;\n", width, height, depth);
        for (const StageCopy& copy : stageCopies(source_, needs_)) add("void {}() {{}}\n", stageFunction(copy));
        add("void glintRunFirstHit(const uint group) {{\n");
        choose(TraversalSource::Hit, &Group::first_hit, 0);
        add("}}\nvoid glintRunIntersection(const uint group) {{\n");
        choose(TraversalSource::Hit, &Group::intersection, 0);
        add("}}\n");
        // The innermost first: nobody calls upwards.
        for (uint32_t level = callableLevels(source_, needs_); level > 0; level--) writeCallable(level);
        for (uint32_t level = traceLevels(source_, needs_); level > 0; level--) writeTrace(level);
        writeMain();
        return std::move(text_);
    }

private:
    template <class... Args>
    void add(fmt::format_string<Args...> format, Args&&... args) {
        fmt::format_to(std::back_inserter(text_), format, std::forward<Args>(args)...);
    }

    /// Runs the stage that the groups of a table have as this member.
    void choose(TraversalSource::Table table, uint32_t Group::*member, uint32_t level) {
        std::map<uint32_t, std::vector<size_t>> stages;
        const std::vector<Group>& groups = source_.groups[table];
        for (size_t i = 0; i < groups.size(); i++)
            if (groups[i].*member != TraversalSource::none) stages[groups[i].*member].push_back(i);
        if (stages.empty()) return;
        add("switch (group) {{\n");
        for (const auto& [stage, indices] : stages) {
            for (const size_t index : indices) add("case {}u: ", index);
            add("{}(); break;\n", stageFunction(copyOf(stage, level)));
        }
        add("}}\n");
    }

    StageCopy copyOf(uint32_t stage, uint32_t level) const {
        const ShaderStage kind = source_.stages[stage].stage;
        const bool several =
            isNested(kind) ? needs_.traces[stage] : kind == ShaderStage::Callable && needs_.calls[stage];
        return {stage, several ? level : 0};
    }

    void writeTrace(uint32_t level) {
        add("rayQueryEXT glint_query{0};\n"
            "void glintTrace{0}(const uint flags, const uint mask, const uint offset, const uint stride, const uint "
            "miss,\n"
            "const vec3 origin, const float t_min, const vec3 direction, const float t_max) {{\n"
            "glintBeginRay(flags, mask, origin, t_min, direction);\n"
            "bool hits;\n"
            "uint group = glintSearch(glint_query{0}, t_max, offset, stride, hits);\n"
            "if (!hits) {{\n"
            "group = glintFindRecord(GLINT_TABLE_MISS, miss & 0xffffu);\n",
            level);
        choose(TraversalSource::Miss, &Group::general, level);
        add("}} else if ((flags & gl_RayFlagsSkipClosestHitShaderEXT) == 0u) {{\n");
        choose(TraversalSource::Hit, &Group::closest, level);
        add("}}\n}}\n");
    }

    void writeCallable(uint32_t level) {
        add("void glintCallable{}(const uint index) {{\n"
            "const uint group = glintFindRecord(GLINT_TABLE_CALLABLE, index);\n",
            level);
        choose(TraversalSource::Callable, &Group::general, level);
        add("}}\n");
    }

    void writeMain() {
        add("void main() {{\n"
            "if (any(greaterThanEqual(gl_GlobalInvocationID, glint_launch.rays.xyz))) return;\n"
            "glint_launch_id = gl_GlobalInvocationID;\n"
            "glint_launch_size = glint_launch.rays.xyz;\n"
            "glint_unwind = false;\n"
            "const uint group = glintFindRecord(GLINT_TABLE_GENERATION, glint_launch.rays.w);\n");
        choose(TraversalSource::Generation, &Group::general, 0);
        add("}}\n");
    }

    const TraversalSource& source_;
    const SkeletonNeeds& needs_;
    std::string text_;
};

/// The members of all groups of a table, each once.
std::set<uint32_t> stagesOf(const TraversalSource& source, TraversalSource::Table table, uint32_t Group::*member) {
    std::set<uint32_t> stages;
    for (const Group& group : source.groups[table])
        if (group.*member != TraversalSource::none) stages.insert(group.*member);
    return stages;
}

uint32_t levels(const TraversalSource& source, const std::vector<bool>& callers, uint32_t deepest, bool callables) {
    uint32_t result = 0;
    for (size_t i = 0; i < source.stages.size(); i++) {
        if (!callers[i]) continue;
        const ShaderStage stage = source.stages[i].stage;
        const bool again = callables ? stage == ShaderStage::Callable : isNested(stage);
        result = std::max(result, again ? deepest : std::min(deepest, 1u));
    }
    return result;
}

}  // namespace

uint32_t traceLevels(const TraversalSource& source, const SkeletonNeeds& needs) {
    return levels(source, needs.traces, source.recursion_depth, false);
}

uint32_t callableLevels(const TraversalSource& source, const SkeletonNeeds& needs) {
    return levels(source, needs.calls, source.callable_depth, true);
}

std::vector<StageCopy> stageCopies(const TraversalSource& source, const SkeletonNeeds& needs) {
    std::vector<StageCopy> copies;
    const auto add = [&](TraversalSource::Table table, uint32_t Group::*member, const std::vector<bool>& again,
                         uint32_t deepest) {
        for (const uint32_t stage : stagesOf(source, table, member)) {
            if (!again[stage]) copies.push_back({stage, 0});
            for (uint32_t level = 1; again[stage] && level <= deepest; level++) copies.push_back({stage, level});
        }
    };
    const std::vector<bool> never(source.stages.size(), false);
    add(TraversalSource::Generation, &Group::general, never, 0);
    add(TraversalSource::Hit, &Group::first_hit, never, 0);
    add(TraversalSource::Hit, &Group::intersection, never, 0);
    if (const uint32_t deepest = traceLevels(source, needs)) {
        add(TraversalSource::Miss, &Group::general, needs.traces, deepest);
        add(TraversalSource::Hit, &Group::closest, needs.traces, deepest);
    }
    if (const uint32_t deepest = callableLevels(source, needs))
        add(TraversalSource::Callable, &Group::general, needs.calls, deepest);
    return copies;
}

std::string stageFunction(const StageCopy& copy) { return fmt::format("glintStage{}_{}", copy.stage, copy.level); }

ShaderSource skeletonSource(const TraversalSource& source, const SkeletonNeeds& needs) {
    ShaderSource result;
    result.stage = ShaderStage::Compute;
    result.name = "<pipeline>";
    result.text = Writer(source, needs).run();
    result.macros =
        fmt::format("GLINT_JOIN_SET={}; GLINT_JOIN_BINDING={}; GLINT_PAYLOAD_WORDS={}; GLINT_CALLABLE_WORDS={}; "
                    "GLINT_ATTRIBUTE_WORDS={}; GLINT_PUSH_WORDS={}",
                    source.set, source.binding, std::max(needs.payload_words, 1u), std::max(needs.callable_words, 1u),
                    std::max(needs.attribute_words, 2u), std::max(needs.push_words, 1u));
    const auto use = [&](bool is_used, std::string_view what) {
        if (is_used) fmt::format_to(std::back_inserter(result.macros), "; GLINT_USES_{}", what);
    };
    use(needs.push_words != 0, "PUSH");
    use(needs.custom_index, "CUSTOM_INDEX");
    use(needs.object_ray, "OBJECT_RAY");
    use(needs.to_world, "TO_WORLD");
    use(needs.to_object, "TO_OBJECT");
    use(!stagesOf(source, TraversalSource::Hit, &Group::first_hit).empty(), "FIRST_HIT");
    use(!stagesOf(source, TraversalSource::Hit, &Group::intersection).empty(), "INTERSECTION");
    return result;
}

}  // namespace glint::shader
